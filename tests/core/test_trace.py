"""The trace as the core tells it: pages, and one time for each frame."""

from __future__ import annotations

import pytest

from gateway.bridge.api import TracePage
from gateway.bridge.messages import AskTrace, TraceIs, Wrong
from gateway.core.events import Asked
from gateway.core.health import PAGE
from gateway.tag import Instant
from tests.core.world import World


class Skewed(World):
    """A world whose wall clock is off by some nanoseconds."""

    skew = 0

    def instant(self) -> Instant:
        exact = super().instant()
        return Instant(exact.mono, exact.wall + self.skew)


def page(world: World, after: int = 0, line: str = "north") -> TracePage:
    world.feed(Asked(world.session, AskTrace(9, line, after)))
    answer = world.told[world.session].pop()
    assert isinstance(answer, TraceIs)
    return answer.page


def test_pages_follow_each_other() -> None:
    world = World()
    world.watch({"fan-1.output_frequency": 0.05})
    world.run(20)
    first = page(world)
    assert (first.first, len(first.frames)) == (1, PAGE)
    second = page(world, after=PAGE)
    assert second.first == PAGE + 1
    assert page(world, after=second.last).frames == ()


@pytest.mark.parametrize("jitter", [700, -700, 900_000])
def test_a_frame_has_one_time_however_the_clocks_are_looked_at(jitter: int) -> None:
    world = Skewed()
    world.run(1)
    before = page(world)
    world.skew = jitter
    assert page(world).frames[: len(before.frames)] == before.frames


def test_a_clock_that_was_set_counts() -> None:
    world = Skewed()
    world.run(1)
    before = page(world).frames[0].time
    world.skew = 3_600_000_000_000
    assert page(world).frames[0].time - before == pytest.approx(3_600_000_000_000, abs=1000)


def test_a_line_that_is_not_there() -> None:
    world = World()
    world.feed(Asked(world.session, AskTrace(9, "south", 0)))
    assert world.told[world.session].pop() == Wrong(9, "there is no line south")
