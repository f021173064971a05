"""Writes at random times, and when a client asked for each. Every value is sent once, so that the wire shows
which ask it belongs to."""

from __future__ import annotations

import asyncio
import random
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

COUNTS = 4000
"""Raw values of a setpoint that are used: 0.01 Hz to 40.00 Hz."""

Ask = Callable[[str, float], Awaitable[str]]
"""Writes a value (Hz) to a drive and returns what became of it."""


@dataclass(frozen=True, slots=True)
class Asked:
    """An ask: when (monotonic seconds), the raw value, and what became of it."""

    at: float
    raw: int
    outcome: str


async def ask_at_random(ask: Ask, drives: list[str], first: int, number: int, mean: float) -> list[Asked]:
    """Ask so often, one after another: some time after each answer, exponential with this mean (seconds),
    comes the next ask; raw values count up from ``first``."""
    chance = random.Random(first)
    found = []
    for raw in range(first, first + number):
        await asyncio.sleep(chance.expovariate(1 / mean))
        found.append(await _timed(ask, chance.choice(drives), raw))
    return found


async def _timed(ask: Ask, drive: str, raw: int) -> Asked:
    at = time.monotonic()
    return Asked(at, raw, await ask(drive, raw / 100))
