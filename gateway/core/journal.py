"""The journal's thread: has entries written to disk. Shell."""

from __future__ import annotations

import queue
import threading
from pathlib import Path

import structlog

from gateway.core.disk import Folder
from gateway.core.events import Record, Recorded
from gateway.core.ledger import Found, Ledger
from gateway.core.scribe import BACKLOG, RETRY_SECONDS, Report, Scribe

log = structlog.get_logger(__name__)

END_SECONDS = 2.0


class Journal:
    """Appends entries in order. ``report`` is called from its thread."""

    def __init__(self, folder: Path, report: Report, ledger: Ledger | None = None) -> None:
        self._report = report
        self._ledger = ledger or Ledger(Folder(folder))
        self._scribe = Scribe(self._ledger, report, str(folder))
        self._queue: queue.SimpleQueue[Record | None] = queue.SimpleQueue()
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
            self._scribe.overrun += 1
        else:
            self._report([Recorded(record.number, "the disk does not keep up")])

    def close(self) -> None:
        """Write what waits, as far as that is possible, and end."""
        self._queue.put(None)
        self._thread.join(END_SECONDS)

    def _run(self) -> None:
        while not self._ending:
            self._take()
            self._scribe.flush()
        if self._scribe.waiting:
            log.error("journal not written", entries=len(self._scribe.waiting))
        self._ledger.close()

    def _take(self) -> None:
        """Everything that was asked for; waits for something unless there is something to try again."""
        try:
            item = self._queue.get(timeout=RETRY_SECONDS if self._scribe.waiting else None)
            while item is not None:
                self._scribe.take(item)
                item = self._queue.get_nowait()
        except queue.Empty:
            return
        self._ending = True
