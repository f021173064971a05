"""One emulated line: when bits cross the wire, and what the drives say. Pure; time comes in."""

from __future__ import annotations

import math
from collections import deque

from benchmarks.wire.drive import Drive
from benchmarks.wire.frames import READ, Request, expected_length, parse
from benchmarks.wire.settings import LineSettings
from benchmarks.wire.tally import Tally, keep

ROUNDING = 1e-9
"""Seconds by which sums of times may differ."""


class WireLine:
    """A half-duplex line with its drives."""

    def __init__(self, settings: LineSettings) -> None:
        self.settings = settings
        self.tally = Tally()
        self._drives = {unit: Drive(unit) for unit in settings.units}
        self._free_at = -math.inf
        """When the last bit so far has crossed the wire."""
        self._begun = b""
        self._begun_at = 0.0
        self._early = False
        self._answered = ""
        self._waiting: deque[tuple[float, bytes]] = deque()

    @property
    def next_at(self) -> float:
        """When `due` has something; infinite when nothing is under way."""
        return self._waiting[0][0] if self._waiting else math.inf

    def count_anew(self) -> None:
        """Begin a new count."""
        self.tally = Tally()
        self._answered = ""

    def due(self, now: float) -> bytes:
        """The bytes that have crossed the wire towards the master by now."""
        at, data = self._waiting.popleft()
        keep(self.tally.late, now - at)
        return data

    def arrived(self, data: bytes, now: float) -> None:
        """The master handed these bytes to the wire."""
        start = max(now, self._free_at)
        if not self._begun:
            self._begins(start)
        self._free_at = start + len(data) * self.settings.character
        self._begun += data
        length = expected_length(self._begun)
        if length is None or len(self._begun) >= length:
            frame, self._begun = self._begun, b""
            self._asked(parse(frame))

    def _begins(self, start: float) -> None:
        tally = self.tally
        if self._answered:
            tally.reads[self._answered] = tally.reads.get(self._answered, 0) + 1
            self._answered = ""
        tally.first = start if tally.first is None else tally.first
        tally.last = self._begun_at = start
        tally.requests += 1
        after = start - self._free_at - self.settings.silence
        self._early = after < -ROUNDING
        tally.violations += self._early
        if math.isfinite(after):
            keep(tally.idle, after)

    def _asked(self, request: Request | None) -> None:
        if request is None:
            self.tally.damaged += 1
            return
        if request.words is not None:
            self.tally.writes.append((self._begun_at, request.unit, request.address, request.words))
        drive = self._drives.get(request.unit)
        if drive is None or request.unit in self.settings.silent or (self._early and self.settings.strict):
            self.tally.unanswered += 1
            return
        self._answer(request, drive.reply(request))

    def _answer(self, request: Request, reply: bytes) -> None:
        settings = self.settings
        start = self._free_at + settings.turnaround
        self._free_at = start + len(reply) * settings.character
        size = settings.pieces or len(reply)
        for at in range(0, len(reply), size):
            piece = reply[at : at + size]
            crossed = start + (at + len(piece)) * settings.character
            self._waiting.append((crossed + settings.hold, piece))
        if reply[1] != request.function:
            self.tally.refused += 1
        elif request.function == READ:
            self._answered = f"{request.unit},{request.address},{request.count}"
