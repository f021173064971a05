"""The journal: one line of JSON per attempt, flushed to disk by a thread of its own. Shell.

``journal.jsonl`` in the data folder; at `ROTATE_BYTES` it becomes ``journal-<time>.jsonl`` and the
oldest of those are removed beyond `KEEP_FILES`.
"""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import msgspec

ROTATE_BYTES = 16 * 1024 * 1024
KEEP_FILES = 20

Report = Callable[[int, str], None]
"""Called from the journal's thread: number of an entry, and the problem ("": it is on disk)."""


class Journal:
    """Appends entries in order; one flush serves all that wait."""

    def __init__(self, folder: Path, report: Report) -> None:
        self._path = folder / "journal.jsonl"
        self._report = report
        self._queue: queue.SimpleQueue[tuple[int, dict[str, Any]] | None] = queue.SimpleQueue()
        self._file: IO[bytes] | None = None
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def append(self, number: int, entry: dict[str, Any]) -> None:
        """Have an entry written; `Report` tells when it is on disk."""
        self._queue.put((number, entry))

    def close(self) -> None:
        """Write what waits and end."""
        self._queue.put(None)
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        while True:
            batch, last = self._take()
            problem = self._write(batch)
            for number, _ in batch:
                self._report(number, problem)
            if last:
                break
        if self._file is not None:
            self._file.close()

    def _take(self) -> tuple[list[tuple[int, dict[str, Any]]], bool]:
        """Everything that waits; True with the end."""
        batch = []
        item = self._queue.get()
        while item is not None:
            batch.append(item)
            try:
                item = self._queue.get_nowait()
            except queue.Empty:
                return batch, False
        return batch, True

    def _write(self, batch: list[tuple[int, dict[str, Any]]]) -> str:
        if not batch:
            return ""
        lines = b"".join(msgspec.json.encode(entry, order="sorted") + b"\n" for _, entry in batch)
        try:
            file = self._open()
            file.write(lines)
            file.flush()
            os.fdatasync(file.fileno())
        except OSError as error:
            self._file = None
            return f"{self._path}: {error.strerror}"
        return ""

    def _open(self) -> IO[bytes]:
        if self._file is not None and self._file.tell() > ROTATE_BYTES:
            self._file.close()
            self._path.rename(self._path.with_name(f"journal-{time.time_ns()}.jsonl"))
            for old in sorted(self._path.parent.glob("journal-*.jsonl"))[:-KEEP_FILES]:
                old.unlink()
            self._file = None
        if self._file is None:
            self._file = self._path.open("ab")
        return self._file
