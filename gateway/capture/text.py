"""A trace as text: one frame a line, exact and complete, so that it can be read again.

    # line north: rtu 9600 8N2 on /dev/ttyUSB0
    2026-11-24T12:00:00.123456Z  north  >> 05 03 00 24 00 01 C5 85  read
    2026-11-24T12:00:00.137622Z  north  << 05 03 02 0B B8 4E C6  reply

The time is that of the first bit on the wire, in UTC.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import UTC, datetime

from gateway.bridge.api import Frame
from gateway.capture.source import Captured, CaptureError, Source, described

_HEAD = re.compile(r"# line (\S+): (.*)")
_CLOCK = r"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d)\.(\d{6})Z"
_FRAME = re.compile(_CLOCK + r"  (\S+)  (>>|<<) ([0-9A-F]{2}(?: [0-9A-F]{2})*)(?:  (.*))?", re.ASCII)
_SECOND = 1_000_000_000


def head_line(source: Source) -> str:
    """What stands above the first frame of a line."""
    return f"# line {source.name}: {source.description}"


def frame_line(captured: Captured) -> str:
    """A frame as a line of text."""
    source, frame = captured
    note = f"  {frame.note}" if frame.note else ""
    arrow = ">>" if frame.sent else "<<"
    return f"{exact_moment(frame.time)}  {source.name}  {arrow} {frame.data.hex(' ').upper()}{note}"


def exact_moment(time: int) -> str:
    """Nanoseconds since 1970 as ``2026-11-24T07:05:00.123456Z``."""
    seconds, rest = divmod(time, _SECOND)
    clock = datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%S")
    return f"{clock}.{rest // 1000:06}Z"


def read_text(text: str) -> Iterator[Captured]:
    """The frames of a text. Other lines that begin with ``#`` are remarks.

    Raises:
        CaptureError: if a line is no frame, or belongs to a line that was not described above it.
    """
    sources: dict[str, Source] = {}
    for number, line in enumerate(text.replace("\r\n", "\n").split("\n"), 1):
        if head := _HEAD.fullmatch(line):
            sources[head[1]] = described(head[1], head[2])
        elif line and not line.startswith("#"):
            yield _captured(line, number, sources)


def _captured(line: str, number: int, sources: dict[str, Source]) -> Captured:
    match = _FRAME.fullmatch(line)
    time = _time(match[1], match[2]) if match else None
    if match is None or time is None:
        raise CaptureError(f"line {number} is no frame: {line[:60]!r}")
    name, arrow, data, note = match.groups()[2:]
    if name not in sources:
        raise CaptureError(f"line {number}: nothing describes line {name!r}")
    return Captured(sources[name], Frame(time, arrow == ">>", bytes.fromhex(data), note or ""))


def _time(clock: str, micros: str) -> int | None:
    try:
        moment = datetime.fromisoformat(clock).replace(tzinfo=UTC)
    except ValueError:  # the 30th of February
        return None
    return round(moment.timestamp()) * _SECOND + int(micros) * 1000
