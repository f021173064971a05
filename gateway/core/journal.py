"""The journal's thread: writes entries to disk in order, and what cannot be written now, later. Shell.

One flush serves all that wait. While the disk fails, entries that somebody waits for are dropped, and he is
told; those to be kept are tried again every `RETRY_SECONDS`, `BACKLOG` of them at most.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import structlog

from gateway.core.disk import Folder
from gateway.core.events import Record, Recorded
from gateway.core.ledger import Found, Ledger
from gateway.core.trail import STAMPS

log = structlog.get_logger(__name__)

RETRY_SECONDS = 1.0
BATCH = 256
"""Entries flushed together at most."""

BACKLOG = 10_000
"""Entries that may wait; beyond that the oldest are lost, those of refused commands first."""

END_SECONDS = 2.0

Report = Callable[[Sequence[Recorded]], None]
"""Called from the journal's thread: what became of entries."""


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


class Journal:
    """Appends entries in order."""

    def __init__(self, folder: Path, report: Report, ledger: Ledger | None = None) -> None:
        self._folder = folder
        self._report = report
        self._ledger = ledger or Ledger(Folder(folder))
        self._queue: queue.SimpleQueue[Record | None] = queue.SimpleQueue()
        self._waiting: list[Waiting] = []
        self._overrun = 0  # lost before they got into the queue; counted by the caller's thread
        self._lost = 0  # lost in the end
        self._told_lost = 0  # of both, those on record as lost
        self._ending = False
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)

    def start(self) -> Found:
        """Read back what was written, and begin.

        Raises:
            OSError: if the files cannot be read.
        """
        found = self._ledger.open()
        if found.broken or found.cut:
            log.warning("journal", broken=found.broken, cut=found.cut)
        self._thread.start()
        return found

    def append(self, record: Record) -> None:
        """Have an entry written; `Report` tells when it is on disk, or that it cannot be."""
        if self._queue.qsize() < BACKLOG:
            self._queue.put(record)
        elif record.keep:
            self._overrun += 1
        else:
            self._report([Recorded(record.number, "the disk does not keep up")])

    def close(self) -> None:
        """Write what waits, as far as that is possible, and end."""
        self._queue.put(None)
        self._thread.join(END_SECONDS)

    def _run(self) -> None:
        while not self._ending:
            self._take()
            while self._waiting and self._flush():
                pass
        if self._waiting:
            log.error("journal not written", entries=len(self._waiting))
        self._ledger.close()

    def _take(self) -> None:
        """Everything that was asked for; waits for something unless there is something to try again."""
        try:
            item = self._queue.get(timeout=RETRY_SECONDS if self._waiting else None)
            while item is not None:
                self._waiting.append(Waiting(item))
                item = self._queue.get_nowait()
        except queue.Empty:
            return
        self._ending = True

    def _flush(self) -> bool:
        """Write one batch; False when that failed."""
        batch = self._waiting[:BATCH]
        entries = [waiting.record.entry for waiting in batch]
        lost = self._lost + self._overrun
        if lost > self._told_lost:
            stamps = {name: entries[0][name] for name in STAMPS if name in entries[0]}
            entries.insert(0, {"kind": "lost", **stamps, "entries": lost - self._told_lost})
        try:
            self._ledger.write(entries)
        except OSError as error:
            self._failed(f"{self._folder}: {error.strerror or error}")
            return False
        self._told_lost = lost
        del self._waiting[: len(batch)]
        self._report([Recorded(waiting.record.number) for waiting in batch])
        return True

    def _failed(self, problem: str) -> None:
        self._report([Recorded(w.record.number, problem) for w in self._waiting if not w.told])
        self._waiting = [Waiting(w.record, told=True) for w in self._waiting if w.record.keep]
        while len(self._waiting) > BACKLOG:
            self._thin()

    def _thin(self) -> None:
        """Lose the older half of the refusals, or, where there are none, the oldest tenth of all."""
        refusals = [waiting for waiting in self._waiting if waiting.refusal]
        gone = refusals[: len(refusals) // 2 + 1] if refusals else self._waiting[: BACKLOG // 10 + 1]
        self._lost += len(gone)
        ids = {id(waiting) for waiting in gone}
        self._waiting = [waiting for waiting in self._waiting if id(waiting) not in ids]
