"""The last frames of a line: which bytes crossed the wire, when, and what they were. Pure.

Each frame is kept packed in one bytes object, so that many minutes of a line are a few megabytes and nothing
for the garbage collector to walk through. Keeping one is the same little work however long the line runs.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from itertools import islice
from typing import NamedTuple

FRAMES = 32_768
"""Frames that are kept at most: nine minutes of a 9600 baud line that is never idle."""
BYTES = 4 * 1024 * 1024
"""Bytes that they take at most."""
LONGEST = 600
"""Bytes after which what is being received is cut: no frame is longer, a babbler never ends."""

_HEAD = struct.Struct("<d?B")


class Traced(NamedTuple):
    """Bytes that went out (``sent``) or came in, and what they were. ``at`` is when the first bit of them
    was on the wire, in seconds of the monotonic clock."""

    at: float
    sent: bool
    data: bytes
    note: str


class Trace:
    """Bounded memory of the frames of one line. Frames have numbers, which never come again.

    Args:
        character: seconds that one character takes on the wire.
        pause: seconds of silence that part frames which nobody asked for.
        intact: tells whether bytes are a whole frame with the right check value.
    """

    def __init__(self, character: float, pause: float, intact: Callable[[bytes], bool]) -> None:
        self._character = character
        self._pause = pause
        self._intact = intact
        self._kept: deque[bytes] = deque()
        self._size = 0
        self.last = 0
        """The number of the newest frame that is kept; the first one was 1."""
        self._asked = b""
        self._note = ""
        self._sent_at = 0.0
        self._heard = b""
        self._began = self._ended = 0.0

    def sent(self, data: bytes, note: str, at: float) -> None:
        """A request goes out. It is kept once it is known what became of it."""
        if self._asked or self._heard:
            self.unanswered()
        self._asked, self._note, self._sent_at = data, note, at

    def leaves(self, at: float) -> None:
        """The request that was announced by `sent` goes out at this instant."""
        self._sent_at = at

    def received(self, data: bytes, at: float) -> None:
        """Bytes came in, the last of them at ``at``."""
        began = at - len(data) * self._character
        if not self._heard:
            self._began = began
        elif len(self._heard) + len(data) > LONGEST:
            self.unanswered("babble")
            self._began = began
        elif not self._asked and began - self._ended > self._pause:
            self.unanswered()
            self._began = began
        self._heard += data
        self._ended = at

    def answered(self, note: str, length: int) -> None:
        """The last ``length`` bytes are the reply to the request."""
        self._end("", max(0, len(self._heard) - length))
        self._began = self._ended - len(self._heard) * self._character
        self._take(len(self._heard), note)

    def unanswered(self, why: str = "") -> None:
        """Nothing more is awaited; ``why`` if a reply was due."""
        self._end(why, len(self._heard))

    def settle(self, now: float) -> None:
        """Keep what came in unasked, if it has ended."""
        if not self._asked and now - self._ended > self._pause:
            self.unanswered()

    def page(self, after: int, limit: int) -> tuple[int, list[Traced]]:
        """The oldest frames behind a number, at most ``limit``, and the number of the first of them."""
        first = self.last - len(self._kept) + 1
        skip = max(0, after + 1 - first)
        return first + skip, [_unpacked(packed) for packed in islice(self._kept, skip, skip + limit)]

    def _end(self, why: str, count: int) -> None:
        """Keep the request, and ``count`` bytes that came in and are no reply to it."""
        asked, self._asked = self._asked, b""
        if asked:
            self._keep(self._sent_at, True, f"{self._note}, {why}" if why else self._note, asked)
            if len(asked) <= count and self._heard.startswith(asked):
                self._take(len(asked), "echo")
                count -= len(asked)
        if count:
            whole = not asked or self._intact(self._heard[:count])
            self._take(count, "stray" if whole else "damaged")

    def _take(self, count: int, note: str) -> None:
        """Keep the first bytes that came in."""
        self._keep(self._began, False, note, self._heard[:count])
        self._heard = self._heard[count:]
        self._began += count * self._character

    def _keep(self, at: float, sent: bool, note: str, data: bytes) -> None:
        text = note.encode()
        packed = _HEAD.pack(at, sent, len(text)) + text + data
        self._kept.append(packed)
        self.last += 1
        self._size += len(packed)
        while len(self._kept) > FRAMES or self._size > BYTES:
            self._size -= len(self._kept.popleft())


def _unpacked(packed: bytes) -> Traced:
    at, sent, length = _HEAD.unpack_from(packed)
    data = _HEAD.size + length
    return Traced(at, sent, packed[data:], packed[_HEAD.size : data].decode())
