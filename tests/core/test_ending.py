"""How the gateway ends: what it began is taken back first (H11)."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from gateway.core.events import Stopping
from gateway.tag import Outcome, Verdict
from tests.core.world import World, make_site

PULSED = "05 10 00 01 00 01 02 00 08"
"""The fault reset of a 7200GS that stands: bit 3 of 0001H."""
RELEASED = "05 10 00 01 00 01 02 00 00"


def pulsing(world: World) -> Callable[[], Outcome | None]:
    """A fault reset whose frame is on the wire this very moment."""
    world.run(1.0)
    outcome = world.ask_command("reset_fault")
    world.until(lambda: [frame for frame in world.sent() if frame.startswith(PULSED)] or None, 5.0)
    return outcome


def ended(world: World) -> float:
    """Seconds that the core takes to end."""
    begun = world.now
    world.feed(Stopping())
    world.until(lambda: world.core.ended, 2.0)
    return world.now - begun


@pytest.mark.parametrize("later", [0.0, 0.05, 0.15, 0.21])
def test_h11_a_pulse_under_way_is_taken_back_before_the_gateway_ends(later: float) -> None:
    world = World()
    outcome = pulsing(world)
    world.run(later)
    assert world.drives["fan-1"].registers[1] & 8 or later < 0.05
    assert ended(world) < 0.5
    assert world.sent()[-1].startswith(RELEASED)
    assert world.drives["fan-1"].registers[1] == 0
    assert outcome() is not None
    frames = len(world.wire)
    world.run(5.0)
    assert len(world.wire) == frames, "nothing more after it has ended"
    assert len([e for e in world.journal if e["kind"] == "intent"]) == len(world.sent())
    assert world.journal[-1]["kind"] == "end"


def test_h11_without_a_pulse_it_ends_at_once() -> None:
    world = World(make_site(2))
    world.run(1.0)
    running = world.ask_command("run_forward", frequency=20.0)
    world.until(lambda: world.sent() or None, 5.0)
    assert ended(world) == 0.0
    assert running() is not None
    assert running().verdict is Verdict.UNKNOWN  # type: ignore[union-attr]


def test_h11_a_drive_that_does_not_take_the_pulse_back_holds_the_end_up_for_a_moment_only() -> None:
    world = World()
    outcome = pulsing(world)
    world.run(0.1)
    world.drives["fan-1"].connected = False
    assert ended(world) < 0.7
    assert outcome() is not None


def test_h11_a_pulse_under_way_when_the_gateway_is_killed_is_left_to_the_next_command() -> None:
    """Nothing is written after a restart until somebody asks; what is written then has no pulse in it."""
    world = World()
    pulsing(world)
    world.run(0.1)
    world.restart()
    world.run(5.0)
    assert world.drives["fan-1"].registers[1] == 8
    told = [e["outcome"]["verdict"] for e in world.journal if e["kind"] == "outcome"]
    assert told == ["unknown"]
    assert world.command("stop").verdict is Verdict.CONFIRMED
    assert world.drives["fan-1"].registers[1] == 0
