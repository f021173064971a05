"""The core's side of the journal: what goes on record is stamped here. Pure.

An entry is plain JSON data with a ``kind``. Stamped onto it are ``time`` (wall, nanoseconds), ``mono``
(monotonic, seconds), ``lived`` (`gateway.core.runs`) and ``boot``, the id of this start of the gateway.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from gateway.bridge.api import Catalogue
from gateway.core.events import Record, Started
from gateway.core.runs import NANO, Boot
from gateway.tag import Instant

Facts = Mapping[str, Any]

Follower = Callable[[Facts, Instant], None]
"""Is told of an entry as it goes on record, and when."""

STAMPS = ("time", "mono", "lived", "boot")
"""What each entry has beside its ``kind`` and what that tells."""

JUMP_SECONDS = 1.0
"""A change of the wall clock by more than this is put on record (safety.md H22)."""

HANGING = 5.0
"""Seconds after which a disk that does not answer counts as one that cannot be written."""


class Trail:
    """Numbers and stamps entries. ``act`` takes the action that has one written."""

    def __init__(self, act: Callable[[Record], None]) -> None:
        self.problem = ""
        """Why the journal cannot be written; "" if it can."""
        self._act = act
        self._boot = Boot()
        self._lived = 0.0
        self._now = Instant(0.0, 0)
        self._last = 0
        self._followers: list[Follower] = []
        self._unanswered: deque[tuple[int, float]] = deque()
        """Entries of which nothing was heard yet, and when they were recorded (monotonic)."""

    def follow(self, follower: Follower) -> None:
        """Tell somebody of every entry."""
        self._followers.append(follower)

    def start(self, started: Started, catalogue: Catalogue) -> None:
        """Put this start of the gateway on record, and the configuration that is in force."""
        self._boot = started.boot
        self._lived = started.memory.runs.lived_until(started.boot, self._now) - self._now.mono
        self.record(
            {
                "kind": "boot",
                "machine": started.boot.machine,
                "run": started.memory.runs.count + 1,
                "ended": started.memory.runs.ended,
                "broken": started.broken,
                "cut": started.cut,
                "site": catalogue.site,
                "gateway": catalogue.gateway,
                "version": catalogue.version,
                "configuration": catalogue.digest,
                "writes": catalogue.writes_enabled,
            }
        )

    def end(self) -> None:
        """Put on record that the gateway ends in good order."""
        self.record({"kind": "end"})

    def moment(self, now: Instant) -> None:
        """The present moment. H22: a wall clock that was set is put on record."""
        before, self._now = self._now, now
        jump = (now.wall - before.wall) * NANO - (now.mono - before.mono)
        if abs(jump) > JUMP_SECONDS and before.wall:
            self.record({"kind": "clock", "jump": round(jump, 3), "before": before.wall})

    @property
    def lived(self) -> float:
        """The lived time now, in seconds."""
        return self._lived + self._now.mono

    def recorded(self, number: int, problem: str) -> None:
        """An entry is on disk, or could not be written."""
        while self._unanswered and self._unanswered[0][0] <= number:
            self._unanswered.popleft()
        self.problem = problem

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        return self._unanswered[0][1] + HANGING if self._unanswered and not self.problem else None

    def tick(self) -> bool:
        """R2: a disk that does not answer is as bad as one that says no. True when that is found."""
        wake = self.wake()
        if wake is None or wake > self._now.mono:
            return False
        self.problem = f"the disk has not answered for {HANGING:g} s"
        return True

    def record(self, entry: Facts, keep: bool = True) -> int:
        """Have an entry written; the number that `Recorded` will name. One that is to be kept is written
        later if it cannot be now; another is dropped then, and whoever waits for it is told."""
        self._last += 1
        stamped = {
            "kind": entry["kind"],
            "time": self._now.wall,
            "mono": round(self._now.mono, 6),
            "lived": round(self.lived, 3),
            "boot": self._boot.id,
        }
        number, whole = self._last, stamped | msgspec.to_builtins(entry, str_keys=True)
        self._unanswered.append((number, self._now.mono))
        self._act(Record(number, whole, keep))
        for follower in self._followers:
            follower(whole, self._now)
        return number
