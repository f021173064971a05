"""Starts that do not come at once, and no run without a setpoint (H6)."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from types import MappingProxyType

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.core.guard import starts_motor
from gateway.core.permits import SETPOINT_SECONDS
from gateway.mapping.profile import Pace
from gateway.mapping.site import Control, Site, StartGroup
from gateway.tag import Cause, Verdict
from tests.core.world import ENGINEER, OPERATOR, World, make_site, teco

APART = 3.0
GROUP = StartGroup("hall-2", ("fan-1", "fan-2", "fan-3"), APART)


def hall(drives: int = 4) -> World:
    """fan-1 to fan-3 start one after another, fan-4 when it likes."""
    world = World(make_site(drives, starts=(GROUP,)))
    world.run(APART + 1.0)
    return world


def starts(world: World) -> list[tuple[float, int]]:
    """When a frame with the run bit left for which unit."""
    found = []
    for at, frame in world.wire:
        data = bytes.fromhex(frame)
        if data[1] == 0x10 and data[2:4] == b"\x00\x01" and data[8] & 1:
            found.append((at, data[0]))
    return found


def test_starts_of_a_group_come_one_after_another() -> None:
    world = hall()
    asked = [world.ask_command("run_forward", f"fan-{n}", ttl=20.0, frequency=30.0) for n in (1, 2, 3)]
    outcomes = [world.until(ask, 30.0) for ask in asked]
    assert {outcome.verdict for outcome in outcomes} == {Verdict.CONFIRMED}
    at = [at for at, _ in starts(world)]
    assert [unit for _, unit in starts(world)] == [5, 6, 7]
    assert at[1] - at[0] >= APART and at[2] - at[1] >= APART
    assert at[2] - at[0] < 2 * APART + 2


def test_a_start_whose_turn_comes_too_late_is_told_when() -> None:
    world = hall()
    world.ask_command("run_forward", "fan-1", ttl=5.0, frequency=30.0)
    world.ask_command("run_forward", "fan-2", ttl=5.0, frequency=30.0)
    outcome = world.command("run_forward", drive="fan-3", ttl=5.0, frequency=30.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.TOO_SOON)
    assert "comes in 6.0 s" in outcome.reason


def test_h10_the_lease_of_a_run_that_waited_counts_from_its_start() -> None:
    """Or the end of it would stop the motor a moment after the inrush."""
    ttl = APART + 1.0
    world = World(make_site(2, starts=(GROUP,), control=Control("session", ttl, "stop")))
    world.run(APART + 1.0)
    world.ask_command("run_forward", "fan-1", frequency=30.0)
    world.ask_command("run_forward", "fan-2", frequency=30.0)
    world.run(APART + ttl + 5.0)
    stops = {frame[:2]: at for at, frame in world.wire if frame[3:20] == "10 00 01 00 01 02"}
    begun = {f"{unit:02X}": at for at, unit in starts(world)}
    assert begun["06"] - begun["05"] >= APART
    for unit, at in begun.items():
        assert ttl <= stops[unit] - at < ttl + 0.5


def test_h10_only_the_start_renews_the_lease_and_not_the_way_to_its_speed() -> None:
    pace = MappingProxyType({"frequency_command": Pace(slew=Fraction(1))})
    world = World(make_site(1, starts=(GROUP,), control=Control("session", 4.0, "stop"), limits=pace))
    world.run(APART + 1.0)
    outcome = world.ask_command("run_forward", frequency=50.0)
    world.run(8.0)
    assert "lease_expired" in world.events()
    assert outcome() is not None, "the ramp ends with the lease"
    assert world.read("fan-1.running")[0].value is False


def test_others_do_not_wait() -> None:
    world = hall()
    world.ask_command("run_forward", "fan-1", frequency=30.0)
    begun = world.now
    assert world.command("run_forward", drive="fan-4", frequency=30.0).verdict is Verdict.CONFIRMED
    assert world.write("fan-2.frequency_command", 20.0).verdict is Verdict.CONFIRMED
    assert world.now - begun < 2.0


def test_a_motor_that_runs_changes_its_speed_by_its_setpoint_at_once() -> None:
    world = hall()
    world.command("run_forward", frequency=30.0)
    world.ask_command("run_forward", "fan-2", frequency=30.0)
    begun = world.now
    assert world.write("fan-1.frequency_command", 40.0).verdict is Verdict.CONFIRMED
    assert world.now - begun < 1.0


def test_h20_a_stop_waits_for_no_turn_and_gives_it_up() -> None:
    world = hall()
    world.command("run_forward", drive="fan-1", frequency=30.0)
    second = world.ask_command("run_forward", "fan-2", ttl=10.0, frequency=30.0)
    third = world.ask_command("run_forward", "fan-3", ttl=10.0, frequency=30.0)
    world.run(0.5)
    begun = world.now
    assert world.command("stop", drive="fan-2").verdict is Verdict.CONFIRMED
    assert world.now - begun < 1.0
    told = second()
    assert told is not None and told.verdict is Verdict.SUPERSEDED
    world.until(third, 10.0)
    assert [unit for _, unit in starts(world)] == [5, 7]


def test_h11_after_a_restart_a_group_counts_as_just_started() -> None:
    world = hall()
    world.restart()
    outcome = world.command("run_forward", ttl=2.0, frequency=30.0)
    assert outcome.cause is Cause.TOO_SOON
    world.run(APART)
    assert world.command("run_forward", ttl=2.0, frequency=30.0).verdict is Verdict.CONFIRMED


@settings(max_examples=20, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from(["fan-1", "fan-2", "fan-3"]), st.booleans(), st.floats(0.0, 2.0)),
        min_size=2,
        max_size=12,
    )
)
def test_whatever_is_asked_no_two_starts_of_a_group_come_together(
    orders: list[tuple[str, bool, float]],
) -> None:
    world = hall(3)
    for drive, run, pause in orders:
        if run:
            world.ask_command("run_forward", drive, ttl=10.0, frequency=30.0)
        else:
            world.ask_command("stop", drive)
        world.run(pause)
    world.run(15.0)
    for (one, _), (next_one, _) in pairwise(starts(world)):
        assert next_one - one >= APART


def without_frequency() -> Site:
    """A 7200GS whose run command brings no frequency."""
    site = make_site()
    profile = teco()
    run = profile.commands["run_forward"]
    step = replace(
        run.steps[0], write={k: v for k, v in run.steps[0].write.items() if k != "frequency_command"}
    )
    bare = replace(run, args=MappingProxyType({}), steps=(step,))
    commands = MappingProxyType({**profile.commands, "run_forward": bare})
    drive = replace(site.drives[0], profile=replace(profile, commands=commands))
    return replace(site, lines=(replace(site.lines[0], drives=(drive,)),))


def test_h6_no_run_without_a_setpoint_of_ones_own() -> None:
    world = World(without_frequency())
    world.run(1.0)
    outcome = world.command("run_forward")
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.PRECONDITION)
    assert "write frequency_command first" in outcome.reason
    world.write("fan-1.frequency_command", 20.0, ENGINEER)
    assert world.command("run_forward").cause is Cause.PRECONDITION, "that was somebody else"
    world.write("fan-1.frequency_command", 20.0, OPERATOR)
    assert world.command("run_forward").verdict is Verdict.CONFIRMED


def test_h6_a_setpoint_gets_too_old() -> None:
    world = World(without_frequency())
    world.run(1.0)
    world.write("fan-1.frequency_command", 20.0, OPERATOR)
    world.run(SETPOINT_SECONDS + 1)
    assert world.command("run_forward").cause is Cause.PRECONDITION


def test_h6_h7_a_drive_that_was_away_holds_no_setpoint_any_more() -> None:
    world = World(without_frequency())
    world.run(1.0)
    world.write("fan-1.frequency_command", 20.0, OPERATOR)
    world.drives["fan-1"].faults.mute()
    world.run(10.0)
    world.drives["fan-1"].faults.clear()
    world.run(10.0)
    assert world.command("run_forward").cause is Cause.PRECONDITION


@pytest.mark.parametrize(
    ("name", "starts"),
    [("run_forward", True), ("run_reverse", True), ("stop", False), ("reset_fault", False)],
)
def test_h6_what_counts_as_a_run(name: str, starts: bool) -> None:
    assert starts_motor(teco().commands[name]) is starts
