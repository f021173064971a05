"""The journal in the box: the real ledger on a disk that fails, tears, fills and hangs, in virtual time."""

from __future__ import annotations

import contextlib
import random
from collections.abc import Callable, Sequence
from typing import Any

from gateway.core.chain import lines_of
from gateway.core.events import Record, Recorded
from gateway.core.ledger import Found, Ledger
from gateway.core.scribe import BACKLOG, RETRY_SECONDS, Scribe
from tests.core.faultydisk import FaultyDisk
from tests.line.storm.wire import Clock

ROTATE = 64 * 1024
LATER = 0.0002
"""Seconds from a flush to the moment at which the core hears of it: a crash may come between."""


class Safe:
    """The disk of one gateway, through all its lives."""

    def __init__(self, clock: Clock, delay: float, rng: random.Random, count: Callable[[str], None]) -> None:
        self.disk = FaultyDisk()
        self.share = 0.0
        """Share of the operations that fail."""
        self.hangs_until = 0.0
        self._clock = clock
        self._delay = delay
        self._rng = rng
        self._count = count
        self._life = 0
        self.disk.fails = self._fails

    def start(self, tell: Callable[[Sequence[Recorded]], None]) -> Found:
        """Open what is there; ``tell`` hears what became of entries.

        Raises:
            OSError: if it cannot be read.
        """
        self._life += 1
        self._tell = tell
        self._ledger = Ledger(self.disk, rotate=ROTATE, keep=10_000)
        found = self._ledger.open()
        self.broken = found.broken
        self._queue: list[Record] = []
        self._scribe = Scribe(self._ledger, self._report, "data")
        self._due = False
        return found

    def append(self, record: Record) -> None:
        """The core has an entry written."""
        assert len(self._queue) < BACKLOG
        self._queue.append(record)
        self._plan(self._delay * self._rng.uniform(0.5, 3.0))

    def crash(self, power: bool) -> None:
        """The process dies; with ``power`` the machine too, and what was not synced is lost in part."""
        self._life += 1
        if self._queue:
            self._tear()
        if not power:
            return
        rng = self._rng
        before = self.disk
        self.disk = before.crash(
            lambda count: rng.randint(0, count), rng.random() < 0.3, lambda name: rng.random() < 0.5
        )
        self.disk.fails = self._fails
        self.disk.room = before.room

    def _tear(self) -> None:
        """What was being written when the process died is there, or half of it, or nothing."""
        stopped = self._rng.choice(("none", "open", "append", "sync", "in place"))
        self.disk.fails = lambda operation: operation == stopped
        with contextlib.suppress(OSError):
            self._ledger.write([record.entry for record in self._queue])
        self.disk.fails = self._fails
        self._count(f"disk: torn at {stopped}")

    def entries(self) -> list[dict[str, Any]]:
        """All entries that can be read back, whatever failed before."""
        files = self.disk.files.values()
        entries = (line.entry for content in files for line in lines_of(bytes(content.now)))
        return [entry for entry in entries if entry is not None]

    def heal(self) -> None:
        """No more faults."""
        self.share, self.hangs_until, self.disk.room = 0.0, 0.0, None

    def _fails(self, operation: str) -> bool:
        if not self.share or self._rng.random() >= self.share:
            return False
        self._count(f"disk: {operation} failed")
        return True

    def _plan(self, seconds: float) -> None:
        if not self._due:
            self._due = True
            life = self._life
            self._clock.at(self._clock.now + seconds, lambda: self._flush(life))

    def _flush(self, life: int) -> None:
        if life != self._life:
            return
        self._due = False
        if self._clock.now < self.hangs_until:
            self._plan(self.hangs_until - self._clock.now)
            return
        for record in self._queue:
            self._scribe.take(record)
        self._queue.clear()
        self._scribe.flush()
        if self._scribe.waiting:
            self._plan(RETRY_SECONDS)

    def _report(self, events: Sequence[Recorded]) -> None:
        life = self._life

        def tell() -> None:
            if life == self._life:
                self._tell(events)

        self._clock.at(self._clock.now + LATER, tell)
