"""What is to be written to the journal, in order, and later what cannot be written now.

`gateway.core.journal` runs it in a thread; a simulation can do so on a virtual clock.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from gateway.core.events import Record, Recorded
from gateway.core.ledger import Ledger
from gateway.core.trail import STAMPS

RETRY_SECONDS = 1.0
"""Time after which what could not be written is tried again."""

BATCH = 256
"""Entries flushed together at most."""

BACKLOG = 10_000
"""Entries that may wait; beyond that the oldest are lost, those of refused commands first."""

Report = Callable[[Sequence[Recorded]], None]
"""Called from whoever runs the scribe: what became of entries."""


@dataclass(slots=True)
class Waiting:
    """An entry to be written; ``told``: its failure was reported."""

    record: Record
    told: bool = False

    @property
    def refusal(self) -> bool:
        """It tells of a command that was refused."""
        entry = self.record.entry
        return bool(entry["kind"] == "outcome" and entry["outcome"].get("verdict") == "refused")


class Scribe:
    """Writes entries in order; one flush serves all that wait. While the disk fails, entries that somebody
    waits for are dropped, and he is told; those to be kept stay.

    Args:
        where: is named in what is told of a failure.
    """

    def __init__(self, ledger: Ledger, report: Report, where: str) -> None:
        self._ledger = ledger
        self._report = report
        self._where = where
        self.waiting: list[Waiting] = []
        self.overrun = 0
        """Entries that never came here; counted by whoever lost them, in any thread."""
        self._lost = 0
        self._told_lost = 0
        """Of both, those on record as lost."""

    def take(self, record: Record) -> None:
        """An entry is to be written."""
        self.waiting.append(Waiting(record))

    def flush(self) -> None:
        """Write all that waits, as far as that is possible."""
        while self.waiting and self._flush():
            pass

    def _flush(self) -> bool:
        """Write one batch; False when that failed."""
        batch = self.waiting[:BATCH]
        entries = [waiting.record.entry for waiting in batch]
        lost = self._lost + self.overrun
        if lost > self._told_lost:
            stamps = {name: entries[0][name] for name in STAMPS if name in entries[0]}
            entries.insert(0, {"kind": "lost", **stamps, "entries": lost - self._told_lost})
        try:
            self._ledger.write(entries)
        except OSError as error:
            self._failed(f"{self._where}: {error.strerror or error}")
            return False
        self._told_lost = lost
        del self.waiting[: len(batch)]
        self._report([Recorded(waiting.record.number) for waiting in batch])
        return True

    def _failed(self, problem: str) -> None:
        self._report([Recorded(w.record.number, problem) for w in self.waiting if not w.told])
        self.waiting = [Waiting(w.record, told=True) for w in self.waiting if w.record.keep]
        while len(self.waiting) > BACKLOG:
            self._thin()

    def _thin(self) -> None:
        """Lose the older half of the refusals, or, where there are none, the oldest tenth of all."""
        refusals = [waiting for waiting in self.waiting if waiting.refusal]
        gone = refusals[: len(refusals) // 2 + 1] if refusals else self.waiting[: BACKLOG // 10 + 1]
        self._lost += len(gone)
        ids = {id(waiting) for waiting in gone}
        self.waiting = [waiting for waiting in self.waiting if id(waiting) not in ids]
