"""What is counted of a line and of each of its units. Pure.

Counters run since the core was started; distributions tell of the last minutes. Everything is of fixed size,
and a transaction costs the same few steps whatever was before it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from gateway.line.doctor.histogram import Spread

SMOOTH = 16
"""Jitter is smoothed over about so many replies, as RFC 3550 does it."""
WINDOW = 300.0
"""Seconds after which the worst age of a value is forgotten, at the latest after twice as long."""


class Worst:
    """The greatest of the last values."""

    def __init__(self) -> None:
        self._present = self._before = 0.0
        self._until = -math.inf

    def add(self, value: float, now: float) -> None:
        """One more value."""
        if now >= self._until:
            self._before = self._present if now < self._until + WINDOW else 0.0
            self._present, self._until = 0.0, now + WINDOW
        if value > self._present:
            self._present = value

    def get(self, now: float) -> float | None:
        """The greatest; None while there is none."""
        if now >= self._until:
            self.add(0.0, now)
        return max(self._present, self._before) or None


@dataclass(slots=True)
class Traffic:
    """Counters since start. ``timeouts`` are requests to which nothing came back, ``damaged`` those to which
    nothing valid did; ``retries`` requests after one of these, until the unit answers again."""

    requests: int = 0
    answered: int = 0
    refused: int = 0
    timeouts: int = 0
    damaged: int = 0
    retries: int = 0
    probes: int = 0
    sent_bytes: int = 0
    received_bytes: int = 0
    early: int = 0
    """Replies that began before the silence behind the request was over."""


@dataclass(slots=True)
class UnitFigures:
    """One unit. ``jitter`` is how much one reply's turnaround differs from the next one's, smoothed, in
    seconds. ``age`` and ``share`` are the oldest that a value of a planned read got: in seconds, and as a
    part of what was promised (above 1: the promise was broken)."""

    traffic: Traffic = field(default_factory=Traffic)
    codes: dict[int, int] = field(default_factory=dict)
    """Exception replies, by code."""
    turnaround: Spread = field(default_factory=Spread)
    jitter: float = 0.0
    age: Worst = field(default_factory=Worst)
    share: Worst = field(default_factory=Worst)
    failing: bool = False
    _last: float = math.nan

    def began(self, size: int, probe: bool) -> None:
        """A request of so many bytes went out."""
        traffic = self.traffic
        traffic.requests += 1
        traffic.sent_bytes += size
        if probe:
            traffic.probes += 1
        elif self.failing:
            traffic.retries += 1

    def replied(self, code: int | None, turnaround: float, size: int, now: float) -> None:
        """A reply of so many bytes came, an exception if it has a ``code``."""
        traffic = self.traffic
        traffic.received_bytes += size
        if code is None:
            traffic.answered += 1
        else:
            traffic.refused += 1
            self.codes[code] = self.codes.get(code, 0) + 1
        self.failing = False
        self.turnaround.add(turnaround, now)
        if self._last == self._last:  # not the first one
            self.jitter += (abs(turnaround - self._last) - self.jitter) / SMOOTH
        self._last = turnaround

    def missed(self, size: int) -> None:
        """Nothing valid came back; ``size`` bytes did."""
        self.failing = True
        self.traffic.received_bytes += size
        if size:
            self.traffic.damaged += 1
        else:
            self.traffic.timeouts += 1

    def aged(self, seconds: float, promised: float, now: float) -> None:
        """A value was so old when it was read anew."""
        self.age.add(seconds, now)
        self.share.add(seconds / promised, now)


@dataclass(slots=True)
class LineFigures:
    """The line as a whole: what no unit can be blamed for. ``strays`` are bytes that nobody asked for;
    ``violations`` requests of ours that went out before the silence was over, ``intrusions`` strays that
    did."""

    sent: int = 0
    """Bytes that we sent, broadcasts included."""
    strays: int = 0
    violations: int = 0
    intrusions: int = 0
