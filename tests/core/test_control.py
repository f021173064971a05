"""Who may command a drive, through the whole core on a simulated 7200GS: leases, dead-man, maintenance."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import msgspec
import pytest

from gateway.bridge.api import LeaseAct
from gateway.core.events import PortLost, PortOpened
from gateway.mapping.profile import Pace
from gateway.mapping.site import Control
from gateway.tag import Cause, Origin, Outcome, Role, Verdict
from tests.core.world import ENGINEER, OPERATOR, World, make_site

ANNA = Origin(through="opcua", who="anna", role=Role.OPERATOR, session="s1")
BOB = Origin(through="mqtt", who="bob", role=Role.OPERATOR, address="mqtt://b", authenticated=False)
ADMIN = Origin(through="cli", who="root", role=Role.ADMIN)
SPEED = "fan-1.frequency_command"
RUN_60 = "05 10 00 01 00 02 04 00 01 17 70 78 87"
STOP = "05 10 00 01 00 01 02 00 00 95 41"
TTL = 10.0


def leased(on_expiry: str = "stop", setpoint: Any = None, **more: Any) -> World:
    value = None if setpoint is None else Fraction(setpoint)
    control = Control("session", TTL, on_expiry, value)
    world = World(make_site(control=control, **more))
    world.run(1.0)
    return world


def entries(world: World, kind: str) -> list[dict[str, Any]]:
    return [entry for entry in world.journal if entry["kind"] == kind]


def running(world: World) -> bool:
    [sample] = world.read("fan-1.running")
    return bool(sample.value)


def test_h12_two_clients_one_drive() -> None:
    world = leased()
    assert world.command("run_forward", ANNA, frequency=60.0).verdict is Verdict.CONFIRMED
    refused = [
        world.command("run_forward", BOB, frequency=10.0),
        world.write(SPEED, 10.0, BOB),
        world.write("fan-1.acceleration_time_1", 5.0, ENGINEER),
    ]
    for outcome in refused:
        assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.LEASE)
        assert "held by anna (opcua)" in outcome.reason
    assert world.sent() == [RUN_60]
    assert world.control().holder == ANNA
    assert len(entries(world, "outcome")) == 4, "each attempt is on record"


def test_h12_h20_anyone_authorised_stops() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    assert world.command("stop", BOB).verdict is Verdict.CONFIRMED
    assert not running(world)
    assert world.control().holder == ANNA


def test_h10_the_dead_mans_stop_is_sent_once_and_is_on_record() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    world.run(TTL + 1)
    assert world.sent() == [RUN_60, STOP]
    world.run(60.0)
    assert not running(world)
    assert world.sent() == [RUN_60, STOP]
    last = entries(world, "outcome")[-1]
    assert last["what"] == "fan-1.stop"
    assert last["by"]["through"] == "core"
    assert "the lease of anna (opcua) is expired" in last["by"]["who"]
    assert last["outcome"]["verdict"] == "confirmed"
    assert "lease_expired" in world.events()
    assert world.control().phase == "free"


def test_h10_the_dead_mans_stop_is_repeated_until_the_drive_obeys() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    world.drives["fan-1"].faults.mute()
    world.run(TTL + 5)
    assert len(world.sent()) > 3
    world.drives["fan-1"].faults.clear()
    world.run(60.0)
    assert not running(world)


def test_h10_polling_renews_nothing_commands_do() -> None:
    world = leased()
    world.watch({"fan-1.output_frequency": 0.2})
    world.command("run_forward", ANNA, frequency=60.0)
    world.run(TTL - 2)
    world.write(SPEED, 50.0, ANNA)
    world.run(TTL - 2)
    world.read("fan-1.running")
    assert running(world)
    world.run(4.0)
    assert world.sent()[-1] == STOP


def test_h10_a_setpoint_may_follow_instead() -> None:
    world = leased("setpoint: 20", 20)
    world.command("run_forward", ANNA, frequency=60.0)
    world.run(TTL + 5)
    [speed] = world.read(SPEED)
    assert speed.value == 20.0
    assert running(world)
    assert entries(world, "outcome")[-1]["what"] == SPEED


def test_h10_where_the_setpoint_cannot_be_written_a_stop_follows() -> None:
    """A stop is insisted on, and nothing stands in its way: here a journal that cannot be written."""
    world = leased("setpoint: 20", 20)
    world.command("run_forward", ANNA, frequency=60.0)
    world.journal_problem = "disk full"
    world.run(TTL + 5)
    assert not running(world)
    assert world.sent() == [RUN_60, STOP]


def test_h10_hold_leaves_it_running() -> None:
    world = leased("hold")
    world.command("run_forward", ANNA, frequency=60.0)
    world.run(5 * TTL)
    assert running(world)
    assert world.sent() == [RUN_60]
    assert world.control().phase == "free"


def test_h10_a_session_that_ends_stops_the_motor_at_once() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    world.gone(ANNA)
    world.run(0.5)
    assert world.sent() == [RUN_60, STOP]


def test_h10_parameters_alone_leave_nothing_to_make_good() -> None:
    world = leased()
    world.write("fan-1.acceleration_time_1", 5.0, ENGINEER)
    assert world.control().holder == ENGINEER
    before = len(world.sent())
    world.run(3 * TTL)
    assert len(world.sent()) == before


def test_h12_nothing_queued_of_a_client_that_lost_its_lease_reaches_the_wire() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    asked = [world.ask_write(f"fan-1.preset_frequency_{n}", 10.0 + n, ANNA_ENGINEER) for n in range(2, 9)]
    assert world.lease(LeaseAct.TAKE, ADMIN).verdict is Verdict.CONFIRMED
    outcomes = [world.until(ask, 10.0) for ask in asked]
    assert {outcome.cause for outcome in outcomes} <= {Cause.LEASE, Cause.NONE}
    assert outcomes[-1].cause is Cause.LEASE
    taken = next(e["at"] for e in world.journal if e["kind"] == "lease" and e["did"] == "taken")
    late = [(at, frame) for at, frame in world.wire if frame[3:5] == "10" and at > taken]
    assert late == []


ANNA_ENGINEER = msgspec.structs.replace(ANNA, role=Role.ENGINEER)


def test_taking_over_needs_its_own_right_and_is_told() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    assert world.lease(LeaseAct.TAKE, BOB).cause is Cause.NO_RIGHTS
    assert world.lease(LeaseAct.TAKE, ENGINEER, whom="bob").cause is Cause.LEASE
    assert world.lease(LeaseAct.TAKE, ENGINEER, whom="anna").verdict is Verdict.CONFIRMED
    assert "lease_taken" in world.events()
    assert world.write(SPEED, 10.0, ANNA).cause is Cause.LEASE
    assert world.write(SPEED, 10.0, ENGINEER).verdict is Verdict.CONFIRMED
    refused = entries(world, "lease_asked")
    assert [e["outcome"]["cause"] for e in refused] == ["no_rights", "lease"]


def test_e1_a_viewer_holds_no_lease() -> None:
    world = leased()
    viewer = Origin(through="opcua", who="vera", role=Role.VIEWER, session="s9")
    assert world.lease(LeaseAct.ACQUIRE, viewer).cause is Cause.NO_RIGHTS
    low = world.join("mqtt", ceiling=Role.VIEWER)
    assert world.lease(LeaseAct.ACQUIRE, BOB, session=low).cause is Cause.NO_RIGHTS


def test_h11_h10_killed_and_started_again_the_holder_returns_in_time() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    world.run(5.0)
    world.restart()
    world.run(TTL - 3)
    again = msgspec.structs.replace(ANNA, session="s2")
    assert world.write(SPEED, 50.0, BOB).cause is Cause.LEASE
    assert world.write(SPEED, 50.0, again).verdict is Verdict.CONFIRMED
    world.run(TTL - 2)
    assert running(world)
    world.run(4.0)
    assert world.sent()[-1] == STOP


def test_h11_h10_killed_and_started_again_the_action_follows_and_nothing_else() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    sent = len(world.sent())
    world.restart()
    world.run(TTL - 1)
    assert len(world.sent()) == sent, "no write follows a restart by itself"
    world.run(2.0)
    assert world.sent()[sent:] == [STOP]
    world.run(60.0)
    world.restart()
    world.run(60.0)
    assert world.sent()[sent:] == [STOP]


def test_h10_clients_hear_that_a_lease_from_before_a_restart_is_over() -> None:
    """Found by a world in a box (`python -m tests.prove`)."""
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    world.command("stop", ANNA)
    world.restart()
    assert world.control().holder == ANNA
    world.run(TTL + 1)
    assert world.control().holder is None


def test_h11_h10_killed_while_the_stop_was_not_confirmed_it_is_sent_again() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    world.feed(PortLost("north", "unplugged"))
    world.port_problem = "unplugged"
    world.run(TTL + 2)
    world.port_problem = ""
    world.restart()
    world.run(30.0)
    assert not running(world)


def test_h11_a_restart_forgets_no_maintenance() -> None:
    world = leased()
    world.maintain(True, reason="bearing")
    world.restart()
    world.run(1.0)
    outcome = world.command("run_forward", ANNA, frequency=10.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.MAINTENANCE)
    assert "erika (test): bearing" in outcome.reason
    world.maintain(False)
    assert world.command("run_forward", ANNA, frequency=10.0).verdict is Verdict.CONFIRMED
    world.restart()
    assert world.control().maintenance == ""


def test_maintenance_lets_only_a_stop_through() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    queued = [world.ask_write(f"fan-1.preset_frequency_{n}", 10.0 + n, ANNA_ENGINEER) for n in range(2, 9)]
    assert world.maintain(True, BOB).cause is Cause.NO_RIGHTS
    assert world.maintain(True).verdict is Verdict.CONFIRMED
    assert world.until(queued[-1], 5.0).cause is Cause.MAINTENANCE
    before = len(world.sent())
    for outcome in (
        world.write(SPEED, 10.0, ANNA),
        world.command("run_forward", ANNA, frequency=10.0),
        world.write("fan-1.acceleration_time_1", 5.0, ADMIN),
        world.lease(LeaseAct.TAKE, ADMIN),
    ):
        assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.MAINTENANCE)
    assert len(world.sent()) == before
    assert world.command("stop", BOB).verdict is Verdict.CONFIRMED
    assert "maintenance_on" in world.events()


def test_e1_roles_are_checked_again_when_the_frame_is_about_to_go() -> None:
    world = World(make_site(), journal_delay=0.3)
    world.run(1.0)
    session = world.join("adapter")
    asked = world.ask_write(SPEED, 10.0, OPERATOR, session=session)
    world.run(0.2)
    world.leave(session)
    world.run(3.0)
    assert world.sent() == [], "whoever asked is gone"
    assert asked() is None
    last = entries(world, "outcome")[-1]["outcome"]
    assert (last["verdict"], last["cause"]) == ("refused", "no_rights")


def test_h20_a_stop_goes_on_although_its_asker_is_gone() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    session = world.join("adapter")
    world.ask_command("stop", origin=BOB, session=session)
    world.leave(session)
    world.run(30.0)
    assert not running(world)


DANGER = "fan-1.access_level"
HARM = "initialises the whole drive"


@pytest.mark.parametrize(
    ("origin", "confirm", "word"),
    [
        (ENGINEER, HARM, "admin"),
        (ADMIN, "", HARM),
        (ADMIN, "yes", HARM),
        (msgspec.structs.replace(ADMIN, together=2), HARM, "request of its own"),
    ],
)
def test_danger_takes_an_admin_who_names_what_happens_in_a_request_of_its_own(
    origin: Origin, confirm: str, word: str
) -> None:
    world = World()
    world.run(1.0)
    outcome = world.write(DANGER, "initialise_2_wire", origin, confirm=confirm)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.DANGER)
    assert word in outcome.reason
    assert world.sent() == []


def test_danger_is_done_when_it_is_confirmed() -> None:
    world = World()
    world.run(1.0)
    world.write(DANGER, "initialise_2_wire", ADMIN, confirm=f" {HARM.upper()} ")
    assert len(world.sent()) == 1


def test_h10_the_action_is_bound_by_the_slew_too() -> None:
    world = leased("setpoint: 20", 20, limits={"frequency_command": Pace(slew=Fraction(5))})
    world.command("run_forward", ANNA, frequency=40.0)
    world.run(3.0)
    assert world.control().ramps == {"frequency_command": 20.0}
    world.run(6.0)
    [speed] = world.read(SPEED)
    assert speed.value == 20.0


def test_h20_a_line_that_comes_back_brings_the_dead_mans_stop() -> None:
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    world.feed(PortLost("north", "unplugged"))
    world.port_problem = "unplugged"
    world.run(TTL + 5)
    world.port_problem = ""
    world.feed(PortOpened("north"))
    world.run(60.0)
    assert not running(world)
    assert Outcome(**msgspec.convert(entries(world, "outcome")[-1]["outcome"], dict)).reason


def test_h10_the_action_is_refused_by_no_limit_of_clients() -> None:
    pace = Pace(step=Fraction(5), interval=60.0)
    world = leased("setpoint: 20", 20, limits={"frequency_command": pace})
    for speed in (5.0, 10.0):
        world.command("run_forward", ANNA, frequency=speed, ttl=90.0)
        world.run(61.0 if speed < 10 else 0.0)
    world.run(TTL + 3)
    [speed] = world.read(SPEED)
    assert speed.value == 20.0


def test_h10_a_lease_that_is_over_is_not_renewed_however_late_we_are() -> None:
    """The process was stopped for a while: the first thing that it finds is a command of the old holder."""
    world = leased()
    world.command("run_forward", ANNA, frequency=60.0)
    world.now += 2 * TTL
    world.ask_write(SPEED, 50.0, ANNA)
    world.run(5.0)
    assert [e["did"] for e in entries(world, "lease")][:3] == ["acquired", "expired", "acquired"]
    assert world.sent()[1] == STOP


def test_who_holds_a_lease_and_for_how_long_are_tags() -> None:
    names = ("fan-1._lease_holder", "fan-1._lease_through", "fan-1._lease_left")
    world = leased()
    assert [sample.value for sample in world.read(*names)] == ["", "", 0.0]
    world.lease(LeaseAct.ACQUIRE, ANNA)
    world.run(4.0)
    holder, through, left = (sample.value for sample in world.read(*names))
    assert (holder, through) == ("anna", "opcua, s1")
    assert left == pytest.approx(1000 * (TTL - 4.0), abs=50)
