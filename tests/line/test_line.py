"""The machine in virtual time: who is asked when, and what is told."""

import random

import pytest

from gateway.line.interface import (
    Answered,
    BlockFailed,
    BlockRead,
    ClosePort,
    JobDone,
    JobSent,
    LineSettings,
    OpenPort,
    Priority,
    Read,
    Refused,
    Silent,
    Transmit,
    UnitDown,
    UnitUp,
    Unsent,
    Want,
    Write,
)
from gateway.mapping.profile import SerialFormat, Table
from tests.line.bench import CHARACTER, SILENCE, Bench, FakeUnit, facts

FREQUENCY = Want(5, 0x24, 1, 0.2)
STOP = Write(5, 1, (0,))
RUN = Write(5, 1, (1, 6000))


def one(**unit) -> Bench:
    return Bench([facts()], [FakeUnit(**unit)])


def requests(bench: Bench, start: float = 0.0) -> list[bytes]:
    return [data for at, sent, data in bench.wire if sent and at >= start]


def test_what_is_wanted_is_read_in_phase() -> None:
    bench = one(registers={0x24: 6000}).start(FREQUENCY)
    bench.run(10)
    assert bench.values(0x24) == [6000] * len(bench.values(0x24))
    assert len(bench.values(0x24)) in (50, 51)
    assert bench.of(UnitUp) == [UnitUp(5, bench.of(UnitUp)[0].at)]
    assert bench.line.up(5) is True


def test_nothing_is_asked_that_nobody_wants() -> None:
    bench = one().start()
    bench.run(100)
    assert requests(bench) == []
    assert bench.line.wake() is None
    bench.demand(FREQUENCY)
    bench.run(1)
    bench.demand()
    asked = len(requests(bench))
    bench.run(10)
    assert len(requests(bench)) == asked > 0


def test_a_full_line_has_no_idle_gap() -> None:
    wants = [Want(u, 0x20, 5, 0.001) for u in range(1, 9)]
    bench = Bench([facts(u) for u in range(1, 9)], [FakeUnit(u) for u in range(1, 9)]).start(*wants)
    bench.run(30)
    before, start = bench.line.counters.answered, bench.now
    bench.run(10)
    cost = (8 + 15) * CHARACTER + 0.005 + SILENCE
    done = bench.line.counters.answered - before
    assert done * cost / (bench.now - start) >= 0.995
    assert bench.line.utilisation(bench.now) >= 0.995
    assert max(bench.times(BlockRead)) > bench.now - 1
    asked = {u: sum(1 for d in requests(bench, start) if d[0] == u) for u in range(1, 9)}
    assert max(asked.values()) - min(asked.values()) <= 1


def test_a_write_waits_for_one_transaction_at_most() -> None:
    wants = [Want(5, 0x20, 5, 0.001), Want(5, 0x27, 7, 0.001)]
    bench = one().start(*wants)
    bench.run(1.003)
    asked = bench.now
    job = bench.ask(RUN)
    bench.run(1)
    assert bench.result(job) == Answered()
    longest = (8 + 19) * CHARACTER + 0.005 + SILENCE
    sent = next(action.at for action in bench.of(JobSent) if action.id == job)
    assert sent - asked <= longest + 13 * CHARACTER + 1e-9
    assert bench.fakes[5].writes == [(1, (1, 6000))]


def test_writes_leave_reads_half_of_the_line() -> None:
    bench = one().start(Want(5, 0x20, 5, 0.001))
    bench.run(1)
    jobs = [bench.ask(Write(5, 2, (n,))) for n in range(200)]
    start = bench.now
    bench.run(3)
    asked = requests(bench, start)
    writing = sum(len(d) + 8 for d in asked if d[1] == 16)
    reading = sum(len(d) + 15 for d in asked if d[1] == 3)
    assert reading >= 0.45 * (reading + writing)
    assert writing >= 0.3 * (reading + writing)
    bench.run(20)
    assert all(bench.result(job) == Answered() for job in jobs)
    assert [words[0] for _, words in bench.fakes[5].writes] == list(range(200)), (
        "in the order asked, once each"
    )


def test_stop_overtakes_everything_that_waits() -> None:
    bench = one().start(Want(5, 0x20, 5, 0.001))
    bench.run(1.001)
    others = [bench.ask(Write(5, 2, (n,))) for n in range(5)]
    stop = bench.ask(STOP, Priority.STOP)
    bench.run(0.1)
    assert bench.result(stop) == Answered()
    sent = [action.id for action in bench.of(JobSent)]
    assert sent.index(stop) <= 1, "behind what was on the wire at most"
    bench.run(5)
    assert all(bench.result(job) == Answered() for job in others)


def test_an_idle_line_writes_at_once() -> None:
    bench = one().start()
    bench.run(1)
    bench.ask(RUN)
    assert bench.wire[-1] == (bench.now, True, bytes.fromhex("05 10 00 01 00 02 04 00 01 17 70 78 87"))


def test_job_reads() -> None:
    bench = one(registers={0x31: 540, 0x32: 7}).start()
    bench.run(1)
    for priority in (Priority.COMMAND, Priority.READ, Priority.PROBE):
        job = bench.ask(Read(5, 0x31, 2), priority)
        bench.run(0.1)
        assert bench.result(job) == Answered((540, 7))


def test_exceptions_are_results_and_unknown_codes_are_numbers() -> None:
    bench = one(refuse={16: 0x99}).start()
    bench.run(1)
    job = bench.ask(RUN)
    bench.run(0.2)
    assert bench.result(job) == Refused(0x99)
    assert bench.line.counters.refused == 1
    assert bench.line.up(5) is True, "a unit that refuses is there"


def test_refused_blocks_are_told_and_slow_down() -> None:
    bench = one(refuse={3: 2}).start(FREQUENCY)
    bench.run(30)
    failed = bench.of(BlockFailed)
    assert {f.result for f in failed} == {Refused(2)}
    assert 6 <= len(failed) <= 7
    assert bench.line.up(5) is True
    bench.fakes[5].refuse.clear()
    bench.run(6)
    assert len(bench.values(0x24)) > 1


def test_a_write_that_times_out_is_told_once_and_not_repeated() -> None:
    bench = one().start(FREQUENCY)
    bench.run(1)
    bench.fakes[5].on = False
    job = bench.ask(RUN)
    bench.run(5)
    assert bench.result(job) == Silent(damaged=False)
    assert sum(1 for d in requests(bench) if d[1] == 16) == 1


def test_a_damaged_reply_is_no_reply() -> None:
    bench = one().start()
    bench.run(1)
    bench.fakes[5].damage = True
    job = bench.ask(RUN)
    bench.run(3)
    assert bench.result(job) == Silent(damaged=True)
    assert bench.line.counters.damaged == 1
    assert bench.line.counters.timeouts == 0


def test_jobs_expire_unsent() -> None:
    bench = one(on=False).start(FREQUENCY)
    bench.run(5)
    assert bench.line.up(5) is False
    job = bench.ask(RUN, ttl=0.5)
    bench.run(1)
    assert bench.result(job) == Unsent("expired")
    assert all(d[1] != 16 for d in requests(bench))
    done = next(action for action in bench.of(JobDone) if action.id == job)
    assert done.at == pytest.approx(105.5, abs=0.3)


def test_stop_goes_even_to_a_unit_that_is_down() -> None:
    bench = one(on=False).start(FREQUENCY)
    bench.run(6)
    stop = bench.ask(STOP, Priority.STOP)
    bench.run(1.5)
    assert bench.result(stop) == Silent()
    assert sum(1 for d in requests(bench) if d[1] == 16) == 1


def test_a_job_for_a_unit_that_comes_back_is_sent_then() -> None:
    bench = one(on=False).start(FREQUENCY)
    bench.run(5)
    job = bench.ask(RUN, ttl=60)
    bench.run(1)
    assert bench.result(job) is None
    bench.fakes[5].on = True
    bench.run(40)
    assert bench.result(job) == Answered()


def test_withdrawn_jobs_are_not_told() -> None:
    bench = one().start(FREQUENCY)
    bench.run(1.0001)
    first, second = bench.ask(RUN), bench.ask(RUN)
    assert bench.line.withdraw(second, bench.now) is True
    bench.run(1)
    assert bench.result(first) == Answered()
    assert bench.result(second) is None
    assert bench.line.withdraw(first, bench.now) is False
    assert len(bench.fakes[5].writes) == 1


def test_admission_is_asked_just_before_sending() -> None:
    asked: list[tuple[float, int]] = []
    admitted = {1}

    def admit(job_id: int) -> bool:
        asked.append((bench.now, job_id))
        return job_id in admitted

    bench = Bench([facts()], [FakeUnit()], admit=admit)
    bench.start(FREQUENCY)
    bench.run(1.0001)
    first, second, third = bench.ask(RUN), bench.ask(RUN), bench.ask(RUN)
    admitted.add(third)
    bench.run(1)
    assert [bench.result(job) for job in (first, second, third)] == [
        Answered(),
        Unsent("not_admitted"),
        Answered(),
    ]
    sent = [at for at, action in bench.log if isinstance(action, JobSent)]
    assert [at for at, job in asked if job != second] == sent


def test_a_dead_unit_costs_the_others_little() -> None:
    units = [facts(u) for u in range(1, 9)]
    fakes = [FakeUnit(u, on=u > 3) for u in range(1, 9)]
    bench = Bench(units, fakes).start(*(Want(u, 0x20, 5, 0.001) for u in range(1, 9)))
    bench.run(60)
    assert {action.unit for action in bench.of(UnitDown)} == {1, 2, 3}
    before = bench.line.counters.answered
    bench.run(60)
    cost = (8 + 15) * CHARACTER + 0.005 + SILENCE
    assert (bench.line.counters.answered - before) * cost / 60 >= 0.965
    gaps = [
        b - a for a, b in zip(bench.times(BlockRead), bench.times(BlockRead)[1:], strict=False) if a > 160
    ]
    assert max(gaps) < 1.2


def test_a_unit_that_returns_is_seen_soon() -> None:
    units = [facts(u) for u in range(1, 5)]
    fakes = [FakeUnit(u, on=u > 2) for u in range(1, 5)]
    bench = Bench(units, fakes).start(*(Want(u, 0x20, 5, 0.2) for u in range(1, 5)))
    bench.run(60)
    bench.fakes[1].on = True
    start = bench.now
    bench.run(30)
    back = next(action.at for action in bench.of(UnitUp) if action.unit == 1)
    probe = 0.06 + (8 + 7) * CHARACTER + SILENCE
    assert back - start <= max(5.0, 2 * probe / 0.03) + 1.0
    assert len([b for b in bench.of(BlockRead) if b.unit == 1]) > 20


def test_blocks_of_a_silent_unit_are_told_as_failed() -> None:
    bench = one(registers={0x24: 1}).start(FREQUENCY, Want(5, 0x31, 1, 1.0))
    bench.run(3)
    bench.fakes[5].on = False
    bench.run(5)
    down = bench.of(UnitDown)
    assert [d.unit for d in down] == [5]
    assert {f.address for f in bench.of(BlockFailed)} >= {0x24, 0x31}
    assert all(f.result == Silent() for f in bench.of(BlockFailed))
    lost = len(bench.of(BlockFailed))
    bench.demand(FREQUENCY)
    assert len(bench.of(BlockFailed)) == lost + 1, "who asks now is told at once"


def test_a_short_hiccup_does_not_take_a_unit_down() -> None:
    bench = one().start(FREQUENCY)
    bench.run(10)
    bench.fakes[5].on = False
    bench.run(0.4)
    bench.fakes[5].on = True
    bench.run(5)
    assert bench.of(UnitDown) == []
    assert bench.line.up(5) is True


def test_port_lost_and_found() -> None:
    bench = one().start(FREQUENCY)
    bench.run(1.0001)
    bench.fakes[5].delay = 0.3
    sent, waiting = bench.ask(RUN), bench.ask(RUN)
    bench.run(0.06)
    assert bench.result(sent) is None
    bench.unplug()
    assert bench.result(sent) == Silent()
    assert bench.result(waiting) == Unsent("line_down")
    assert bench.line.is_open is False
    assert bench.line.down_reason == "unplugged"
    assert bench.line.up(5) is None
    late = bench.ask(RUN)
    assert bench.result(late) == Unsent("line_down")
    bench.run(20)
    pauses = [b - a for a, b in zip(bench.times(OpenPort)[1:], bench.times(OpenPort)[2:], strict=False)]
    assert pauses == sorted(pauses)
    assert max(pauses) <= 5.01
    assert min(pauses) >= 0.5
    bench.port = True
    bench.fakes[5].delay = 0.005
    seen = len(bench.values(0x24))
    bench.run(6)
    assert bench.line.is_open
    assert len(bench.values(0x24)) > seen
    assert sum(1 for d in requests(bench) if d[1] == 16) == 1, "nothing is written again"


def test_stop_closes_and_tells_everyone() -> None:
    bench = one().start(FREQUENCY)
    bench.run(1.0001)
    job = bench.ask(RUN)
    bench._carry_out(bench.line.stop(bench.now))
    assert bench.result(job) in (Silent(), Unsent("line_down"))
    assert len(bench.of(ClosePort)) == 1
    assert bench.line.wake() is None
    assert bench.line.stop(bench.now) == []


def test_broadcasts_await_nothing() -> None:
    bench = Bench([facts(1), facts(2)], [FakeUnit(1), FakeUnit(2)]).start(Want(1, 0x24, 1, 0.05))
    bench.run(1.001)
    job = bench.ask(Write(0, 1, (0,)), Priority.STOP)
    bench.run(0.5)
    assert bench.result(job) == Answered(), "sent; nothing is known of its effect"
    assert [fake.writes for fake in bench.fakes.values()] == [[(1, (0,))]] * 2
    at = next(at for at, sent, data in bench.wire if sent and data[0] == 0)
    following = min(t for t, sent, _ in bench.wire if sent and t > at)
    assert following - at >= 0.1


def test_own_echo_declared_or_not() -> None:
    for declared in (True, False):
        settings = LineSettings(
            name="north", framing="rtu", baud=9600, format=SerialFormat(8, "N", 2), echo=declared
        )
        bench = Bench([facts(functions=(3, 6), write_one=6)], [FakeUnit(functions=(3, 6))], settings)
        bench.echo = True
        bench.start(FREQUENCY)
        bench.run(2)
        assert bench.line.up(5) is True
        assert bench.line.counters.timeouts == 0
        bench.fakes[5].on = False
        job = bench.ask(Write(5, 2, (1,)))
        bench.run(2)
        assert bench.result(job) == Silent(), "our own echo is not the drive's answer"


def test_strays_postpone_a_request_only_so_long() -> None:
    bench = one().start(Want(5, 0x24, 1, 0.5))
    bench.run(1)
    bench.quiet = False  # nobody can keep a silence that others break
    for n in range(2000):
        bench.receive(b"\xaa", bench.now + 0.001 * n)
    start, before = bench.now, bench.line.counters.answered
    bench.run(2)
    asked = [at for at, sent, _ in bench.wire if sent and at > start]
    assert asked[0] - start <= 0.5 + 0.1 + 0.02
    assert bench.line.counters.answered == before, "what bytes follow at once is no reply"
    bench.run(10)
    assert bench.line.counters.answered > before + 10


def test_a_late_stranger_is_left_to_end() -> None:
    bench = one().start(Want(5, 0x24, 1, 0.5))
    bench.run(1.05)
    due = bench.line.wake()
    assert due is not None
    bench.receive(b"\x07\x03\x02\x00\x00\x00\x00", due - 0.001)
    bench.run(1)
    asked = next(at for at, sent, _ in bench.wire if sent and at >= due)
    assert asked - due == pytest.approx(SILENCE - 0.001)


def test_the_first_reply_may_take_as_long_as_the_profile_says() -> None:
    bench = one(delay=0.9).start(FREQUENCY)
    bench.run(20)
    assert bench.line.counters.timeouts == 0
    assert len(bench.values(0x24)) > 15


def test_a_latency_timer_of_16_ms_takes_no_unit_down() -> None:
    jitter = iter([0.0, 0.016, 0.004, 0.012, 0.0, 0.0, 0.0, 0.0, 0.016] * 10_000)
    bench = one(delay=0.002, late=lambda: next(jitter)).start(FREQUENCY)
    bench.run(300)
    assert bench.line.counters.timeouts == 0


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (Read(5, 0x25, 1), "cannot be read"),
        (Read(5, 0x24, 4), "cannot be read"),
        (Read(5, 0x20, 1, Table.COIL), "table"),
        (Read(5, 0x20, 1, Table.INPUT), "04H"),
        (Read(9, 0x20, 1), "no unit 9"),
        (Read(0, 0x20, 1), "03H|cannot be read"),
        (Write(5, 1, (0,) * 17), "takes 16"),
        (Write(5, 1, ()), "0 registers"),
    ],
)
def test_what_cannot_be_asked_is_refused_with_its_reason(request_, words: str) -> None:
    bench = one().start()
    with pytest.raises(ValueError, match=words):
        bench.ask(request_)
    assert bench.of(Transmit) == []


def test_wants_that_can_never_be_met_are_refused() -> None:
    bench = one().start()
    for want in (Want(5, 0x25, 1, 1.0), Want(7, 0x20, 1, 1.0), Want(5, 0x20, 1, 0.0)):
        with pytest.raises(ValueError, match=r"."):
            bench.demand(want)


def test_function_06_is_used_where_the_profile_says_so() -> None:
    unit = facts(functions=(3, 6, 16), write_one=6)
    bench = Bench([unit], [FakeUnit(functions=(3, 6, 16))]).start()
    bench.run(1)
    jobs = [bench.ask(Write(5, 2, (7,))), bench.ask(Write(5, 1, (1, 2)))]
    bench.run(1)
    assert [bench.result(job) for job in jobs] == [Answered(), Answered()]
    assert [d[1] for d in requests(bench)] == [3, 6, 16], "a read first shows whether there is an echo"


def test_the_plan_follows_what_is_learned() -> None:
    bench = one(delay=0.03).start(*(Want(5, a, 1, 0.1) for a in (0x20, 0x28, 0x31)))
    first = bench.line.plan
    bench.run(12)
    assert bench.line.plan.load > first.load
    bench.run(10)
    assert len(bench.values(0x20)) > 50


def test_time_counts_from_when_a_request_left() -> None:
    """A host that stalls between decision and wire neither gives up a reply too soon nor breaks the silence
    after a request that nobody answers."""
    wants = [Want(5, 0x20, 5, 0.01), Want(5, 0x27, 7, 0.01)]
    bench = one(delay=0.02)
    bench.start(*wants).run(5)
    bench.lag = lambda: chance.choice((0.0, 0.0001, 0.001, 0.02, 0.3))
    chance = random.Random(7)
    for _ in range(50):
        bench.ask(Write(0, 1, (0,)))
        bench.run(2)
    assert bench.line.counters.timeouts == bench.line.counters.damaged == 0
    assert bench.line.counters.answered > 200
