"""Wire traces on their way out: fetched from a running gateway or a file, told as text, JSON or pcapng."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO

from gateway import __version__
from gateway.bridge.api import Bridge
from gateway.capture import pcapng
from gateway.capture.source import Captured, CaptureError, Source
from gateway.capture.text import exact_moment, frame_line, head_line, read_text
from gateway.capture.wireshark import Writer, read_capture
from gateway.terminal.errors import CommandError, UsageError
from gateway.terminal.output import say, say_json

POLL_SECONDS = 0.1
"""How often a running gateway is asked for new frames."""

Tell = Callable[[Captured], None]
"""Passes one frame on."""


def kept_frames(path: Path, names: Sequence[str]) -> list[Captured]:
    """The frames of some lines in a file, text or pcapng.

    Raises:
        CommandError: if it cannot be read, or is no trace.
    """
    try:
        data = path.read_bytes()
        frames = read_capture(data) if data.startswith(pcapng.MAGIC) else read_text(data.decode())
        return [captured for captured in frames if captured.source.name in names]
    except OSError as error:
        raise CommandError(f"{path} cannot be read: {error.strerror}") from error
    except (CaptureError, UnicodeDecodeError) as error:
        raise CommandError(f"{path} is no trace: {error}") from error


async def live_frames(
    bridge: Bridge, sources: Sequence[Source], last: float | None, follow: bool
) -> AsyncIterator[list[Captured]]:
    """Frames of a running gateway in batches, oldest first: what it has kept (of the ``last`` seconds), then
    with ``follow`` what comes, until the task is cancelled."""
    oldest = 0 if last is None else time.time_ns() - round(last * 1e9)
    numbers = dict.fromkeys((source.name for source in sources), 0)
    while True:
        batch = [captured for source in sources for captured in await _newer(bridge, source, numbers)]
        batch.sort(key=lambda captured: captured.frame.time)
        yield [captured for captured in batch if captured.frame.time >= oldest]
        if not follow:
            return
        await asyncio.sleep(POLL_SECONDS)


async def _newer(bridge: Bridge, source: Source, numbers: dict[str, int]) -> list[Captured]:
    """What a line has beyond the number that was seen last."""
    found: list[Captured] = []
    while True:
        seen = numbers[source.name]
        page = await bridge.trace(source.name, seen)
        if seen and page.first > seen + 1:
            sys.stderr.write(f"line {source.name}: {page.first - seen - 1} frames were not kept\n")
        found += [Captured(source, frame) for frame in page.frames]
        numbers[source.name] = page.first + len(page.frames) - 1
        if numbers[source.name] >= page.last:
            return found


def text_teller(sources: Iterable[Source]) -> Tell:
    """Tells frames as text; each line's description comes first."""
    for source in sources:
        say(head_line(source))
    return lambda captured: say(frame_line(captured))


def json_teller() -> Tell:
    """Tells frames as JSON objects."""
    return lambda captured: say_json(frame_object(captured))


def pcapng_teller(stack: ExitStack, target: str, sources: Sequence[Source]) -> Tell:
    """Writes frames to a file, or to standard output if that is ``-``.

    Raises:
        UsageError: if they would fill a terminal.
        CommandError: if the file cannot be written.
    """
    file = _opened(stack, target)
    writer = Writer(f"gateway {__version__}", sources)
    file.write(writer.head)
    file.flush()

    def tell(captured: Captured) -> None:
        file.write(writer.frame(captured))
        file.flush()

    return tell


def frame_object(captured: Captured) -> dict[str, Any]:
    """A frame for programs; the shape stands in docs/cli.md."""
    source, frame = captured
    return {
        "time": exact_moment(frame.time),
        "line": source.name,
        "sent": frame.sent,
        "data": frame.data.hex(" ").upper(),
        "note": frame.note,
    }


def _opened(stack: ExitStack, target: str) -> BinaryIO:
    if target == "-":
        if sys.stdout.isatty():
            raise UsageError("pcapng is not for terminals (give a file, or: | wireshark -k -i -)")
        return sys.stdout.buffer
    try:
        return stack.enter_context(Path(target).open("wb"))
    except OSError as error:
        raise CommandError(f"{target} cannot be written: {error.strerror}") from error
