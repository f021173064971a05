"""Exported traces played again: through the decoder, and into a fresh line, which then does the same."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import groupby
from pathlib import Path

import pytest

from gateway.bridge.api import Frame
from gateway.capture.source import Captured, Source, source_of
from gateway.capture.text import frame_line, head_line, read_text
from gateway.capture.wireshark import Writer, read_capture
from gateway.line.interface import Action, BlockRead, OpenPort, Transmit, Want
from gateway.line.line import Line
from gateway.modbus.framing import FramingName, framing_of
from gateway.modbus.pdu import Reply, Request, loop_back, read_registers, write_register, write_registers
from tests.capture.runs import eventful, trace_of
from tests.line.bench import CHARACTER, SETTINGS, Bench, FakeUnit, facts

Export = Callable[[Path, list[Captured]], list[Captured]]
NORTH = Source("north", "rtu", "9600 8N2", "/dev/ttyUSB0")


def through_text(folder: Path, captured: list[Captured]) -> list[Captured]:
    file = folder / "trace.txt"
    lines = [head_line(captured[0].source), *map(frame_line, captured)]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return list(read_text(file.read_text(encoding="utf-8")))


def through_pcapng(folder: Path, captured: list[Captured]) -> list[Captured]:
    file = folder / "trace.pcapng"
    writer = Writer("gateway test", [captured[0].source])
    file.write_bytes(writer.head + b"".join(map(writer.frame, captured)))
    return list(read_capture(file.read_bytes()))


exported = pytest.mark.parametrize("export", [through_text, through_pcapng])


def request_in(framing: FramingName, frame: bytes) -> Request:
    """The request that a frame carries, told from its bytes alone."""
    content = bytes.fromhex(frame[1:-4].decode()) if framing == "ascii" else frame[:-2]
    function, first, second = content[1], *(int.from_bytes(content[at : at + 2], "big") for at in (2, 4))
    words = [int.from_bytes(content[at : at + 2], "big") for at in range(7, len(content), 2)]
    return {
        3: lambda: read_registers(first, second),
        6: lambda: write_register(first, second),
        8: lambda: loop_back(second),
        16: lambda: write_registers(first, words),
    }[function]()


def exchanges(captured: list[Captured]) -> Iterator[tuple[Request, Reply | None]]:
    """Each request with the reply that the product's decoder finds in what came in after it."""
    framing = captured[0].source.framing
    decoder = framing_of(framing)
    frames = [captured.frame for captured in captured]
    for number, asked in enumerate(frames):
        if asked.sent:
            request = request_in(framing, asked.data)
            seeker = decoder.seeker(asked.data, request)
            replies = (seeker.feed(frame.data) for frame in frames_until_next_request(frames[number + 1 :]))
            yield request, next((reply for reply in replies if reply is not None), None)


def frames_until_next_request(frames: list[Frame]) -> Iterator[Frame]:
    for frame in frames:
        if frame.sent:
            return
        yield frame


@exported
@pytest.mark.parametrize(
    ("profile", "serial", "framing", "settings"),
    [
        ("teco-7200gs", "9600 8N2", "rtu", "{}"),
        ("s2000", "9600 8N1", "rtu", "{e1_04: 50}"),
        ("shihlin-sl3", "9600 7E1", "ascii", "{}"),
    ],
)
def test_the_decoder_finds_the_values_that_were_published(
    export: Export, profile: str, serial: str, framing: str, settings: str, tmp_path: Path
) -> None:
    life = eventful(tmp_path, profile, serial, framing, settings)
    kept = export(tmp_path, trace_of(life))
    found = list(exchanges(kept))
    notes = [captured.frame.note for captured in kept]
    assert sum(reply is None for _, reply in found) == sum("time-out" in note for note in notes) == 2
    point = life.site.lines[0].drives[0].profile.points["frequency_command"]
    decoded = [
        reply.words[point.address - first] * float(point.encoding.scale)
        for request, reply in found
        if request.function == 3 and reply is not None and reply.words
        for first in [int.from_bytes(request.pdu[1:3], "big")]
        if first <= point.address < first + len(reply.words)
    ]
    published = [s.value for s in life.samples("fan-1.frequency_command") if s.value is not None]
    assert without_repeats(decoded) == pytest.approx(without_repeats(published))


def without_repeats(values: Iterable[object]) -> list[object]:
    return [value for value, _ in groupby(values)]


WANTS = (Want(5, 0x20, 5, 0.2), Want(5, 0x31, 3, 0.5))


def troubled() -> Bench:
    """A line that is polled while replies are late, damaged, refused or behind noise."""
    fake = FakeUnit(registers={address: 0x1100 + address for address in range(0x20, 0x34)})
    bench = Bench([facts()], [fake]).start(*WANTS)
    bench.quiet = False
    bench.run(1)
    fake.before = b"\x00\x05\x03"
    bench.run(1)
    fake.before, fake.refuse = b"", {3: 6}
    bench.run(0.5)
    fake.refuse = {}
    bench.run(10)
    fake.damage = True
    bench.run(0.3)
    fake.damage = False
    bench.run(10)
    delays = iter([0.3])
    fake.late = lambda: next(delays, 0.0)
    bench.run(3)
    return bench


@exported
def test_a_fresh_line_that_hears_the_same_does_the_same(export: Export, tmp_path: Path) -> None:
    bench = troubled()
    bench.line.trace.settle(bench.now)
    traced = bench.line.trace.page(0, 10_000)[1]
    captured = [
        Captured(NORTH, Frame(round(at * 1e6) * 1000, sent, data, note)) for at, sent, data, note in traced
    ]
    assert {"damaged", "reply", "exception 06H", "read, time-out"} <= {frame.note for frame in traced}
    sent, reads = replayed(export(tmp_path, captured))
    assert sent == [frame.data for frame in traced if frame.sent]
    assert reads == [(block.address, block.words) for block in bench.of(BlockRead)]


def replayed(captured: list[Captured]) -> tuple[list[bytes], list[tuple[int, tuple[int, ...]]]]:
    """What a line sends, and the blocks that it reads, when it hears what was received."""
    line = Line(SETTINGS, [facts()])
    actions: list[Action] = [*line.demand(WANTS, 100.0), *line.start(100.0)]
    assert OpenPort() in actions
    actions += line.port_opened(100.001)
    for frame in (captured.frame for captured in captured):
        at = frame.time / 1e9
        if not frame.sent:
            at += len(frame.data) * CHARACTER
        while (wake := line.wake()) is not None and wake <= at + 2e-6:
            actions += line.tick(wake)
        if not frame.sent:
            actions += line.received(frame.data, at)
    if (wake := line.wake()) is not None and wake <= at + 2 * CHARACTER:  # the last reply is over
        actions += line.tick(wake)
    return (
        [action.data for action in actions if isinstance(action, Transmit)],
        [(action.address, action.words) for action in actions if isinstance(action, BlockRead)],
    )


def test_a_line_is_described_as_in_the_site(tmp_path: Path) -> None:
    life = eventful(tmp_path, "shihlin-sl3", "9600 7E1", "ascii")
    assert source_of(life.site.lines[0]) == Source("north", "ascii", "9600 7E1", "simulated:")
