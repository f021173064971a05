"""How times are spread: a histogram of fixed size that forgets. Pure.

Buckets grow by a twelfth of an octave, so that a percentile is right within 3 %. Each value costs the same
few steps, and two generations of buckets keep the last `WINDOW` to twice as long.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

WINDOW = 300.0
"""Seconds that a generation lasts."""
LEAST = 1e-4
"""Seconds; shorter times count as this."""
PER_OCTAVE = 12
OCTAVES = 18
"""From 0.1 ms to 26 s."""
_BUCKETS = PER_OCTAVE * OCTAVES


class Spread:
    """The distribution of times in seconds."""

    def __init__(self) -> None:
        self._present = [0] * _BUCKETS
        self._before = [0] * _BUCKETS
        self._peaks = (0.0, 0.0)
        self._until = -math.inf

    def add(self, seconds: float, now: float) -> None:
        """One more value."""
        if now >= self._until:
            self._turn(now)
        place = int(PER_OCTAVE * math.log2(seconds / LEAST)) if seconds > LEAST else 0
        self._present[place if place < _BUCKETS else -1] += 1
        if seconds > self._peaks[0]:
            self._peaks = seconds, self._peaks[1]

    def counts(self, now: float) -> list[int]:
        """How many values there were in each bucket."""
        if now >= self._until:
            self._turn(now)
        return [one + other for one, other in zip(self._present, self._before, strict=True)]

    def peak(self, now: float) -> float:
        """The longest time; 0 while there is none."""
        if now >= self._until:
            self._turn(now)
        return max(self._peaks)

    def share(self, part: float, now: float) -> float | None:
        """As `share_of`."""
        return share_of([self], part, now)

    def _turn(self, now: float) -> None:
        """Begin a generation. The one before the last is forgotten, the last too if it ended long ago."""
        fresh = now < self._until + WINDOW
        self._before = self._present if fresh else [0] * _BUCKETS
        self._peaks = 0.0, self._peaks[0] if fresh else 0.0
        self._present = [0] * _BUCKETS
        self._until = now + WINDOW


def share_of(spreads: Sequence[Spread], part: float, now: float) -> float | None:
    """The time that this part of all values does not exceed (0.5: the median, 1: the longest); None while
    there is none."""
    counts = [sum(column) for column in zip(*(spread.counts(now) for spread in spreads), strict=True)]
    total, peak = sum(counts), max((spread.peak(now) for spread in spreads), default=0.0)
    if not total:
        return None
    rank, passed = math.ceil(part * total), 0
    for place, count in enumerate(counts):
        passed += count
        if passed >= rank and part < 1:
            return min(LEAST * math.exp2((place + 0.5) / PER_OCTAVE), peak)
    return peak
