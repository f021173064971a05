"""H14: what wears is written only if it changes, so often a day at most, and counted through all runs."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.worn import DAY, Worn
from gateway.mapping.profile import Command, Constant, Step
from gateway.mapping.site import Site
from gateway.tag import Cause, Instant, Origin, Outcome, Role, Verdict
from tests.core.world import World, site_of
from tests.simulator.master import framed

HOUR = 3600.0
ADMIN = Origin(through="test", who="ada", role=Role.ADMIN)


def with_budget(site: Site, daily: int = 10, **points: int) -> Site:
    [line] = site.lines
    drives = tuple(replace(drive, wear_per_day=points) for drive in line.drives)
    return replace(site, lines=(replace(line, drives=drives),), wear_per_day=daily)


def write(world: World, value: int, point: str = "stop_method") -> Outcome:
    return world.write(f"drive-1.{point}", value)


def tag(world: World, name: str) -> Any:
    return world.read(f"drive-1.{name}")[0].value


@pytest.fixture
def teco() -> World:
    world = World(with_budget(site_of("teco-7200gs"), 3))
    world.run(1.0)
    return world


def test_h14_the_budget_of_a_day_is_kept_and_the_refusal_tells_what_to_do(teco: World) -> None:
    assert [write(teco, n % 2).verdict for n in (1, 2, 3)] == [Verdict.CONFIRMED] * 3
    sent = len(teco.sent())
    refused = write(teco, 0)
    assert (refused.verdict, refused.cause) == (Verdict.REFUSED, Cause.WEAR)
    assert "the register of stop_method was written 3 times in 24 h" in refused.reason
    assert "again in 24 h 0 min, or raise wear_per_day" in refused.reason
    assert len(teco.sent()) == sent
    assert write(teco, 2, "s_curve").verdict is Verdict.CONFIRMED, "each parameter has its own budget"
    assert write(teco, 1, "stop_method_2").cause is Cause.WEAR, "it is another bit of the same register"
    assert tag(teco, "_writes_today") == 4


def test_h14_an_equal_value_is_not_written_and_costs_nothing(teco: World) -> None:
    for _ in range(10):
        outcome = write(teco, 1)
        assert outcome.verdict is Verdict.CONFIRMED
    assert len(teco.sent()) == 1
    assert tag(teco, "_writes_today") == 1


def test_h14_a_command_does_not_write_what_stands_there_already_either() -> None:
    site = site_of("teco-7200gs")
    [line] = site.lines
    [drive] = line.drives
    step = Step(write={"stop_method": Constant(Fraction(1)), "stop_method_2": Constant(Fraction(0))})
    commands = {"set_up": Command(name="set_up", args={}, steps=(step,), role=Role.ENGINEER)}
    drive = replace(drive, profile=replace(drive.profile, commands=commands))
    world = World(replace(site, lines=(replace(line, drives=(drive,)),)))
    world.run(1.0)
    for _ in range(3):
        assert world.command("set_up", drive="drive-1", origin=ADMIN).verdict is Verdict.CONFIRMED
    assert len(world.sent()) == 1
    assert tag(world, "_writes_today") == 1


def test_h14_a_day_later_it_may_be_written_again(teco: World) -> None:
    for n in (1, 2, 3):
        write(teco, n % 2)
        teco.now += 8 * HOUR
        teco.run(5.0)
    assert write(teco, 0).verdict is Verdict.CONFIRMED, "the first one was a day ago"
    assert write(teco, 1).cause is Cause.WEAR, "the second one was not"


@pytest.mark.parametrize("code", [0x22, 0x77])
def test_h14_what_the_drive_refuses_wears_nothing_after_a_restart_either(teco: World, code: int) -> None:
    drive = teco.drives["drive-1"]
    takes = drive.handle
    drive.handle = lambda adu, now: framed(1, 0x90, code) if adu[1] == 0x10 else takes(adu, now)  # type: ignore[method-assign]
    for _ in range(7):
        assert write(teco, 1).cause is Cause.DRIVE_REFUSED
    assert tag(teco, "_writes_today") == 0
    drive.handle = takes  # type: ignore[method-assign]
    assert write(teco, 1).verdict is Verdict.CONFIRMED
    assert tag(teco, "_writes_today") == 1
    teco.restart()
    teco.run(1.0)
    assert tag(teco, "_writes_today") == 1


def test_h14_a_drive_that_says_wait_is_asked_again_at_no_cost() -> None:
    world = World(with_budget(site_of("s2000", e1_04=Fraction(60)), 2))
    world.run(1.0)
    drive = world.drives["drive-1"]
    takes = drive.handle
    drive.handle = lambda adu, now: framed(1, 0x90, 0x24) if adu[1] == 0x10 else takes(adu, now)  # type: ignore[method-assign]
    outcome = world.command("store_parameters", drive="drive-1", origin=ADMIN)
    assert outcome.verdict is not Verdict.CONFIRMED
    assert len(world.sent()) > 5
    assert tag(world, "_writes_today_enter_eeprom") == 0
    assert tag(world, "_writes_left_enter_eeprom") == 100_000


def test_h14_nothing_of_the_s2000_wears_but_its_eeprom() -> None:
    profile = site_of("s2000", e1_04=Fraction(60)).lines[0].drives[0].profile
    assert [name for name, point in profile.points.items() if point.wear is not None] == ["enter_eeprom"]


@pytest.mark.parametrize("days", [-400, -1, 1, 400])
def test_h14_h22_no_change_of_the_clock_gives_writes_back_or_takes_them_away(teco: World, days: int) -> None:
    for n in (1, 2):
        write(teco, n % 2)
    wall = teco.instant
    teco.instant = lambda: Instant(wall().mono, wall().wall + days * 86_400 * 10**9)  # type: ignore[method-assign]
    teco.run(1.0)
    assert write(teco, 1).verdict is Verdict.CONFIRMED
    assert write(teco, 0).cause is Cause.WEAR


def test_h14_counts_survive_a_restart() -> None:
    site = with_budget(site_of("teco-7200gs"), 2)
    first = World(site)
    first.run(1.0)
    assert write(first, 1).verdict is Verdict.CONFIRMED
    second = World(site, memory=first.memory())
    second.run(1.0)
    assert tag(second, "_writes_today") == 1
    assert write(second, 1).verdict is Verdict.CONFIRMED
    assert write(second, 0).cause is Cause.WEAR


def test_h14_enter_wears_the_eeprom_and_what_is_left_of_its_life_is_a_tag() -> None:
    world = World(with_budget(site_of("s2000"), 10, enter_eeprom=1))
    world.run(1.0)
    assert tag(world, "_writes_left_enter_eeprom") == 100_000
    assert world.command("store_parameters", drive="drive-1", origin=ADMIN).verdict is Verdict.CONFIRMED
    assert tag(world, "_writes_left_enter_eeprom") == 99_999
    assert tag(world, "_writes_today_enter_eeprom") == 1
    refused = world.command("store_parameters", drive="drive-1", origin=ADMIN)
    assert (refused.verdict, refused.cause) == (Verdict.REFUSED, Cause.WEAR)
    assert write(world, True, "terminal_5").verdict is Verdict.CONFIRMED


def test_h14_the_twin_in_ram_is_named() -> None:
    world = World(with_budget(site_of("shihlin-sl3"), 0))
    world.run(1.0)
    refused = write(world, 5, "frequency_stored")
    assert refused.cause is Cause.WEAR
    assert "write frequency_command, which wears nothing" in refused.reason


def test_h14_an_alarm_tells_that_a_memory_comes_to_its_end() -> None:
    site = site_of("s2000")
    first = World(site)
    memory = first.memory()
    for _ in range(89_999):
        memory.wear.registers.setdefault("drive-1:FFFDH", Worn()).total += 1
    world = World(site, memory=memory)
    world.run(1.0)
    world.command("store_parameters", drive="drive-1", origin=ADMIN)
    [alarm] = world.core.alarms.standing()
    assert alarm.key == "drive-1.wear_enter_eeprom"
    assert "90000" in alarm.text


@given(st.lists(st.floats(0.0, 3 * DAY), max_size=60), st.integers(1, 5))
def test_h14_no_24_hours_ever_hold_more_than_the_budget(moments: list[float], budget: int) -> None:
    worn = Worn()
    written = []
    for lived in sorted(moments):
        if len(worn.since(lived)) < budget:
            worn.write(lived)
            written.append(lived)
    for start in written:
        assert len([at for at in written if start <= at < start + DAY]) <= budget
    assert worn.total == len(written)
