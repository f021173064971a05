"""A line that another master uses too: each drive has its turn, nothing wrong is told, the cause is named."""

from __future__ import annotations

import pytest

from gateway.line.doctor.finding import Illness
from gateway.line.interface import BlockRead, Want
from gateway.line.resync import Suspicion
from gateway.modbus import pdu
from tests.line.bench import CHARACTER, Bench, FakeUnit, facts, frame, seeded
from tests.line.test_doctor import Ward

HORIZON = 6.0
"""Seconds that the answer of a unit with a longest reply of one second may be late."""


def shared(every: float, seconds: float = 60.0, answers: bool = True) -> Bench:
    """Three drives with one block each, and a master who asks the second one just what we ask."""
    numbers = (1, 2, 3)
    fakes = [FakeUnit(unit, on=answers) for unit in numbers]
    for fake in fakes:
        fake.registers = {address: 256 * fake.unit + address for address in range(64)}
    bench = Bench([facts(unit, readable=((1, 2),), probe=(1, 1)) for unit in numbers], fakes)
    bench.quiet = False
    bench.start(*(Want(unit, 1, 2, 0.3) for unit in numbers))
    draw, at = seeded(1), bench.now + 2.0
    request = frame(bytes((2, 3, 0, 1, 0, 2)))
    reply = frame(bytes((2, 3, 4, 2, 1, 2, 2)))
    while at < bench.now + seconds:
        bench.receive(request, at)
        bench.receive(reply, at + 0.006 + len(reply) * CHARACTER)
        at += every * draw.uniform(0.8, 1.2)
    return bench


@pytest.mark.parametrize("every", [3.0, 1.0, 0.3])
def test_a_drive_that_another_master_asks_the_same_has_its_turn_and_is_believed_in_the_end(
    every: float,
) -> None:
    bench = shared(every)
    ward = Ward(bench).watch(60)
    asked = [sum(sent and data[0] == unit for _, sent, data in bench.wire) for unit in (1, 2, 3)]
    assert asked[1] >= asked[0] / 8
    told = [block for block in bench.of(BlockRead) if block.unit == 2]
    assert len(told) > 25
    assert {block.words for block in told} == {(0x201, 0x202)}
    assert ward.told == {Illness.FOREIGN_MASTER}


def test_what_is_believed_at_last_is_told_to_be_as_old_as_it_may_be() -> None:
    bench = shared(1.0, seconds=120.0)
    bench.run(120.0)
    ages = [when - block.at for when, block in bench.log if isinstance(block, BlockRead) and block.unit == 2]
    assert max(ages) < 40


def test_another_master_is_named_while_no_drive_answers_us() -> None:
    bench = shared(0.7, answers=False)
    assert Illness.FOREIGN_MASTER in Ward(bench).watch(12).told


def test_answers_of_many_others_are_not_counted_as_one() -> None:
    """Each time ours is lost, and what we hear is the answer to what somebody else asked."""
    suspicion = Suspicion(5, HORIZON / 6)
    ours, theirs = pdu.read_registers(1, 2), pdu.read_registers(9, 2)
    reply = pdu.Reply((7, 7))
    for number in range(20):
        at = 10.0 + number * (HORIZON + 1)
        suspicion.missed(theirs, at)
        assert suspicion.weigh(ours, reply, at + 0.1, at + 0.2) is None


def test_more_of_the_same_than_others_can_have_brought_is_believed() -> None:
    suspicion = Suspicion(5, HORIZON / 6)
    ours, theirs = pdu.read_registers(1, 2), pdu.read_registers(9, 2)
    reply = pdu.Reply((7, 7))
    suspicion.missed(theirs, 10.0)
    suspicion.missed(theirs, 10.0)
    assert suspicion.weigh(ours, reply, 10.1, 10.2) is None
    assert suspicion.weigh(ours, reply, 10.3, 10.4) is None
    assert suspicion.weigh(ours, reply, 10.5, 10.6) == pytest.approx(10.2)


@pytest.mark.parametrize("stranger", [2, 17])
def test_what_follows_a_damaged_question_of_another_master_is_not_believed(stranger: int) -> None:
    """He is heard now and then; once his question comes in damaged, and its answer before ours."""
    bench = Bench([facts(1)], [FakeUnit(1)])
    bench.quiet = False
    bench.start(Want(1, 0x27, 5, 0.3))
    for number in range(10):
        bench.receive(frame(bytes((stranger, 3, 0, 0x50, 0, 1))), bench.now + 0.25 + 2.0 * number)
    bench.run(2.0)
    theirs = frame(bytes((1, 3, 10)) + bytes((9, 9)) * 5)
    bench.fakes[1].distort = lambda reply: b"\x01\x03\x00\x60\x00\x45\x85\xd7" + theirs
    bench.run(10.0)
    bench.fakes[1].distort = lambda reply: reply
    told = [block.words for block in bench.of(BlockRead)]
    assert (0x0909,) * 5 not in told
    before = len(told)
    bench.run(60.0)
    assert len(bench.of(BlockRead)) > before + 100
