"""H7, H8, H12, H13: a drive that is not as it was commanded is noticed; healthy ones are never suspected."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Any, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bridge.api import LeaseAct
from gateway.bridge.messages import Acknowledge, Done
from gateway.core.events import Asked, PortLost
from gateway.mapping.site import Control, Site
from gateway.simulator.happening import Panel, PanelSets, PowerCycle, Trip
from gateway.tag import Cause, Outcome, Verdict
from tests.core.world import ENGINEER, OPERATOR, World, make_site, site_of
from tests.simulator.master import read, write


def with_control(site: Site, **control: Any) -> Site:
    lines = [
        replace(
            line, drives=tuple(replace(d, control=Control(on_expiry="hold", **control)) for d in line.drives)
        )
        for line in site.lines
    ]
    return replace(site, lines=tuple(lines))


def world_of(lease: Literal["session", "required", "off"] = "session", **control: Any) -> World:
    world = World(with_control(make_site(), lease=lease, ttl=3600.0, **control))
    world.run(1.0)
    return world


def running(**control: Any) -> World:
    """fan-1 was commanded to run at 30 Hz, and does."""
    world = world_of(**control)
    assert world.command("run_forward", frequency=30.0).verdict is Verdict.CONFIRMED
    world.run(6.0)
    return world


def alarms(world: World) -> list[str]:
    return [alarm.key for alarm in world.core.alarms.standing()]


def acquire(world: World) -> Outcome:
    return world.lease(LeaseAct.ACQUIRE, OPERATOR)


def acknowledge(world: World, key: str) -> Outcome:
    request = Acknowledge(world._next_request(), key, OPERATOR)
    world.feed(Asked(world.session, request))
    return next(m.outcome for m in world.told[world.session] if isinstance(m, Done) and m.id == request.id)


def is_refused(outcome: Outcome, cause: Cause) -> bool:
    return (outcome.verdict, outcome.cause) == (Verdict.REFUSED, cause)


# -- restarts


def test_h7_a_restart_nobody_else_would_notice_voids_lease_and_arming() -> None:
    world = running()
    before = len(world.sent())
    world.drives["fan-1"].post(PowerCycle())
    world.run(3.0)
    assert alarms(world) == ["fan-1.restarted"]
    [alarm] = world.core.alarms.standing()
    assert "frequency_command shows 0, 30 was commanded" in alarm.text
    for outcome in (
        world.write("fan-1.frequency_command", 20.0, OPERATOR),
        world.command("run_forward", frequency=20.0),
    ):
        assert is_refused(outcome, Cause.LEASE)
        assert "restarted" in outcome.reason
    assert len(world.sent()) == before, "nothing is written by itself, and nothing for who has not acquired"
    assert acquire(world).verdict is Verdict.CONFIRMED
    assert world.command("run_forward", frequency=20.0).verdict is Verdict.CONFIRMED


def test_h7_after_a_loss_the_first_contact_shows_that_it_restarted() -> None:
    world = running()
    world.drives["fan-1"].post(PowerCycle(away=8.0))
    world.run(20.0)
    assert "communication_lost" in world.events()
    assert alarms(world) == ["fan-1.restarted"]
    assert is_refused(world.write("fan-1.frequency_command", 20.0, OPERATOR), Cause.LEASE)


def test_a_cable_that_was_out_for_a_while_is_no_restart() -> None:
    world = running()
    world.drives["fan-1"].connected = False
    world.run(1.8)
    world.drives["fan-1"].connected = True
    world.run(20.0)
    assert alarms(world) == []
    assert world.write("fan-1.frequency_command", 20.0, OPERATOR).verdict is Verdict.CONFIRMED


def test_h7_what_is_shown_is_what_the_drive_shows() -> None:
    world = running()
    world.watch({"fan-1.frequency_command": 0.5})
    world.drives["fan-1"].post(PowerCycle())
    world.run(3.0)
    assert world.samples("fan-1.frequency_command")[-1].value == 0.0


def test_h7_a_stop_needs_no_arming() -> None:
    world = running()
    world.drives["fan-1"].post(PowerCycle(latched=True))
    world.run(3.0)
    assert world.command("stop").verdict is Verdict.CONFIRMED


# -- latched runs


def test_h8_a_run_that_latched_over_a_loss_of_power_is_an_alarm_and_left_alone() -> None:
    world = running()
    before = len(world.sent())
    world.drives["fan-1"].post(PanelSets("comm_loss_action", 0b11))
    world.drives["fan-1"].post(PowerCycle(away=8.0, latched=True))
    world.run(20.0)
    assert alarms(world) == ["fan-1.restarted", "fan-1.latched_run"]
    assert len(world.sent()) == before
    assert world.drives["fan-1"].state.running


def test_h8_the_site_may_have_it_stopped() -> None:
    world = running(on_reappear="stop")
    world.drives["fan-1"].post(PanelSets("comm_loss_action", 0b11))
    world.drives["fan-1"].post(PowerCycle(away=8.0, latched=True))
    world.run(30.0)
    assert "fan-1.latched_run" in alarms(world)
    assert not world.drives["fan-1"].state.running
    [outcome] = [e for e in world.journal if e["kind"] == "outcome" and e["by"]["who"] == "on_reappear"]
    assert outcome["outcome"]["verdict"] == "confirmed"


def test_h8_a_motor_that_starts_after_our_stop_is_an_alarm_until_it_stands() -> None:
    world = running()
    world.command("stop")
    world.drives["fan-1"].model._motion.latched = _latched()  # type: ignore[attr-defined]
    world.run(3.0)
    assert alarms(world) == ["fan-1.latched_run"]
    world.command("stop")
    world.run(10.0)
    [alarm] = world.core.alarms.standing()
    assert alarm.cleared
    acknowledge(world, alarm.key)
    assert alarms(world) == []


def _latched() -> Any:
    from gateway.simulator.motion import Latched

    return Latched(False, 10.0)


def test_h11_a_motor_that_runs_when_the_gateway_starts_is_reported_and_not_touched() -> None:
    world = running()
    before = len(world.sent())
    world.restart()
    world.run(30.0)
    assert alarms(world) == []
    assert "running_at_start" in world.events()
    assert len(world.sent()) == before
    assert world.drives["fan-1"].state.running


# -- local and remote


def test_h13_a_drive_that_is_switched_local_is_refused_and_must_be_acquired_when_it_is_back() -> None:
    world = running()
    world.drives["fan-1"].post(PanelSets("run_source", 1))
    world.run(10.0)
    assert alarms(world) == ["fan-1.local"]
    assert is_refused(world.write("fan-1.frequency_command", 20.0, OPERATOR), Cause.LEASE)
    assert acquire(world).verdict is Verdict.CONFIRMED
    local = world.write("fan-1.frequency_command", 20.0, OPERATOR)
    assert is_refused(local, Cause.PRECONDITION)
    assert "run_source is operator_or_terminals" in local.reason
    assert is_refused(world.command("run_forward", frequency=20.0), Cause.PRECONDITION)
    before = len(world.sent())
    world.drives["fan-1"].post(PanelSets("run_source", 0))
    world.run(10.0)
    assert len(world.sent()) == before, "the stored setpoint is not sent again"
    [alarm] = world.core.alarms.standing()
    assert alarm.cleared


def test_h13_a_motor_that_the_panel_runs_is_no_latched_run() -> None:
    world = running()
    world.command("stop")
    world.drives["fan-1"].post(PanelSets("run_source", 1))
    world.drives["fan-1"].post(Panel(run=True))
    world.run(15.0)
    assert world.drives["fan-1"].state.running
    assert alarms(world) == ["fan-1.local"]


def test_h13_handing_over_to_the_panel_from_here_is_no_alarm_but_voids_the_arming() -> None:
    world = running()
    world.command("stop")
    assert world.lease(LeaseAct.TAKE, ENGINEER).verdict is Verdict.CONFIRMED
    assert world.write("fan-1.run_source", "operator_or_terminals", ENGINEER).verdict is Verdict.CONFIRMED
    world.run(10.0)
    assert alarms(world) == []
    assert is_refused(world.write("fan-1.run_source", "line", ENGINEER), Cause.LEASE)


# -- another master


def test_h12_another_master_is_an_alarm_and_writes_are_off_until_somebody_has_seen_it() -> None:
    world = running(lease="off")
    world.simulated.intrude(write(0x0002, 4000), world.now)
    world.run(12.0)
    assert alarms(world) == ["fan-1.foreign_master"]
    [alarm] = world.core.alarms.standing()
    assert "frequency_command shows 40, 30 was commanded" in alarm.text
    refused = world.command("run_forward", frequency=20.0)
    assert is_refused(refused, Cause.PRECONDITION)
    assert "fan-1.foreign_master" in refused.reason
    assert is_refused(world.write("fan-1.input_5", True, OPERATOR), Cause.PRECONDITION)
    acknowledge(world, alarm.key)
    assert world.command("run_forward", frequency=20.0).verdict is Verdict.CONFIRMED
    world.simulated.intrude(write(0x0002, 4000), world.now)
    world.run(12.0)
    assert world.command("stop").verdict is Verdict.CONFIRMED


def test_h12_another_master_that_stops_the_motor_is_noticed_at_once() -> None:
    world = running()
    world.simulated.intrude(write(0x0001, 0), world.now)
    world.run(4.0)
    assert alarms(world) == ["fan-1.foreign_master"]
    assert is_refused(world.write("fan-1.frequency_command", 20.0, OPERATOR), Cause.PRECONDITION)


def test_h12_another_master_that_only_asks_turns_writes_off_too_and_leaves_the_lease_alone() -> None:
    """Whoever asks on a line with a master already may write next. The lease stays, so that its end is still
    made good."""
    world = running()
    for _ in range(3):
        world.simulated.intrude(read(0x0020, 2, unit=9), world.now)
        world.run(2.0)
    assert alarms(world) == ["_north.foreign_master"]
    refused = world.write("fan-1.frequency_command", 20.0, OPERATOR)
    assert is_refused(refused, Cause.PRECONDITION)
    assert "until the alarm _north.foreign_master is acknowledged" in refused.reason
    assert world.control().phase == "held"
    assert world.command("stop").verdict is Verdict.CONFIRMED
    world.run(120.0)
    assert is_refused(world.write("fan-1.frequency_command", 20.0, OPERATOR), Cause.PRECONDITION)
    acknowledge(world, "_north.foreign_master")
    assert world.write("fan-1.frequency_command", 20.0, OPERATOR).verdict is Verdict.CONFIRMED


# -- no false alarms


def test_a_trip_is_a_fault_and_nothing_else() -> None:
    world = running()
    world.drives["fan-1"].post(Trip("fault_overcurrent"))
    world.run(15.0)
    assert alarms(world) == []
    assert world.command("reset_fault").verdict is Verdict.CONFIRMED
    world.run(15.0)
    assert alarms(world) == []


def test_a_port_that_is_plugged_anew_is_nothing() -> None:
    world = running()
    world.feed(PortLost("north", "unplugged"))
    world.run(30.0)
    assert alarms(world) == []


@pytest.mark.parametrize("profile", ["s2000", "shihlin-sl3"])
def test_the_other_drives_are_looked_after_too(profile: str) -> None:
    from fractions import Fraction

    known = {"e1_04": Fraction(60)} if profile == "s2000" else {}
    world = World(with_control(site_of(profile, **known), ttl=3600.0))
    world.run(1.0)
    if profile == "shihlin-sl3":
        world.command("take_control", drive="drive-1")
    world.command("run_forward", drive="drive-1", frequency=30.0)
    world.run(20.0)
    assert alarms(world) == []
    world.drives["drive-1"].post(PowerCycle())
    world.run(8.0)
    assert "drive-1.restarted" in alarms(world)


DOINGS = [
    "run",
    "reverse",
    "speed",
    "stop",
    "input",
    "reset",
    "trip",
    "leave",
    "join",
    "idle",
    "param",
    "restart",
]


@settings(max_examples=12, deadline=None)
@given(st.lists(st.sampled_from(DOINGS), min_size=3, max_size=14), st.integers(0, 2**32))
def test_whatever_a_healthy_site_does_nobody_is_alarmed(doings: list[str], seed: int) -> None:
    _live(world_of(lease="off"), doings, random.Random(seed))


@pytest.mark.parametrize("profile", ["teco-7200gs", "s2000", "shihlin-sl3"])
def test_a_long_life_without_a_false_alarm(profile: str) -> None:
    from fractions import Fraction

    known = {"e1_04": Fraction(60), "h1_02": Fraction(1)} if profile == "s2000" else {}
    site = with_control(site_of(profile, **known), lease="off")
    world = World(site, acceleration=0.5, deceleration=0.5)
    world.run(1.0)
    rng = random.Random(profile)
    _live(world, [rng.choice(DOINGS) for _ in range(60)], rng)


def _live(world: World, doings: list[str], rng: random.Random) -> None:
    for doing in doings:
        world.restart() if doing == "restart" else _do(world, doing, rng)
        world.run(rng.uniform(0.0, 12.0))
        assert alarms(world) == [], doing


def _do(world: World, doing: str, rng: random.Random) -> None:
    drive = next(iter(world.drives))
    profile = world.core.drives[0].profile
    speed = float(rng.randrange(10, 50))
    if doing == "join":
        session = world.join(f"client-{len(world.told)}")
        world.watch({f"{drive}.frequency_command": 0.5, f"{drive}.running": 0.2}, session)
    elif doing == "leave":
        world.leave(max(world.told))
        world.session = world.join("again")
    elif doing == "trip" and "fault_overcurrent" in profile.points:
        world.drives[drive].post(Trip("fault_overcurrent"))
    elif doing == "run" and "take_control" in profile.commands:
        world.command("take_control", drive=drive)
        world.command("run_forward", drive=drive, frequency=speed)
    elif doing in ("run", "reverse"):
        world.command(f"run_{'forward' if doing == 'run' else 'reverse'}", drive=drive, frequency=speed)
    elif doing in ("stop", "reset"):
        world.command("stop" if doing == "stop" else "reset_fault", drive=drive)
    elif doing == "speed":
        world.write(f"{drive}.frequency_command", speed, OPERATOR)
    elif doing == "param":
        world.write(f"{drive}.acceleration_time_1", rng.randrange(10, 60), ENGINEER)
    elif doing == "input":
        switches = [p.name for p in profile.points.values() if p.kind == "switch"]
        chosen = [s for s in switches if s not in ("external_fault", "terminal_4")]
        world.write(f"{drive}.{rng.choice(chosen)}", rng.random() < 0.5, OPERATOR)
