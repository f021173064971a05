"""Which faults a storm is made of: each seed draws its own mixture."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import dataclass, replace
from typing import Literal

Kind = Literal["queue", "drop", "overlap"]
KINDS: tuple[Kind, ...] = ("queue", "drop", "overlap")
FLIPS = 3
"""Bits that a damaged frame has wrong at most. A CRC of 16 bits finds all of them; what is worse passes it
once in 65,536 times, whoever listens."""


@dataclass(frozen=True, kw_only=True)
class Weather:
    """Shares are of all frames (0..1), rates are per second."""

    kind: Kind = "queue"
    """Drives answer one after the other, hear nothing while busy, or answer each request in its own time."""
    late: float = 0.0
    late_most: float = 1.0
    """Seconds that a late answer comes too late at most."""
    damage: float = 0.0
    lost_byte: float = 0.0
    doubled_byte: float = 0.0
    lost_frame: float = 0.0
    noise: float = 0.0
    """Bytes of nobody before or behind a reply."""
    wrong_unit: float = 0.0
    refused: float = 0.0
    strangers: float = 0.0
    """A foreign master asks a unit of its own, which answers."""
    rivals: float = 0.0
    """A foreign master asks one of our units for other registers of the same number."""
    twins: float = 0.0
    """A foreign master asks just what we asked last."""
    hang_ups: float = 0.0
    """The port vanishes and comes back; what was asked before may still be answered."""
    echo: Literal["none", "declared", "noticed"] = "none"
    garble: bool = True
    """Two who talk at once destroy each other's bytes; else something between them lets them talk in turn."""
    pieces: Literal["whole", "bytes", "split", "timer"] = "whole"
    """How bytes reach us: as frames, one by one, cut anywhere, or when a timer of 16 ms runs out."""


def draw(rng: random.Random, timeout: float, framing: str) -> Weather:
    """A mixture in which each fault is there or not; answers are up to five time-outs late."""

    def some(*shares: float) -> float:
        return rng.choice((0.0, *shares))

    weather = Weather(
        kind=rng.choice(KINDS),
        late=some(0.01, 0.05),
        late_most=timeout * rng.choice((0.1, 0.5, 2.0, 5.0)),
        damage=some(0.01, 0.05),
        lost_byte=some(0.01, 0.03),
        doubled_byte=some(0.01, 0.03),
        lost_frame=some(0.01),
        noise=some(0.02),
        wrong_unit=some(0.01),
        refused=some(0.01),
        strangers=some(0.5, 3.0),
        rivals=some(0.0, 0.3),
        twins=some(0.0, 0.3),
        echo=rng.choice(("none", "none", "declared", "noticed")),
        garble=rng.random() < 0.5,
        pieces=rng.choice(("whole", "whole", "split", "split", "timer", "bytes")),
        hang_ups=some(0.0, 0.01),
    )
    if framing == "ascii" and weather.lost_byte:
        return replace(weather, doubled_byte=0.0)  # together they pass an LRC once in 256 times
    if framing == "tcp":
        return replace(weather, **dict.fromkeys(OFF_THE_NET, 0.0), echo="none", garble=False)
    return weather


OFF_THE_NET = (
    "damage",
    "lost_byte",
    "doubled_byte",
    "noise",
    "wrong_unit",
    "strangers",
    "rivals",
    "twins",
)
"""What cannot happen on a connection that loses nothing and is ours alone."""


class Faults:
    """Does to frames what the weather says, and counts it."""

    def __init__(self, weather: Weather, rng: random.Random, flips: int = FLIPS) -> None:
        self.weather = weather
        self._flips = flips
        self.counts: Counter[str] = Counter()
        self._rng = rng

    def strikes(self, name: str) -> bool:
        """True when the fault of that name is to happen now."""
        share: float = getattr(self.weather, name)
        if not share or self._rng.random() >= share:
            return False
        self.counts[name] += 1
        return True

    def lateness(self) -> float:
        """Seconds that an answer comes too late: often just so, sometimes by very much."""
        if not self.strikes("late"):
            return 0.0
        most = self.weather.late_most
        return self._rng.uniform(0.0, self._rng.choice((most, min(most, 0.2))))

    def carried(self, data: bytes) -> bytes:
        """What arrives of a frame; nothing when it is lost."""
        rng = self._rng
        if self.strikes("lost_frame"):
            return b""
        if self.strikes("damage"):
            data = _flipped(data, rng, self._flips)
        if self.strikes("lost_byte"):
            at = rng.randrange(len(data))
            data = data[:at] + data[at + 1 :]
        if self.strikes("doubled_byte"):
            at = rng.randrange(len(data))
            data = data[: at + 1] + data[at:]
        return data

    def noisy(self, data: bytes) -> bytes:
        """A frame with bytes of nobody before or behind it."""
        if not self.strikes("noise"):
            return data
        noise = self._rng.randbytes(self._rng.randint(1, 12))
        return noise + data if self._rng.random() < 0.5 else data + noise


def _flipped(data: bytes, rng: random.Random, most: int) -> bytes:
    damaged = bytearray(data)
    for bit in rng.sample(range(8 * len(data)), rng.randint(1, most)):
        damaged[bit // 8] ^= 1 << bit % 8
    return bytes(damaged)
