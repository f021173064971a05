"""H4: a late answer is never taken for the answer to another request."""

import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.line.interface import (
    Answered,
    BlockRead,
    JobDone,
    Priority,
    Silent,
    Unsent,
    Want,
    Write,
)
from gateway.line.overhearing import MANY, Overhearing
from gateway.line.resync import LATE, Suspicion
from gateway.modbus import pdu
from tests.line.bench import Bench, FakeUnit, facts, frame

LOOP_BACK = {"functions": (3, 8, 16), "loop_back": True}
PLAIN = {"functions": (3, 16)}


def counting(address: int) -> int:
    """What a register holds: its own address, so that a value tells where it was read."""
    return 0x4000 + address


REGISTERS = {address: counting(address) for address in range(0x40)}


def wrong_values(bench: Bench) -> list[BlockRead]:
    return [
        block
        for block in bench.of(BlockRead)
        if block.words != tuple(counting(block.address + i) for i in range(len(block.words)))
    ]


def late(rng: random.Random, share: float, most: float):
    return lambda: rng.uniform(0.0, most) if rng.random() < share else 0.0


@pytest.mark.parametrize("unit", [LOOP_BACK, PLAIN], ids=["loop-back", "other length"])
@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32), st.sampled_from([0.02, 0.2]), st.sampled_from([0.1, 0.9, 4.0]))
def test_no_wrong_value_from_late_answers(unit, seed: int, share: float, most: float) -> None:
    rng = random.Random(seed)
    fake = FakeUnit(functions=unit["functions"], registers=dict(REGISTERS), late=late(rng, share, most))
    wants = [Want(5, 0x20, 1, 0.05), Want(5, 0x28, 1, 0.05), Want(5, 0x31, 1, 0.07), Want(5, 0x01, 2, 0.3)]
    bench = Bench([facts(**unit)], [fake]).start(*wants)
    bench.quiet = False  # a late answer may arrive while we speak
    bench.run(30)
    assert wrong_values(bench) == []
    assert bench.of(BlockRead), "it does not stay out of step for good"
    fake.late = lambda: 0.0
    done = len(bench.of(BlockRead))
    bench.run(20)
    assert len(bench.of(BlockRead)) > done + 100, "when the faults end, all is well again"


def test_h4_a_late_read_is_not_taken_for_the_next_of_the_same_length() -> None:
    fake = FakeUnit(registers=dict(REGISTERS))
    bench = Bench([facts()], [fake]).start(Want(5, 0x20, 1, 1.0), Want(5, 0x31, 1, 1.0))
    bench.quiet = False
    bench.run(20)
    delays = iter([0.2])
    fake.late = lambda: next(delays, 0.0)
    start = bench.now
    bench.run(20)
    assert wrong_values(bench) == []
    asked = [(at, data[5]) for at, sent, data in bench.wire if sent and at > start]
    [missed] = [at for (at, count), (_, then) in pairwise(asked) if (count, then) == (1, 2)][:1]
    again = next(at for at, count in asked if at > missed and count == 1)
    assert LATE <= again - missed <= LATE + 1.1, "for so long an answer may still come, whatever was answered"
    assert len([block for block in bench.of(BlockRead) if block.at > start]) >= 38, (
        "and all is read meanwhile"
    )


def test_after_an_answer_that_came_too_early_the_request_is_let_out_first() -> None:
    """Found by a world in a box (`python -m tests.prove`). The bench complains where silence is missing."""
    bench = Bench([facts(**PLAIN)], []).start(Want(5, 0x20, 1, 10.0))
    bench.receive(frame(bytes.fromhex("0503024020")), bench.now + 0.008)
    bench.at(bench.now + 0.006, lambda: bench.ask(Write(5, 2, (0,)), Priority.STOP) and None)
    bench.run(0.1)
    assert [data[1] for _, sent, data in bench.wire if sent] == [0x03, 0x10]


def test_talk_of_others_while_nothing_is_due_leaves_the_silence_before_a_request() -> None:
    """Found by a world in a box (`python -m tests.prove`). The bench complains where silence is missing."""
    bench = Bench([facts(**PLAIN)], [FakeUnit(functions=(3, 16))]).start(Want(5, 0x20, 1, 3.0))
    for n in range(100):
        bench.receive(b"\x07\x03", bench.now + 0.1 + n * 0.02)
    bench.at(bench.now + 2.0815, lambda: bench.ask(Write(5, 2, (0,))) and None)
    bench.run(2.5)
    assert [data[1] for _, sent, data in bench.wire if sent and data[1] == 0x10] == [0x10]


@pytest.mark.parametrize("seed", range(4))
def test_no_part_of_a_read_ends_at_a_register_that_was_only_passed_over(seed: int) -> None:
    """Found by a world in a box (`python -m tests.prove`): the core fell over."""
    rng = random.Random(seed)
    fake = FakeUnit(functions=(3, 16), registers=dict(REGISTERS), late=late(rng, 0.3, 3.0))
    unit = facts(**PLAIN, readable=((0x20, 0x21), (0x25, 0x26), (0x2A, 0x2A)), bridge=True, read_max=11)
    wants = [Want(5, 0x20, 1, 0.1), Want(5, 0x21, 1, 0.1), Want(5, 0x25, 2, 0.1), Want(5, 0x2A, 1, 0.1)]
    bench = Bench([unit], [fake]).start(*wants)
    bench.quiet = False
    bench.run(30)
    assert {block.address for block in bench.of(BlockRead)} >= {0x20}
    assert wrong_values(bench) == []


def test_the_nonce_is_fresh_each_time() -> None:
    fake = FakeUnit(functions=(3, 8, 16))
    bench = Bench([facts(**LOOP_BACK)], [fake]).start(Want(5, 0x20, 1, 0.5))
    bench.run(3)
    fake.on = False
    bench.run(1.0)
    fake.functions = (8,)
    fake.on = True
    bench.run(60)
    nonces = [data[4:6] for _, sent, data in bench.wire if sent and data[1] == 8]
    assert len(nonces) == len(set(nonces)) > 0


def test_h4_a_late_write_is_not_taken_for_the_next_write() -> None:
    fake = FakeUnit()
    bench = Bench([facts(reply_max=0.2)], [fake]).start()
    bench.quiet = False
    bench.run(1)
    delays = iter([0.4])
    fake.late = lambda: next(delays, 0.0)
    first = bench.ask(Write(5, 1, (1, 6000)))
    bench.run(0.3)
    assert bench.result(first) == Silent()
    fake.refuse = {16: 0x22}
    second = bench.ask(Write(5, 1, (1, 3000)))
    bench.run(12)
    late = "the late reply of the first proves nothing"
    assert bench.result(second) == Silent(damaged=True, doubted=True, code=0x22), late


def test_a_stop_waits_for_no_resynchronisation() -> None:
    fake = FakeUnit()
    bench = Bench([facts(reply_max=0.2)], [fake]).start()
    bench.quiet = False
    bench.run(1)
    delays = iter([0.35])
    fake.late = lambda: next(delays, 0.0)
    stop = Write(5, 1, (0,))
    first = bench.ask(stop, Priority.STOP)
    bench.run(0.25)
    assert bench.result(first) == Silent()
    second = bench.ask(stop, Priority.STOP)
    assert bench.wire[-1][1:] == (True, bytes.fromhex("05 10 00 01 00 01 02 00 00 95 41"))
    bench.run(0.2)
    assert bench.result(second) == Answered(), "a late reply to the very same stop says as much"
    run = bench.ask(Write(5, 1, (1, 6000)))
    bench.run(0.2)
    assert bench.result(run) == Answered()
    third = bench.ask(stop, Priority.STOP)
    bench.run(0.2)
    assert bench.result(third) == Silent(damaged=True, doubted=True), (
        "but nothing of a stop that was sent after a run"
    )
    bench.run(0.2 * LATE)
    fourth = bench.ask(stop, Priority.STOP)
    bench.run(0.2)
    assert bench.result(fourth) == Answered()


def test_without_any_other_request_the_unit_is_left_alone() -> None:
    fake = FakeUnit(registers=dict(REGISTERS))
    lonely = facts(readable=((0x20, 0x20),), reply_max=0.4)
    bench = Bench([lonely], [fake]).start(Want(5, 0x20, 1, 0.05))
    bench.run(2)
    delays = iter([0.1])
    fake.late = lambda: next(delays, 0.0)
    bench.run(2)
    bench.run(5)
    assert bench.line.counters.timeouts == 1
    asked = [at for at, sent, _ in bench.wire if sent]
    pause = max(b - a for a, b in pairwise(asked))
    assert 0.4 * LATE <= pause <= 2 * 0.4 * LATE, (
        "two may be under way: the lost one, and the one that showed life"
    )
    assert bench.line.up(5) is True
    assert wrong_values(bench) == []


def test_a_unit_that_refuses_everything_is_not_held_to_be_down_for_ever() -> None:
    fake = FakeUnit(refuse={3: 4, 8: 1})
    bench = Bench([facts(**LOOP_BACK)], [fake]).start(Want(5, 0x20, 1, 0.5))
    bench.run(10)
    fake.on = False
    bench.run(8)
    assert bench.line.up(5) is False
    fake.on = True
    bench.run(20)
    assert bench.line.up(5) is True


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32))
def test_every_job_is_told_once_whatever_happens(seed: int) -> None:
    rng = random.Random(seed)
    fakes = [FakeUnit(u, late=late(rng, 0.1, 2.0), registers=dict(REGISTERS)) for u in (1, 2, 3)]
    bench = Bench([facts(u) for u in (1, 2, 3)], fakes)
    bench.quiet = False
    bench.start(*(Want(u, a, 1, rng.uniform(0.05, 1)) for u in (1, 2, 3) for a in (0x20, 0x31)))
    jobs: dict[int, bool] = {}
    for _ in range(60):
        fake = rng.choice(fakes)
        match rng.randrange(8):
            case 0:
                fake.on = not fake.on
            case 1:
                fake.damage = not fake.damage
            case 2:
                bench.receive(
                    frame(bytes(rng.randrange(256) for _ in range(rng.randrange(1, 12)))), bench.now
                )
            case 3 if rng.random() < 0.3:
                bench.unplug()
                bench.port = True
            case _:
                write = Write(fake.unit, 2, (rng.randrange(5),))
                priority = rng.choice([Priority.STOP, Priority.COMMAND, Priority.READ])
                jobs[bench.ask(write, priority, ttl=rng.uniform(0.1, 5))] = True
        bench.run(rng.uniform(0.0, 0.6))
    bench.run(30)
    told = [action.id for action in bench.of(JobDone)]
    assert sorted(told) == sorted(jobs)
    assert wrong_values(bench) == []
    sent = sum(1 for _, out, data in bench.wire if out and data[1] == 16)
    done = sum(1 for action in bench.of(JobDone) if not isinstance(action.result, Unsent))
    assert sent == done, "each write was on the wire once, or not at all"


def test_h12_what_another_master_asks_is_heard_before_much_other_talk() -> None:
    """It was forgotten when more was said than is kept, and the drive's late answer was taken for ours."""
    overhearing = Overhearing("rtu")
    asked = frame(bytes((5, 3, 0, 0x80, 0, 1)))
    heard = list(overhearing.news(asked, 1.0, MANY))
    for unit in range(20, 60):
        heard += overhearing.news(frame(bytes((unit, 3, 4, 1, 2, 3, 4))), 2.0, MANY)
    heard += overhearing.news(b"", 3.0)
    assert [(unit, request.pdu) for unit, request, was_asked, _ in heard if was_asked] == [(5, asked[1:-2])]


@pytest.mark.parametrize(("spread", "delay"), [(0.0, 0.022), (0.02, 0.022), (0.0, 0.04)])
def test_h4_two_drives_at_one_address_are_not_believed(spread: float, delay: float) -> None:
    """Each request brings two answers, the second one perhaps while the next request is answered."""
    rng = random.Random(1)
    first, second = (
        FakeUnit(registers=dict(REGISTERS), late=lambda: rng.uniform(0, spread)) for _ in range(2)
    )
    second.delay = delay
    bench = Bench([facts(reply_max=0.3)], [first])
    bench.twins.append(second)
    bench.quiet = False
    bench.start(*(Want(5, address, 1, 0.05) for address in (0x20, 0x22, 0x31, 0x33))).run(60)
    assert not wrong_values(bench)
    assert len(bench.of(BlockRead)) == 1, "the first one only"


def test_h4_a_second_drive_that_is_switched_on_later_is_not_believed_for_long() -> None:
    """What it says before the first answer too many is seen looks like any answer."""
    first, second = (FakeUnit(registers=dict(REGISTERS)) for _ in range(2))
    second.delay, second.on = 0.1, False
    bench = Bench([facts(reply_max=0.3)], [first])
    bench.twins.append(second)
    bench.quiet = False
    bench.start(*(Want(5, address, 1, 0.05) for address in (0x20, 0x22, 0x31, 0x33))).run(20)
    before, second.on = len(bench.of(BlockRead)), True
    bench.run(60)
    assert before > 100
    assert len(wrong_values(bench)) <= 1
    assert len(bench.of(BlockRead)) - before <= 8


def test_h4_a_reply_that_is_there_before_it_can_be_is_an_older_one() -> None:
    """Until the last bit of the request is out nobody can have answered it."""
    bench = Bench([facts()], [FakeUnit(registers=dict(REGISTERS))])
    bench.start(Want(5, 0x20, 1, 0.2), Want(5, 0x32, 1, 0.2)).run(5)
    while not bench.wire or bench.wire[-1][0] < bench.now - 0.001:
        bench.run(0.001)
    bench.receive(frame(bytes((5, 3, 2, 0x12, 0x34))), bench.now + 0.003)
    bench.run(10)
    assert not wrong_values(bench)


def test_an_answer_that_nobody_asked_for_silences_a_unit_for_a_while_only() -> None:
    bench = Bench([facts(reply_max=0.3)], [FakeUnit(registers=dict(REGISTERS))])
    bench.start(Want(5, 0x20, 1, 0.2)).run(5)
    bench.run(0.1)
    bench.receive(frame(bytes((5, 3, 2, 0x12, 0x34))), bench.now + 0.002)
    start = bench.now
    bench.run(10)
    told = [block.at for block in bench.of(BlockRead) if block.at > start + 0.1]
    assert 0.3 <= told[0] - start <= 1.0, "and one answer more than that is only listened behind"


def test_h4_a_look_at_what_will_be_sent_forgets_no_late_answer() -> None:
    """An idle line foretells what it will send in ten seconds; until then the answer may still come."""
    suspicion = Suspicion(5, 1.0)
    missed, like_it = pdu.read_registers(1, 2), pdu.read_registers(9, 2)
    suspicion.missed(missed, 10.0)
    assert suspicion.shapes(20.0) == set()
    assert suspicion.shapes(11.0) == {missed.shape}
    assert suspicion.weigh(like_it, pdu.Reply((7, 7)), 11.0, 11.1) is None
