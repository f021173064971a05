"""Polling through the whole core: promises, qualities, drives that go and come."""

from __future__ import annotations

from itertools import pairwise

import pytest

from gateway.bridge.api import Periods
from gateway.line.interface import BlockRead
from gateway.tag import Quality
from tests.core.world import START, World, make_site

FREQUENCY = "fan-1.output_frequency"


@pytest.fixture
def world() -> World:
    return World()


def test_nothing_is_polled_that_nobody_wants_but_the_status_that_feeds_the_drives_watchdog(
    world: World,
) -> None:
    world.run(10.0)
    reads = world.sent("03")
    assert {frame[:17] for frame in reads} == {"05 03 00 20 00 01"}
    assert 9 <= len(reads) <= 12


def test_a_watch_promises_a_period_and_keeps_it(world: World) -> None:
    periods = world.watch({FREQUENCY: 0.2, "fan-1.output_voltage": 1.0, "fan-1.warp": 0.1})
    assert periods == {FREQUENCY: 0.2, "fan-1.output_voltage": 1.0}
    world.run(5.0)
    times = [sample.time for sample in world.samples(FREQUENCY) if sample.quality is Quality.GOOD]
    gaps = [(b - a) / 1e9 for a, b in pairwise(times)]
    assert len(times) >= 23
    assert max(gaps) < 0.3


def test_the_first_sample_comes_at_once_and_says_that_nothing_was_read(world: World) -> None:
    world.watch({FREQUENCY: 0.2})
    [first] = world.samples(FREQUENCY)
    assert (first.value, first.quality) == (None, Quality.WAITING)


def test_h17_whoever_watches_hears_that_a_value_is_old_when_another_wants_it_more_often(world: World) -> None:
    """Found by a world in a box (`python -m tests.prove`)."""
    world.watch({FREQUENCY: 10.0})
    world.run(1.0)
    world.drives["fan-1"].connected = False
    world.run(0.9)
    assert world.samples(FREQUENCY)[-1].quality is Quality.GOOD
    world.watch({FREQUENCY: 0.2}, world.join())
    world.run(0.2)
    assert world.samples(FREQUENCY)[-1].quality is not Quality.GOOD


def test_the_source_time_is_that_of_the_frame(world: World) -> None:
    world.watch({FREQUENCY: 0.2})
    world.run(1.0)
    sample = world.samples(FREQUENCY)[-1]
    assert START < sample.time <= world.instant().wall
    assert 0 < sample.age < 1.0


def test_h17_a_value_known_since_earlier_takes_no_newer_ones_place(world: World) -> None:
    """An answer in doubt is known to be true since an instant before another read brought the same registers.
    Found by a world in a box (`python -m tests.prove`)."""
    world.watch({FREQUENCY: 0.2})
    world.run(1.0)
    newest, now = world.samples(FREQUENCY)[-1], world.instant()
    drive = next(drive for drive in world.core.drives if drive.name == "fan-1")
    world.core.polling.read(drive, BlockRead(5, 0x24, (999,), now.mono - 0.6), now)
    held = world.core.polling.store.get(FREQUENCY)
    assert held is not None
    assert held.sample == newest


def test_a_withdrawn_watch_ends_the_reads(world: World) -> None:
    world.watch({FREQUENCY: 0.1})
    world.run(2.0)
    world.watch({FREQUENCY: None})
    before = len([f for f in world.sent("03") if f.startswith("05 03 00 24")])
    world.run(5.0)
    assert len([f for f in world.sent("03") if f.startswith("05 03 00 24")]) <= before + 1


def test_a_session_that_vanishes_takes_its_demands_with_it(world: World) -> None:
    other = world.join("opcua")
    world.watch({FREQUENCY: 0.1}, other)
    world.run(1.0)
    world.leave(other)
    world.wire.clear()
    world.run(5.0)
    assert [f for f in world.sent("03") if f.startswith("05 03 00 24")] == []


def test_a_silent_drive_is_bad_everywhere_and_comes_back_by_itself(world: World) -> None:
    world.watch({FREQUENCY: 0.2, "fan-1.run_source": 30.0})
    world.run(2.0)
    world.drives["fan-1"].faults.mute()
    world.run(8.0)
    lost = world.samples(FREQUENCY)[-1]
    assert (lost.value, lost.quality) == (None, Quality.NO_COMMUNICATION)
    assert world.samples("fan-1.run_source")[-1].quality is Quality.NO_COMMUNICATION
    assert world.states()[-1] == ("fan-1", False)
    assert "communication_lost" in world.events()
    world.drives["fan-1"].faults.clear()
    world.run(8.0)
    assert world.samples(FREQUENCY)[-1].quality is Quality.GOOD
    assert world.states()[-1] == ("fan-1", True)
    assert "communication_restored" in world.events()


def test_a_drive_that_was_never_there_is_said_to_be_away() -> None:
    world = World()
    world.drives["fan-1"].faults.mute()
    world.watch({FREQUENCY: 0.2})
    world.run(8.0)
    assert world.samples(FREQUENCY)[-1].quality is Quality.NO_COMMUNICATION
    assert world.states()[-1] == ("fan-1", False)


def test_a_silent_drive_does_not_slow_the_others() -> None:
    world = World(make_site(drives=4))
    for n in (1, 2, 3, 4):
        world.watch({f"fan-{n}.output_frequency": 0.5})
    world.run(2.0)
    world.drives["fan-2"].faults.mute()
    world.run(20.0)
    before = len(world.samples(FREQUENCY))
    world.run(20.0)
    assert len(world.samples(FREQUENCY)) - before >= 38


def test_a_lost_port_is_said_to_be_lost_and_opened_again(world: World) -> None:
    from gateway.core.events import PortLost

    world.watch({FREQUENCY: 0.2})
    world.run(2.0)
    world.port_problem = "unplugged"
    world.feed(PortLost("north", "unplugged"))
    lost = world.samples(FREQUENCY)[-1]
    assert (lost.quality, lost.value) == (Quality.LINE_DOWN, None)
    assert "unplugged" in lost.reason
    world.run(10.0)
    world.port_problem = ""
    world.run(10.0)
    assert world.samples(FREQUENCY)[-1].quality is Quality.GOOD


def test_a_value_from_before_anybody_watched_is_not_passed_off_as_the_present_one(world: World) -> None:
    world.watch({FREQUENCY: 0.2})
    world.run(2.0)
    world.watch({FREQUENCY: None})
    world.run(60.0)
    before = len(world.samples(FREQUENCY))
    world.watch({FREQUENCY: 0.2})
    assert world.samples(FREQUENCY)[before].quality is Quality.WAITING


def test_a_read_on_request_is_fresh_or_from_the_store(world: World) -> None:
    world.run(0.1)
    [first] = world.read("fan-1.output_voltage")
    assert first.quality is Quality.GOOD
    requests = len(world.wire)
    [again] = world.read("fan-1.output_voltage", max_age=60.0)
    assert again == first
    assert len(world.wire) == requests
    world.run(1.5)
    [fresh, wrong] = world.read("fan-1.output_voltage", "fan-1.warp", max_age=1.0)
    assert fresh.time > first.time
    assert wrong.quality is Quality.CONFIGURATION


def test_reads_of_touching_registers_share_a_request(world: World) -> None:
    world.run(0.5)
    world.wire.clear()
    samples = world.read("fan-1.output_current", "fan-1.output_voltage", "fan-1.output_frequency")
    assert [s.quality for s in samples] == [Quality.GOOD] * 3
    asked = [f for f in world.sent("03") if not f.startswith("05 03 00 20")]
    assert len(asked) == 2, "0024H alone, 0027H and 0028H together: 0025H and 0026H are a hole"


def test_an_overloaded_line_stretches_its_promises_and_says_so() -> None:
    world = World(make_site(drives=8, baud=2400))
    tags = {
        f"fan-{n}.{p}": 0.1
        for n in range(1, 9)
        for p in ("output_frequency", "output_voltage", "output_power")
    }
    promised = world.watch(dict(tags))
    assert min(promised.values()) > 1.0
    world.run(30.0)
    samples = [s for s in world.samples(FREQUENCY) if s.quality is not Quality.WAITING]
    assert len(samples) >= 5
    assert {s.quality for s in samples} == {Quality.GOOD}


def test_watchers_hear_of_periods_that_others_changed() -> None:
    world = World(make_site(drives=8, baud=2400))
    world.watch({FREQUENCY: 0.3})
    other = world.join("other")
    world.watch({f"fan-{n}.output_voltage": 0.1 for n in range(1, 9)}, other)
    world.run(1.0)
    assert any(isinstance(m, Periods) and FREQUENCY in m.periods for m in world.told[world.session])
