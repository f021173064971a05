"""Whose turn it is to write to a drive. Pure.

One procedure at a time writes to a drive; the others wait in its lane. A command to several drives waits in
the lanes of all of them, and has its turn when it is first in each. Since it enters all of them at once, no
two can wait for each other.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator


class Lanes:
    """All lanes, by name of the drive. Procedures are known by their numbers."""

    def __init__(self) -> None:
        self._lanes: dict[str, deque[int]] = {}
        self._of: dict[int, tuple[str, ...]] = {}

    def enter(self, number: int, drives: Iterable[str]) -> bool:
        """Wait for these drives; True when it is its turn already."""
        self._of[number] = tuple(drives)
        for name in self._of[number]:
            self._lanes.setdefault(name, deque()).append(number)
        return self._is_first(number)

    def leave(self, number: int) -> list[int]:
        """Let others in, if it was in a lane: those whose turn it is now."""
        heads = []
        for name in self._of.pop(number, ()):
            lane = self._lanes[name]
            was_first = lane[0] == number
            lane.remove(number)
            if was_first and lane:
                heads.append(lane[0])
        return [head for head in dict.fromkeys(heads) if self._is_first(head)]

    def beside(self, number: int) -> Iterator[int]:
        """The others in the same lanes."""
        found = {other for name in self._of.get(number, ()) for other in self._lanes[name]}
        return (other for other in found if other != number)

    def _is_first(self, number: int) -> bool:
        return all(self._lanes[name][0] == number for name in self._of[number])
