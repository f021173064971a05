"""One half-duplex wire in virtual time: who speaks when, what reaches the gateway, and in which pieces."""

from __future__ import annotations

import heapq
import math
import random
from collections.abc import Callable
from itertools import count

from tests.line.storm.weather import Weather

TIMER = 0.016
"""Seconds for which a USB adapter holds bytes back."""


class Clock:
    """Virtual time and what is to happen in it."""

    def __init__(self) -> None:
        self.now = 100.0
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._order = count()

    def at(self, when: float, do: Callable[[], None]) -> None:
        heapq.heappush(self._events, (max(when, self.now), next(self._order), do))

    def next(self) -> float:
        return self._events[0][0] if self._events else math.inf

    def happen(self) -> None:
        """Let the next thing happen."""
        self.now, _, do = heapq.heappop(self._events)
        do()


class Talk:
    """Bytes on the wire from ``start`` on."""

    __slots__ = ("data", "garbled", "start")

    def __init__(self, data: bytes, start: float) -> None:
        self.data = bytearray(data)
        self.start = start
        self.garbled = False


class Wire:
    """Carries bytes, each in its time. ``hear`` is what the gateway hears."""

    def __init__(
        self,
        clock: Clock,
        weather: Weather,
        character: float,
        rng: random.Random,
        hear: Callable[[bytes], None],
    ) -> None:
        self.free_at = 0.0
        """When the last byte of all that was said so far is over."""
        self._clock = clock
        self._weather = weather
        self._character = character
        self._rng = rng
        self._hear = hear
        self._talks: list[Talk] = []

    def say(self, data: bytes, done: Callable[[], None] | None = None, audible: bool = True) -> float:
        """Speak now; the end. ``done`` is called then if nobody destroyed the bytes. What is not ``audible``
        does not reach the gateway: it speaks itself, and has no echo."""
        clock = self._clock
        start = clock.now
        if not self._weather.garble and audible:
            start = max(start, self.free_at + self._rng.choice((0.0, 4.0)) * self._character)
        talk = Talk(data, start)
        end = start + len(data) * self._character
        if self._weather.garble:
            self._collide(talk, end)
        self.free_at = max(self.free_at, end)
        if audible:
            self._deliver(talk)
        if done is not None:
            clock.at(end, lambda: None if talk.garbled else done())
        return end

    def _collide(self, talk: Talk, end: float) -> None:
        self._talks = [other for other in self._talks if self._end(other) > talk.start]
        for other in self._talks:
            first, last = max(talk.start, other.start), min(end, self._end(other))
            if last > first:
                self._garble(talk, first, last)
                self._garble(other, first, last)
        self._talks.append(talk)

    def _end(self, talk: Talk) -> float:
        return talk.start + len(talk.data) * self._character

    def _garble(self, talk: Talk, first: float, last: float) -> None:
        talk.garbled = True
        low = int((first - talk.start) / self._character)
        high = math.ceil((last - talk.start) / self._character)
        for at in range(max(0, low), min(high, len(talk.data))):
            talk.data[at] ^= self._rng.randrange(1, 256)

    def _deliver(self, talk: Talk) -> None:
        cuts = self._cuts(len(talk.data))
        for low, high in zip([0, *cuts], cuts, strict=False):
            at = talk.start + high * self._character
            if self._weather.pieces == "timer":
                at = math.ceil(at / TIMER) * TIMER
            self._clock.at(at, lambda low=low, high=high: self._hear(bytes(talk.data[low:high])))

    def _cuts(self, length: int) -> list[int]:
        pieces, rng = self._weather.pieces, self._rng
        if pieces == "whole" or length < 2:
            return [length] if length else []
        if pieces == "split":
            return sorted({length, *(rng.randrange(1, length) for _ in range(rng.randrange(4)))})
        return list(range(1, length + 1))
