"""How much of the last seconds a line was in use."""

from __future__ import annotations

from collections import deque

WINDOW = 10.0
"""Seconds over which use of the line is told."""


class Record:
    """Bounded memory of one line."""

    def __init__(self) -> None:
        self._busy: deque[tuple[float, float]] = deque()
        self._since = 0.0

    def start(self, now: float) -> None:
        """The port is open from now on."""
        self._since = now
        self._busy.clear()

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
