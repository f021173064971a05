"""A line on paper: what reads cost, how long a stop may wait, who would take the line for dead."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.line.elastic import CAPACITY
from gateway.line.forecast import Setup, demand_of, forecast
from gateway.line.interface import LineSettings, Priority, Want, Write
from gateway.line.repairs import Repair, repairs
from gateway.mapping.profile import SerialFormat
from tests.line.bench import CHARACTER, SETTINGS, SILENCE, Bench, FakeUnit, facts

SLOW = replace(SETTINGS, baud=2400)
STATUS = 0x20


def setup(
    units: int, line: LineSettings = SETTINGS, fast: float = 0.2, count: int = 5, **changes: object
) -> Setup:
    """Units like a 7200GS: status fast, the rest at a second."""
    numbers = range(1, units + 1)
    return Setup(
        settings=line,
        units=tuple(facts(u, reply_usual=0.02, **changes) for u in numbers),
        wants={
            "fast": tuple(Want(u, STATUS, count, fast, 0) for u in numbers),
            "normal": tuple(Want(u, 0x31, 3, 1.0, 1) for u in numbers),
        },
        bauds=(2400, 4800, 9600),
        comm_loss=dict.fromkeys(numbers, 2.0),
    )


def of_kind(found: list[Repair], kind: str) -> Repair:
    return next(repair for repair in found if repair.kind == kind)


def test_bytes_and_milliseconds_of_a_read() -> None:
    first, second = forecast(setup(1)).reads
    assert (first.request, first.reply) == (8, 15)
    assert first.block.cost == pytest.approx(23 * CHARACTER + 0.02 + SILENCE)
    assert (second.request, second.reply, second.wanted) == (8, 11, 1.0)


def test_a_read_of_16_registers_takes_226_ms_at_2400_baud() -> None:
    sixteen = Setup(
        settings=SLOW,
        units=(facts(1, readable=((0, 15),), reply_usual=0.02),),
        wants={"fast": (Want(1, 0, 16, 2.0),)},
    )
    [read] = forecast(sixteen).reads
    silence = 3.5 * 11 / 2400
    assert read.block.cost - silence == pytest.approx(0.226, abs=0.0005)


def test_thirty_one_drives_at_2400_baud_take_the_line_for_dead() -> None:
    on_paper = forecast(setup(31, SLOW))
    dog = on_paper.watchdogs[0]
    visit = (8 + 7) * 11 / 2400 + 0.02 + 3.5 * 11 / 2400
    assert dog.floor == pytest.approx(31 * visit)
    assert dog.floor > 2.0
    assert (dog.possible, dog.fed) == (False, False)
    assert dog.fitting == 19
    assert not on_paper.fits
    fits = forecast(setup(dog.fitting, SLOW)).watchdogs[0]
    too_many = forecast(setup(dog.fitting + 1, SLOW)).watchdogs[0]
    assert fits.possible
    assert not too_many.possible


def test_a_drive_of_which_nothing_is_read_is_not_fed() -> None:
    nothing = replace(setup(1), wants={})
    [dog] = forecast(nothing).watchdogs
    assert dog.possible
    assert not dog.fed
    assert math.isinf(dog.planned)
    assert forecast(nothing).write == pytest.approx(13 * CHARACTER)


def test_pauses_and_other_turnarounds_count() -> None:
    plain, paused = forecast(setup(1)), forecast(setup(1, pause_read=0.05))
    assert paused.reads[0].block.cost - plain.reads[0].block.cost == pytest.approx(0.05 - SILENCE)
    quick = forecast(replace(setup(1), turnaround=0.005))
    assert plain.reads[0].block.cost - quick.reads[0].block.cost == pytest.approx(0.015)


def test_ascii_costs_twice_the_characters_and_tcp_nothing() -> None:
    ascii_line = replace(SETTINGS, framing="ascii", format=SerialFormat(7, "E", 1))
    [read, _] = forecast(setup(1, ascii_line)).reads
    assert (read.request, read.reply) == (17, 31)
    assert read.block.cost == pytest.approx(48 * 10 / 9600 + 0.02)
    [read, _] = forecast(setup(1, replace(SETTINGS, framing="tcp"))).reads
    assert read.block.cost == pytest.approx(0.02)


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 8), st.sampled_from([0.1, 0.3, 1.0]), st.floats(1.0, 2.0))
def test_the_line_keeps_what_the_forecast_says_of_a_stop(units: int, fast: float, moment: float) -> None:
    on_paper = setup(units, fast=fast)
    wants = [want for wants in on_paper.wants.values() for want in wants]
    bench = Bench(on_paper.units, [FakeUnit(u, delay=0.02) for u in range(1, units + 1)]).start(*wants)
    bench.run(moment)
    asked = bench.now
    bench.ask(Write(1, 1, (1, 6000)), Priority.STOP)
    bench.run(2)
    sent = next(at for at, out, data in bench.wire if out and data[1] == 16)
    assert sent + 13 * CHARACTER - asked <= forecast(on_paper).write + 1e-9


def test_a_stop_behind_a_drive_that_has_just_gone_silent() -> None:
    on_paper = setup(1)
    bench = Bench(on_paper.units, [FakeUnit(1, delay=0.02, on=False)]).start(*on_paper.wants["fast"])
    bench.run(0.03)
    asked = bench.now
    bench.ask(Write(1, 1, (1, 6000)), Priority.STOP)
    bench.run(3)
    sent = next(at for at, out, data in bench.wire if out and data[1] == 16)
    bound = forecast(on_paper).write_silent
    assert 0.9 * bound < sent + 13 * CHARACTER - asked <= bound


def test_what_fits_needs_no_repair() -> None:
    assert forecast(setup(2)).fits
    assert repairs(setup(2)) == []


def test_a_faster_line_is_the_lowest_speed_that_is_enough() -> None:
    found = of_kind(repairs(setup(1, SLOW, fast=0.06)), "baud")
    assert (found.value, found.forecast.fits) == (9600, True)
    found = of_kind(repairs(setup(1, SLOW, fast=0.15)), "baud")
    assert found.value == 4800
    assert found.forecast.demand == pytest.approx(
        demand_of(replace(setup(1, SLOW, fast=0.15), settings=replace(SLOW, baud=4800)))
    )


def test_a_longer_period_for_the_class_that_costs_most() -> None:
    crowded = setup(6)
    assert demand_of(crowded) > 1
    found = of_kind(repairs(crowded), "period")
    assert (found.rate, found.value, found.forecast.fits) == ("fast", 0.5, True)
    assert found.forecast.demand <= CAPACITY


def test_fewer_fast_reads_and_no_more_than_needed() -> None:
    crowded = setup(6)
    found = of_kind(repairs(crowded), "demote")
    assert found.rate == "fast"
    assert found.forecast.fits
    assert 0 < len(found.moved) < 6
    assert found.value == len(found.moved), "a read holds one want of each unit here"
    one_less = found.moved[:-1]
    staying = tuple(want for want in crowded.wants["fast"] if want not in one_less)
    later = tuple(replace(want, period=1.0, rank=1) for want in one_less)
    still = replace(crowded, wants={"fast": staying, "normal": crowded.wants["normal"] + later})
    assert demand_of(still) > CAPACITY


def test_more_lines() -> None:
    crowded = setup(6)
    found = of_kind(repairs(crowded), "split")
    assert (found.value, found.forecast.fits) == (2, True)


def test_those_that_are_enough_come_first_and_a_pair_where_none_is() -> None:
    hopeless = setup(31, SLOW, fast=0.5)
    found = repairs(hopeless)
    enough = [repair.forecast.fits for repair in found]
    assert enough == sorted(enough, reverse=True)
    assert any(enough)
    crowded = replace(setup(8, SLOW, fast=0.2), bauds=(2400, 4800))
    alone = [repair for repair in repairs(crowded) if repair.beside is None and repair.forecast.fits]
    paired = [repair for repair in repairs(crowded) if repair.beside is not None]
    assert bool(alone) != bool(paired)


def test_all_periods_where_one_class_is_not_enough() -> None:
    crowded = setup(24)
    found = of_kind(repairs(crowded), "periods")
    assert found.forecast.demand <= CAPACITY
    assert found.value == pytest.approx(demand_of(crowded) / CAPACITY, abs=0.1)
