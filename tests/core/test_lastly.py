"""The tag with the last outcome of a drive."""

from __future__ import annotations

from gateway.bridge.messages import TurnedAway
from gateway.core.events import Asked
from gateway.tag import Cause, Origin, Outcome, Quality, Role, Verdict
from tests.core.world import World, make_site

TAG = "fan-1._last_outcome"
ANNA = Origin(through="mqtt", who="anna", role=Role.OPERATOR)


def test_it_says_who_asked_for_what_through_what_and_what_became_of_it() -> None:
    world = World(make_site(2))
    world.run(1.0)
    assert world.read(TAG)[0].quality is Quality.WAITING
    world.watch({TAG: 60.0})
    world.command("run_forward", ANNA, frequency=30.0)
    world.write("fan-1.frequency_command", 70.0, ANNA)
    told = [sample.value for sample in world.samples(TAG)]
    assert told == [
        None,
        "confirmed: run_forward frequency=30.0 by anna through mqtt",
        "refused: frequency_command=70.0 by anna through mqtt: frequency_command = 70 is outside 0..60 Hz",
    ], "told at once, whatever the period"
    assert world.read("fan-2._last_outcome")[0].value is None


def test_what_an_adapter_turned_away_counts_and_is_not_told_at_any_length() -> None:
    world = World()
    outcome = Outcome(verdict=Verdict.REFUSED, cause=Cause.RETAINED, reason="r" * 1000)
    world.feed(Asked(world.session, TurnedAway(0, "fan-1.run_forward", "{}", ANNA, outcome)))
    told = str(world.read(TAG)[0].value)
    assert told.startswith("refused: run_forward={} by anna through mqtt: rrr")
    assert len(told) == 400


def test_a_stop_that_was_unknown_is_told_again_when_it_is_known() -> None:
    world = World()
    world.run(1.0)
    world.command("run_forward", frequency=30.0)
    world.drives["fan-1"].connected = False
    assert world.command("stop", ANNA).verdict is Verdict.UNKNOWN
    assert str(world.read(TAG)[0].value).startswith("unknown: stop by anna through mqtt: the drive did not")
    world.drives["fan-1"].connected = True
    world.until(lambda: world.read(TAG)[0].value == "confirmed: stop by anna through mqtt", 60.0)


def test_what_was_under_way_when_the_gateway_was_killed_is_unknown() -> None:
    world = World()
    world.run(1.0)
    world.ask_command("run_forward", origin=ANNA, frequency=30.0)
    world.until(lambda: world.sent() or None, 5.0)
    world.restart()
    assert str(world.read(TAG)[0].value).startswith(
        "unknown: run_forward frequency=30.0 by anna through mqtt"
    )
