"""R2: maintenance that would be lost at a restart is not confirmed."""

from __future__ import annotations

from gateway.bridge.messages import Done, Maintain
from gateway.core.events import Asked
from gateway.tag import Cause, Outcome, Verdict
from tests.core.world import ENGINEER, World

FULL = "No space left on device"


def settled(journal_delay: float = 0.002) -> World:
    world = World(journal_delay=journal_delay)
    world.run(2.0)
    return world


def switch(world: World, on: bool) -> int:
    """Ask for it; the number of the request."""
    number = world._next_request()
    world.feed(Asked(world.session, Maintain(number, "fan-1", on, ENGINEER, "bearing")))
    return number


def outcomes(world: World, number: int) -> list[Outcome]:
    return [m.outcome for m in world.told[world.session] if isinstance(m, Done) and m.id == number]


def test_r2_maintenance_is_refused_while_it_cannot_be_kept() -> None:
    world = settled()
    world.journal_problem = FULL
    outcome = world.maintain(True, reason="bearing")
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.JOURNAL)
    assert FULL in outcome.reason
    assert world.control().maintenance == ""
    assert "maintenance_on" not in world.events()
    world.journal_problem = ""
    world.run(2.0)
    assert [e["kind"] for e in world.journal if "maintenance" in e["kind"]] == ["maintenance_asked"]
    assert world.maintain(True, reason="bearing").verdict is Verdict.CONFIRMED
    assert "maintenance_on" in world.events()


def test_r2_maintenance_stays_on_while_its_end_cannot_be_kept() -> None:
    world = settled()
    world.maintain(True, reason="bearing")
    world.journal_problem = FULL
    assert world.maintain(False).cause is Cause.JOURNAL
    assert "bearing" in world.control().maintenance
    world.journal_problem = ""
    world.restart()
    assert "bearing" in world.control().maintenance
    assert world.maintain(False).verdict is Verdict.CONFIRMED
    assert world.control().maintenance == ""


def test_maintenance_holds_from_the_moment_on_at_which_it_is_asked_for() -> None:
    world = settled(journal_delay=1.0)
    number = switch(world, True)
    assert not outcomes(world, number)
    assert world.write("fan-1.frequency_command", 10.0).cause is Cause.MAINTENANCE
    assert world.maintain(False).reason == "fan-1 is being switched; that is not on record yet"
    world.run(2.0)
    assert [outcome.verdict for outcome in outcomes(world, number)] == [Verdict.CONFIRMED]
    off = switch(world, False)
    assert world.write("fan-1.frequency_command", 10.0).cause is Cause.MAINTENANCE
    world.run(2.0)
    assert [outcome.verdict for outcome in outcomes(world, off)] == [Verdict.CONFIRMED]
    assert world.write("fan-1.frequency_command", 10.0).verdict is Verdict.CONFIRMED


def test_r2_a_disk_that_hangs_leaves_nobody_waiting_and_the_drive_in_maintenance() -> None:
    world = settled()
    world.journal_delay = 60.0
    number = switch(world, True)
    world.run(5.5)
    [outcome] = outcomes(world, number)
    assert (outcome.verdict, outcome.cause) == (Verdict.UNKNOWN, Cause.JOURNAL)
    assert "bearing" in world.control().maintenance
    world.run(60.0)
    assert "maintenance_on" in world.events()
    assert len(outcomes(world, number)) == 1


def test_r2_what_hung_and_then_failed_is_told_as_an_event() -> None:
    world = settled()
    world.journal_delay, world.journal_problem = 8.0, FULL
    number = switch(world, True)
    world.run(9.0)
    assert [outcome.verdict for outcome in outcomes(world, number)] == [Verdict.UNKNOWN]
    assert world.control().maintenance == ""
    assert "maintenance_refused" in world.events()
