"""The gateway's own tags: watched and read like those of drives."""

import pytest

from gateway.bridge.api import DIAGNOSTIC, Batch
from gateway.core.own import SHORTEST
from gateway.tag import Cause, Quality, Verdict, is_own
from tests.core.world import World, make_site


def test_a_line_has_tags_that_can_be_read_at_once() -> None:
    world = World()
    world.run(5)
    sent, uptime, journal = world.read("_north.requests", "_gateway.uptime", "_gateway.journal")
    assert sent.value == world.core.lines.get("north").counters.requests > 0
    assert uptime.value == pytest.approx(world.now)
    assert (journal.value, journal.quality) == ("", Quality.GOOD)


def test_a_watched_one_is_told_at_its_period_and_never_faster_than_once_a_second() -> None:
    world = World()
    periods = world.watch({"_north.requests": 0.01, "_north.utilisation": 5.0, "_north.nothing": 1.0})
    assert periods == {"_north.requests": SHORTEST, "_north.utilisation": 5.0}
    world.run(20)
    assert 19 <= len(world.samples("_north.requests")) <= 22
    assert 4 <= len(world.samples("_north.utilisation")) <= 6
    told = [sample.value for sample in world.samples("_north.requests")]
    assert told == sorted(told)
    assert all(sample.age == SHORTEST for sample in world.samples("_north.requests")[1:])


def test_nobody_is_told_what_he_does_not_watch() -> None:
    world = World()
    other = world.join()
    world.watch({"_north.requests": 1.0})
    world.run(3)
    world.watch({"_north.requests": None})
    before = len(world.samples("_north.requests"))
    world.run(5)
    assert len(world.samples("_north.requests")) == before
    assert world.samples("_north.requests", other) == []
    assert world.core.own.wake() is None


def test_owners_take_turns_so_that_no_step_is_long() -> None:
    world = World(make_site(4))
    world.watch(dict.fromkeys(("_north.requests", "_gateway.uptime"), 1.0))
    world.run(3)
    batches = [m for m in world.told[world.session] if isinstance(m, Batch)]
    own = [{s.tag.split(".")[0] for s in batch.samples} for batch in batches[2:]]
    assert all(len(owners) == 1 for owners in own)


def test_they_are_in_the_catalogue_apart_from_what_the_profile_has() -> None:
    catalogue = World().core.catalogue
    assert [line.name for line in catalogue.lines] == ["_north"]
    for owner in catalogue.owners:
        for point in owner.points:
            assert is_own(f"{owner.name}.{point.name}") == (point.kind == DIAGNOSTIC)
            assert point.help or point.kind != DIAGNOSTIC


def test_nobody_writes_them() -> None:
    world = World()
    for tag in ("fan-1._timeouts", "_north.requests"):
        outcome = world.write(tag, 0)
        assert outcome.verdict is Verdict.REFUSED
        assert outcome.cause in (Cause.NOT_WRITABLE, Cause.UNKNOWN_TAG)
    assert not world.sent()
