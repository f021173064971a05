"""Silences after transactions, writes that nobody answers, and error replies of a drive's own kind."""

import math

import pytest

from gateway.line.interface import (
    Answered,
    JobDone,
    JobSent,
    Priority,
    Read,
    Refused,
    Silent,
    Unsent,
    Want,
    Write,
)
from gateway.line.pauses import Pauses
from tests.line.bench import CHARACTER, SILENCE, Bench, FakeUnit, facts, frame

FREQUENCY = Want(5, 0x24, 1, 0.05)
STOP = Write(5, 1, (0,))


def bench_of(*units: int, **changes: object) -> Bench:
    return Bench([facts(u, **changes) for u in units], [FakeUnit(u) for u in units])


def sent_after(bench: Bench, at: float) -> list[float]:
    """When requests went out later than an instant."""
    return [t for t, sent, _ in bench.wire if sent and t > at]


def ends(bench: Bench, job: int) -> float:
    """When the last bit of a job's request left."""
    return next(action.at for action in bench.of(JobSent) if action.id == job)


def told(bench: Bench, job: int) -> float:
    """Since when the result of a job is known."""
    return next(action.at for action in bench.of(JobDone) if action.id == job)


def replies(bench: Bench) -> list[float]:
    return [t for t, sent, _ in bench.wire if not sent]


def test_a_pause_after_reads() -> None:
    bench = bench_of(5, pause_read=0.03).start(Want(5, 0x24, 1, 0.001))
    bench.run(5)
    silences = [min(sent_after(bench, at)) - at for at in replies(bench)[1:-1]]
    assert min(silences) >= 0.03 - 1e-9
    assert max(silences) == pytest.approx(0.03), "nor is the line idle longer than it must"
    assert bench.line.utilisation(bench.now) > 0.99
    [block] = bench.line.plan.blocks
    assert block.cost == pytest.approx((8 + 7) * CHARACTER + 0.005 + 0.03)


def test_a_pause_shorter_than_the_gap_changes_nothing() -> None:
    with_pause = bench_of(5, pause_read=SILENCE / 2).start(FREQUENCY)
    without = bench_of(5).start(FREQUENCY)
    with_pause.run(3)
    without.run(3)
    assert with_pause.wire == without.wire


@pytest.mark.parametrize(
    ("usual", "own", "longest"), [(0.2, 0.0, 0.2), (0.0, 0.7, 0.7), (0.2, 0.7, 0.7), (0.9, 0.7, 0.9)]
)
def test_a_pause_after_writes_is_the_longer_of_the_units_and_the_points(
    usual: float, own: float, longest: float
) -> None:
    bench = bench_of(5, pause_write=usual).start(FREQUENCY)
    bench.run(1.001)
    job = bench.ask(Write(5, 2, (1,), pause=own))
    following = bench.ask(Read(5, 0x20, 1))
    bench.run(3)
    assert bench.result(job) == Answered()
    done = told(bench, job)
    assert done < ends(bench, job) + 0.1, "the reply is told at once"
    assert min(sent_after(bench, done)) == pytest.approx(done + longest)
    assert bench.result(following) is not None


def test_a_refused_write_keeps_its_pause_too() -> None:
    bench = Bench([facts(pause_write=0.4)], [FakeUnit(refuse={16: 0x22})]).start(FREQUENCY)
    bench.run(1)
    job = bench.ask(Write(5, 2, (1,)))
    bench.run(2)
    assert bench.result(job) == Refused(0x22)
    assert min(sent_after(bench, told(bench, job))) - told(bench, job) >= 0.4 - 1e-9


def test_an_unanswered_write_keeps_its_pause_from_its_last_bit() -> None:
    bench = bench_of(5).start()
    bench.run(1)
    bench.fakes[5].on = False
    job = bench.ask(Write(5, 2, (1,), pause=3.0))
    after = bench.ask(Read(5, 0x20, 1))
    bench.run(5)
    assert bench.result(job) == Silent()
    assert told(bench, job) < ends(bench, job) + 1.1
    assert min(sent_after(bench, told(bench, job))) == pytest.approx(ends(bench, job) + 3.0)
    assert bench.result(after) == Silent()


def test_a_stop_to_another_drive_waits_for_no_pause() -> None:
    bench = bench_of(5, 6).start(FREQUENCY, Want(6, 0x24, 1, 0.05))
    bench.run(1.001)
    store = bench.ask(Write(5, 2, (1,), pause=5.0))
    bench.run(0.2)
    asked = bench.now
    other = bench.ask(Write(6, 1, (0,)), Priority.STOP)
    own = bench.ask(STOP, Priority.STOP)
    setpoint = bench.ask(Write(6, 2, (7,)))
    assert bench.wire[-1][:2] == (asked, True), "the stop goes out at once"
    bench.run(10)
    free = told(bench, store) + 5.0
    assert bench.result(other) == bench.result(own) == bench.result(setpoint) == Answered()
    assert ends(bench, own) >= free, "a drive that stores hears nothing"
    assert ends(bench, own) == pytest.approx(free + 11 * CHARACTER)
    assert sent_after(bench, told(bench, store))[:2] == [asked, pytest.approx(free)]
    assert ends(bench, setpoint) > free, "only a stop breaks the silence"


def test_a_silent_write_awaits_no_answer() -> None:
    bench = bench_of(5).start(FREQUENCY)
    bench.run(1.001)
    bench.fakes[5].on = False
    job = bench.ask(Write(5, 2, (0x9696,), silent=True, pause=0.5))
    bench.run(0.2)
    assert bench.result(job) is None, "told when its pause is over, not before"
    bench.fakes[5].on = True
    bench.run(1)
    assert bench.result(job) == Answered()
    assert told(bench, job) == pytest.approx(ends(bench, job) + 0.5)
    assert min(sent_after(bench, ends(bench, job))) == pytest.approx(ends(bench, job) + 0.5)
    assert bench.line.counters.timeouts == 0
    assert bench.line.up(5) is True


def test_a_silent_write_without_a_pause_keeps_the_gap() -> None:
    bench = bench_of(5).start()
    bench.run(1)
    jobs = [bench.ask(Write(5, 2, (n,), silent=True)) for n in range(3)]
    bench.fakes[5].on = False
    bench.run(1)
    assert [bench.result(job) for job in jobs] == [Answered()] * 3
    starts = [t for t, sent, _ in bench.wire if sent]
    assert starts[1] - ends(bench, jobs[0]) == pytest.approx(SILENCE)
    assert told(bench, jobs[0]) == pytest.approx(ends(bench, jobs[0]) + SILENCE)


def test_a_drive_that_answers_a_silent_write_all_the_same_misleads_nobody() -> None:
    bench = bench_of(5).start()
    bench.fakes[5].registers[0x24] = 6000
    bench.run(1)
    job = bench.ask(Write(5, 2, (1,), silent=True, pause=0.2))
    read = bench.ask(Read(5, 0x24, 1))
    bench.run(2)
    assert (bench.result(job), bench.result(read)) == (Answered(), Answered((6000,)))


def test_a_port_that_goes_during_the_pause_leaves_a_silent_write_unknown() -> None:
    bench = bench_of(5).start(FREQUENCY)
    bench.run(1.001)
    job, waiting = bench.ask(Write(5, 2, (1,), silent=True, pause=2.0)), bench.ask(STOP)
    bench.run(0.2)
    bench.unplug()
    assert bench.result(job) == Silent()
    assert bench.result(waiting) == Unsent("line_down")
    bench.run(5)
    assert len([action for action in bench.of(JobDone) if action.id == job]) == 1


def test_a_broadcast_is_answered_when_its_pause_is_over() -> None:
    units = [facts(1, pause_broadcast=0.05), facts(2, pause_broadcast=0.3)]
    bench = Bench(units, [FakeUnit(1), FakeUnit(2)]).start(Want(1, 0x24, 1, 0.05))
    bench.run(1.001)
    job = bench.ask(Write(0, 1, (0,)), Priority.STOP)
    second = bench.ask(Write(1, 1, (0,)), Priority.STOP)
    bench.run(1)
    assert bench.result(job) == bench.result(second) == Answered()
    assert told(bench, job) == pytest.approx(ends(bench, job) + 0.3), "the longest pause of all units"
    assert min(sent_after(bench, ends(bench, job))) == pytest.approx(ends(bench, job) + 0.3)
    assert [fake.writes[0] for fake in bench.fakes.values()] == [(1, (0,))] * 2


def test_expired_jobs_are_told_during_a_pause() -> None:
    bench = bench_of(5).start()
    bench.run(1)
    bench.ask(Write(5, 2, (1,), pause=5.0))
    bench.run(0.2)
    job = bench.ask(Write(5, 2, (2,)), ttl=0.5)
    bench.run(1)
    assert bench.result(job) == Unsent("expired")


def test_probes_keep_out_of_a_pause() -> None:
    bench = Bench([facts(5), facts(6)], [FakeUnit(5), FakeUnit(6, on=False)])
    bench.start(FREQUENCY, Want(6, 0x24, 1, 0.05))
    bench.run(20)
    assert bench.line.up(6) is False
    job = bench.ask(Write(5, 2, (1,), pause=12.0))
    bench.run(11)
    assert sent_after(bench, told(bench, job)) == []
    bench.run(20)
    assert len(sent_after(bench, told(bench, job))) > 100


class Powtran(FakeUnit):
    """Says in the function byte that there is an error, whatever the function was."""

    byte = 0xA1

    def _reply(self, request: bytes) -> bytes:
        if request[1] in self.refuse:
            return frame(bytes((self.unit, self.byte, self.refuse[request[1]])))
        return super()._reply(request)


def test_error_functions_are_refusals() -> None:
    unit = facts(error_functions=(0xA0, 0xA1, 0xA2, 0xA3))
    bench = Bench([unit], [Powtran(refuse={3: 0x07, 16: 0x99})]).start()
    bench.run(1)
    read, write = bench.ask(Read(5, 0x20, 1)), bench.ask(STOP)
    bench.run(1)
    assert bench.result(read) == Refused(0x07)
    assert bench.result(write) == Refused(0x99)
    assert bench.line.counters.timeouts == 0
    assert bench.line.up(5) is True


def test_error_functions_that_are_not_declared_are_no_reply() -> None:
    bench = Bench([facts()], [Powtran(refuse={3: 0x07})]).start()
    bench.run(1)
    job = bench.ask(Read(5, 0x20, 1))
    bench.run(3)
    assert bench.result(job) == Silent(damaged=True)


def test_a_late_error_of_another_function_is_no_answer() -> None:
    """Such a byte names no function: while an answer is missing it may belong to an older request."""
    bench = Bench([facts(error_functions=(0xA1,))], [Powtran()]).start(FREQUENCY)
    bench.run(2.001)
    bench.demand()
    bench.fakes[5].refuse = {3: 0x07}
    late = iter([0.08])
    bench.fakes[5].late = lambda: next(late, 0.0)
    read = bench.ask(Read(5, 0x20, 1))
    bench.run(0.075)
    assert bench.result(read) == Silent(), "it answers later than it ever did"
    bench.quiet = False  # the late answer falls into our next request
    write = bench.ask(STOP)
    bench.run(2)
    assert bench.result(write) == Answered()


def test_h20_a_stop_does_not_wait_while_the_line_listens_for_a_second_answer() -> None:
    """Behind the first answer of a unit nothing else is asked for a moment."""
    pauses = Pauses()
    pauses.listen(10.0, 5.0)
    assert pauses.until() == 10.1, "nor does anybody wait for long"
    assert pauses.until_for_stop(5) == pauses.until_for_stop(0) == -math.inf
