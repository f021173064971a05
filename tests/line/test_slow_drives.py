"""Drives that take longer than their profile says: named, waited for within bounds, never misread."""

from __future__ import annotations

import pytest

from gateway.line.doctor.finding import Illness
from gateway.line.interface import BlockRead, Want
from gateway.line.reachability import GROWTH, PATIENCE
from tests.line.bench import Bench, FakeUnit, facts
from tests.line.test_doctor import Ward

PROFILE = 0.2
"""Seconds that the profile says a reply takes at most."""


def line_with_one_slow(delay: float, units: int = 3, profile: float = PROFILE) -> Bench:
    """Unit 1 takes so long; the others are quick."""
    numbers = range(1, units + 1)
    fakes = [FakeUnit(unit, delay=delay if unit == 1 else 0.005) for unit in numbers]
    for fake in fakes:
        fake.registers = {address: 256 * fake.unit + address for address in range(64)}
    bench = Bench([facts(unit, reply_max=profile) for unit in numbers], fakes)
    bench.quiet = False  # late answers fall into requests of ours
    wants = [Want(unit, address, count, 0.5) for unit in numbers for address, count in ((1, 2), (0x27, 5))]
    return bench.start(*wants)


@pytest.mark.parametrize("units", [1, 3])
@pytest.mark.parametrize("delay", [0.25, 0.3])
def test_a_drive_slower_than_its_profile_is_learned_and_named(delay: float, units: int) -> None:
    bench = line_with_one_slow(delay, units)
    ward = Ward(bench).watch(20)
    assert bench.line.up(1) is True
    [found] = [one for one in ward.last if one.illness is Illness.LATE_ANSWERS]
    assert ward.first[Illness.LATE_ANSWERS] <= 10
    assert found.units == (1,)
    assert found.evidence["milliseconds"] == pytest.approx(1000 * delay, abs=5)
    assert found.evidence["longest"] == 1000 * PROFILE
    before = bench.line.doctor.units[1].traffic.timeouts
    bench.run(30.0)
    assert bench.line.doctor.units[1].traffic.timeouts - before <= 1
    assert not {Illness.DRIVE_SILENT, Illness.ALL_SILENT, Illness.TWO_DRIVES} & ward.told


@pytest.mark.parametrize("units", [1, 3])
def test_beyond_the_bound_it_is_not_waited_for_and_still_named(units: int) -> None:
    bench = line_with_one_slow(GROWTH * PROFILE + 0.3, units)
    ward = Ward(bench).watch(30)
    assert bench.line.up(1) is False
    [found] = [one for one in ward.last if one.illness is Illness.LATE_ANSWERS]
    assert found.evidence["replies"] == 0
    assert found.evidence["milliseconds"] == pytest.approx(1000 * (GROWTH * PROFILE + 0.3), abs=60)
    assert not {Illness.DRIVE_SILENT, Illness.ALL_SILENT} & ward.told


def test_nobody_is_waited_for_longer_than_a_second_because_of_what_was_learned() -> None:
    bench = line_with_one_slow(1.15, profile=0.9)
    ward = Ward(bench).watch(40)
    assert bench.line.up(1) is False
    assert Illness.LATE_ANSWERS in ward.told
    waits = [
        reply - asked
        for (asked, sent, data), (reply, again, _) in zip(bench.wire, bench.wire[1:], strict=False)
        if sent and again and data[0] == 1
    ]
    assert max(waits) < PATIENCE + 0.05


def test_what_was_learned_costs_no_other_drive_a_wrong_value_nor_this_one() -> None:
    bench = line_with_one_slow(0.3)
    bench.run(60.0)
    told = {
        (block.unit, block.address + n): word
        for block in bench.of(BlockRead)
        for n, word in enumerate(block.words)
    }
    assert told
    assert all(word == 256 * unit + address for (unit, address), word in told.items())


def test_an_answer_that_is_late_once_in_a_while_is_no_slow_drive() -> None:
    bench = line_with_one_slow(0.005)
    lates = iter([0.0] * 20 + [0.3] + [0.0] * 500)
    bench.fakes[1].late = lambda: next(lates, 0.0)
    assert Illness.LATE_ANSWERS not in Ward(bench).watch(30).told


def test_a_drive_as_slow_as_its_profile_allows_is_found_before_the_patient_probe() -> None:
    """Probes wait a usual time only; late answers tell how long that has to be."""
    bench = line_with_one_slow(0.4, profile=1.0)
    bench.fakes[1].on = False
    bench.run(10.0)
    bench.fakes[1].on = True
    bench.run(16.0)
    assert bench.line.up(1) is True
