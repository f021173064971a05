"""A stop that was obeyed is seen to be obeyed soon, on a line that has no time to spare too."""

from __future__ import annotations

from gateway.tag import Verdict
from tests.core.world import World, make_site

DRIVES = 8


def crowded() -> World:
    """Eight motors run, and somebody wants everything of them faster than the line can bring it."""
    world = World(make_site(DRIVES), acceleration=0.2, deceleration=0.2)
    world.run(3.0)
    for number in range(DRIVES):
        world.command("run_forward", drive=f"fan-{number + 1}", frequency=20.0)
    points = world.site.lines[0].drives[0].profile.points.values()
    names = [point.name for point in points if point.access.readable and not point.select]
    world.watch({f"fan-{n + 1}.{name}": 0.1 for n in range(DRIVES) for name in names})
    world.run(20.0)
    assert world.core.lines.plan("north").stretch > 10
    return world


def test_what_proves_a_stop_is_read_next_on_the_line() -> None:
    world = crowded()
    before = len(world.wire)
    told = world.ask_command("stop", drive="fan-3")
    outcome = world.until(told, 10.0)
    assert outcome.verdict is Verdict.CONFIRMED
    frames = [text for _, text in world.wire[before:]]
    stop = next(at for at, text in enumerate(frames) if text.startswith("07 10"))
    assert frames[stop + 1].startswith("07 03 00 01"), "what was written, read back"
    assert frames[stop + 2].startswith("07 03 00 20"), "and whether the motor still runs"


def test_eight_stops_at_once_are_all_confirmed_within_two_seconds() -> None:
    world = crowded()
    began = world.now
    told = [world.ask_command("stop", drive=f"fan-{n + 1}") for n in range(DRIVES)]
    world.until(lambda: all(one() for one in told), 10.0)
    assert {one().verdict for one in told if one()} == {Verdict.CONFIRMED}
    assert world.now - began < 2.0
