"""What is kept of a line's past: the last frames, and how much of the last seconds the wire was in use."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

WINDOW = 10.0
"""Seconds over which use of the line is told."""
FRAMES = 500


class Traced(NamedTuple):
    """Bytes that went out (``sent``) or came in, when, and what they were."""

    at: float
    sent: bool
    data: bytes
    note: str


class Record:
    """Bounded memory of one line."""

    def __init__(self) -> None:
        self.frames: deque[Traced] = deque(maxlen=FRAMES)
        self._busy: deque[tuple[float, float]] = deque()
        self._since = 0.0

    def start(self, now: float) -> None:
        """The port is open from now on."""
        self._since = now
        self._busy.clear()

    def note(self, at: float, sent: bool, data: bytes, note: str) -> None:
        """Keep bytes that crossed the wire. What comes in piece by piece becomes one frame, which ends
        with the first piece that has a note."""
        last = self.frames[-1] if self.frames else None
        if last is not None and not (sent or last.sent or last.note):
            self.frames[-1] = Traced(at, False, last.data + data, note)
        else:
            self.frames.append(Traced(at, sent, data, note))

    def used(self, began: float, ended: float) -> None:
        """The wire belonged to one transaction from ``began`` until the next could begin."""
        self._busy.append((began, ended))
        while self._busy[0][1] < ended - WINDOW:
            self._busy.popleft()

    def utilisation(self, now: float) -> float:
        """Share of the last seconds in which the wire was in use, 0..1."""
        first = max(self._since, now - WINDOW)
        if now <= first:
            return 0.0
        busy = sum(max(0.0, min(end, now) - max(begin, first)) for begin, end in self._busy)
        return min(1.0, busy / (now - first))
