"""Runs whose traces the tests export: the real core against simulated drives, on a virtual clock."""

from __future__ import annotations

from pathlib import Path

from gateway.bridge.api import Frame
from gateway.bridge.messages import AskTrace, TraceIs
from gateway.capture.source import Captured, Source, source_of
from gateway.core.events import Asked
from gateway.simulator.faults import CorruptByte, DropReply
from tests.core.world import World
from tests.profiles.life import Life


def trace_of(world: World) -> list[Captured]:
    """Everything that a world's only line has kept, page by page."""
    source = source_of(world.site.lines[0])
    frames: list[Frame] = []
    while True:
        world.feed(Asked(world.session, AskTrace(-1, source.name, len(frames))))
        last = world.told[world.session].pop()
        assert isinstance(last, TraceIs)
        frames += last.page.frames
        if len(frames) == last.page.last:
            return [Captured(source, frame) for frame in frames]


def source(world: World) -> Source:
    return source_of(world.site.lines[0])


def eventful(folder: Path, profile: str, serial: str, framing: str = "rtu", settings: str = "{}") -> Life:
    """A drive that is polled, obeys a command, loses a reply and damages one."""
    life = Life(folder, profile, unit=5, serial=serial, framing=framing, settings=settings).found()
    watched = [f"fan-1.{name}" for name in ("frequency_command", "output_frequency", "running", "ready")]
    life.watch({tag: 0.2 for tag in watched if life.core.polling.point(tag)})
    life.run(0.7)
    life.ask_write("fan-1.frequency_command", 10)
    life.run(0.5)
    life.ask_command("run_forward", frequency=30)
    life.run(2)
    life.drives["fan-1"].faults.inject(CorruptByte())
    life.run(0.5)
    life.drives["fan-1"].faults.inject(DropReply())
    life.run(2)
    return life
