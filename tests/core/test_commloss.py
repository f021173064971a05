"""H9: a drive that does not do what the site demands when the line dies gets nothing but stops."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from gateway.core import commloss
from gateway.mapping.site import LossDemand, Site
from gateway.simulator.happening import PanelSets
from gateway.tag import Cause, Outcome, Verdict
from tests.core.world import ENGINEER, World, make_site, site_of

RAMP, COAST, KEEP_RUNNING = 0b00, 0b01, 0b11
STOP = LossDemand("stop")


def demanding(site: Site, demand: LossDemand | None) -> Site:
    """The site with this demand on every drive."""
    lines = [
        replace(line, drives=tuple(replace(drive, comm_loss=demand) for drive in line.drives))
        for line in site.lines
    ]
    return replace(site, lines=tuple(lines))


def world_of(demand: LossDemand | None, action: int = RAMP) -> World:
    world = World(demanding(make_site(), demand))
    world.drives["fan-1"].post(PanelSets("comm_loss_action", action))
    world.run(1.0)
    return world


def is_refused_for(outcome: Outcome, *words: str) -> bool:
    refused = (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.PRECONDITION)
    return refused and all(word in outcome.reason for word in words)


def test_h9_a_drive_that_stops_by_itself_is_commanded_as_ever() -> None:
    world = world_of(STOP)
    assert world.command("run_forward", frequency=10.0).verdict is Verdict.CONFIRMED
    assert world.core.alarms.standing() == ()


def test_h9_one_that_would_run_on_gets_nothing_but_a_stop_and_the_reason_names_the_parameter() -> None:
    world = world_of(STOP, KEEP_RUNNING)
    words = ("comm_loss_action", "keep_running", "Sn-08", "decelerate_bn_02", "coast")
    assert is_refused_for(world.command("run_forward", frequency=10.0), *words)
    assert is_refused_for(world.write("fan-1.frequency_command", 10.0), *words)
    assert is_refused_for(world.write("fan-1.input_5", True), *words)
    assert is_refused_for(world.write("fan-1.acceleration_time_1", 20), *words)
    assert is_refused_for(world.command("reset_fault"), *words)
    assert world.sent() == []
    assert world.command("stop").verdict is Verdict.CONFIRMED
    [alarm] = world.core.alarms.standing()
    assert alarm.key == "fan-1.comm_loss"
    assert all(word in alarm.text for word in words)


def test_h9_the_parameter_itself_may_be_mended_from_here() -> None:
    world = world_of(STOP, KEEP_RUNNING)
    assert world.write("fan-1.comm_loss_action", "coast", ENGINEER).verdict is Verdict.CONFIRMED
    assert world.command("run_forward", frequency=10.0).verdict is Verdict.CONFIRMED


def test_h9_what_is_not_known_yet_is_read_before_the_first_write() -> None:
    """A command line opens the line, writes once and leaves."""
    world = World(demanding(make_site(), STOP))
    world.drives["fan-1"].post(PanelSets("comm_loss_action", KEEP_RUNNING))
    world.run(0.002)
    assert is_refused_for(world.write("fan-1.frequency_command", 10.0), "keep_running")
    assert world.sent() == []


def test_h9_it_is_read_again_every_hour_and_an_alarm_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    assert commloss.EVERY == 3600.0
    monkeypatch.setattr(commloss, "EVERY", 60.0)
    world = world_of(STOP)
    world.drives["fan-1"].post(PanelSets("comm_loss_action", KEEP_RUNNING))
    reads = [frame for frame in world.sent("03") if frame.startswith("05 03 01 07")]
    world.run(61.0)
    assert len([f for f in world.sent("03") if f.startswith("05 03 01 07")]) == len(reads) + 1
    assert [alarm.key for alarm in world.core.alarms.standing()] == ["fan-1.comm_loss"]
    assert is_refused_for(world.command("run_forward", frequency=10.0), "keep_running")
    world.drives["fan-1"].post(PanelSets("comm_loss_action", COAST))
    world.run(61.0)
    [alarm] = world.core.alarms.standing()
    assert alarm.cleared
    assert world.command("run_forward", frequency=10.0).verdict is Verdict.CONFIRMED


def test_h9_it_is_read_again_when_the_drive_comes_back() -> None:
    world = world_of(STOP)
    world.drives["fan-1"].connected = False
    world.run(20.0)
    world.drives["fan-1"].post(PanelSets("comm_loss_action", KEEP_RUNNING))
    world.drives["fan-1"].connected = True
    world.run(20.0)
    assert [alarm.key for alarm in world.core.alarms.standing()] == ["fan-1.comm_loss"]


@pytest.mark.parametrize(
    ("demand", "action", "allowed"),
    [
        (None, KEEP_RUNNING, True),
        (LossDemand("any"), KEEP_RUNNING, True),
        (LossDemand("keep_running"), KEEP_RUNNING, True),
        (LossDemand("keep_running"), COAST, False),
        (LossDemand("stop", within=2.0), COAST, True),
        (LossDemand("stop", within=1.5), COAST, False),
    ],
)
def test_h9_the_site_says_what_it_demands(demand: LossDemand | None, action: int, allowed: bool) -> None:
    world = world_of(demand, action)
    outcome = world.write("fan-1.frequency_command", 10.0)
    assert (outcome.verdict is Verdict.CONFIRMED) is allowed, outcome.reason


def test_h9_without_a_demand_nothing_is_read_until_somebody_looks() -> None:
    world = world_of(None, COAST)
    assert not [frame for frame in world.sent("03") if frame.startswith("05 03 01 07")]
    world.watch({"fan-1._comm_loss": 1.0})
    world.run(3.0)
    assert world.samples("fan-1._comm_loss")[-1].value == "stops after 2 s: comm_loss_action is coast (Sn-08)"


def test_h9_settings_of_the_panel_are_compared_too() -> None:
    site = site_of("s2000", e1_04=Fraction(60))
    world = World(demanding(site, STOP))
    world.run(1.0)
    outcome = world.write("drive-1.frequency_command", 10.0)
    assert is_refused_for(outcome, "f5_05 is without_detection", "must be with_detection", "f5_04")
    detecting = site_of("s2000", e1_04=Fraction(60), f5_05=Fraction(0), f5_04=Fraction(2))
    world = World(demanding(detecting, STOP))
    world.run(1.0)
    assert world.write("drive-1.frequency_command", 10.0).verdict is Verdict.CONFIRMED


def test_h9_what_a_profile_does_not_know_never_counts_as_met() -> None:
    world = World(demanding(site_of("shihlin-sl3"), STOP))
    assert world.command("take_control", drive="drive-1").verdict is Verdict.REFUSED
    world.run(5.0)
    assert [alarm.key for alarm in world.core.alarms.standing()] == ["drive-1.comm_loss"]


def test_h9_a_line_that_cannot_feed_the_watchdogs_says_so() -> None:
    world = World(make_site(31, first_unit=1, baud=2400))
    world.run(10.0)
    alarms = world.core.alarms.standing()
    assert {alarm.name for alarm in alarms} == {"watchdog_unfed"}
    assert "takes the line for dead after 2 s" in alarms[0].text
    fed = World(make_site(8, first_unit=1))
    fed.run(10.0)
    assert fed.core.alarms.standing() == ()
