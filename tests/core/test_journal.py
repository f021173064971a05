"""R2: the journal's thread while its disk is full, broken or slow."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from gateway.core import journal as journal_module
from gateway.core import scribe as scribe_module
from gateway.core.chain import lines_of
from gateway.core.events import Record, Recorded
from gateway.core.journal import Journal
from gateway.core.ledger import Ledger
from tests.core.faultydisk import FaultyDisk

PATIENCE = 60.0


class Bench:
    """A journal on a disk that can fail, and what it reported."""

    def __init__(self) -> None:
        self.disk = FaultyDisk()
        self.news = threading.Condition()
        self.reports: list[Recorded] = []
        self.journal = Journal(Path("data"), self._report, Ledger(self.disk))
        self.journal.start()
        self._number = 0

    def record(self, keep: bool = True, kind: str = "test", **facts: Any) -> int:
        self._number += 1
        entry = {"kind": kind, "time": self._number, "mono": 0.0, "lived": 0.0, **facts}
        self.journal.append(Record(self._number, entry, keep))
        return self._number

    def until(self, condition: Callable[[], object]) -> None:
        with self.news:
            assert self.news.wait_for(condition, PATIENCE), self.reports

    def reported(self, number: int, well: bool) -> bool:
        return any(report.number == number and (not report.problem) is well for report in self.reports)

    def entries(self) -> list[dict[str, Any]]:
        found = []
        for name in self.disk.names():
            for line in lines_of(self.disk.read(name)):
                assert not line.problem
                assert line.entry is not None
                found.append(line.entry)
        return found

    def times(self) -> list[int]:
        return [entry["time"] for entry in self.entries() if entry["kind"] == "test"]

    def _report(self, reports: Sequence[Recorded]) -> None:
        with self.news:
            self.reports += reports
            self.news.notify_all()


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.setattr(journal_module, "RETRY_SECONDS", 0.01)
    return Bench()


def test_r2_what_is_kept_is_written_by_itself_when_the_disk_is_back_and_what_is_not_never(
    bench: Bench,
) -> None:
    bench.disk.room = 0
    stop, intent = bench.record(keep=True), bench.record(keep=False)
    bench.until(lambda: bench.reported(stop, well=False) and bench.reported(intent, well=False))
    later = bench.record(keep=True)
    bench.until(lambda: bench.reported(later, well=False))
    assert not bench.reported(stop, well=True)
    bench.disk.room = None
    bench.until(lambda: bench.reported(later, well=True))
    assert bench.times() == [stop, later]
    assert not bench.reported(intent, well=True)
    bench.journal.close()


def test_r2_a_failure_is_reported_once_for_each_entry(bench: Bench) -> None:
    tries = []
    bench.disk.fails = lambda operation: operation == "sync" and not tries.append(1)
    kept = bench.record()
    bench.until(lambda: len(tries) > 5)
    assert [report.number for report in bench.reports] == [kept]
    assert "data: sync failed" in bench.reports[0].problem
    bench.disk.fails = lambda operation: False
    bench.until(lambda: bench.reported(kept, well=True))
    bench.journal.close()


def test_r2_of_too_much_that_waits_refusals_go_first_and_it_is_told_how_many(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scribe_module, "BACKLOG", 20)
    bench.disk.room = 0
    stops = []
    for n in range(60):
        if n % 10 == 0:
            stops.append(bench.record())
            number = stops[-1]
        else:
            number = bench.record(kind="outcome", ask=n, outcome={"verdict": "refused"})
        bench.until(lambda number=number: bench.reported(number, well=False))  # type: ignore[misc]
    bench.disk.room = None
    bench.until(lambda: bench.reported(stops[-1], well=True))
    assert bench.times() == stops
    kinds = [entry["kind"] for entry in bench.entries()]
    [lost] = [entry for entry in bench.entries() if entry["kind"] == "lost"]
    assert lost["entries"] == 60 - len(stops) - kinds.count("outcome")
    bench.journal.close()


def test_r2_a_disk_that_hangs_holds_up_nobody_and_memory_is_bounded(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal_module, "BACKLOG", 20)
    hang = threading.Event()
    bench.disk.fails = lambda operation: operation == "sync" and not hang.wait(PATIENCE)
    first = bench.record()
    numbers = [bench.record(keep=False) for _ in range(100)]
    assert any(bench.reported(number, well=False) for number in numbers)
    assert bench.journal._queue.qsize() <= 20
    hang.set()
    bench.until(lambda: bench.reported(first, well=True))
    bench.journal.close()


def test_what_waits_at_the_end_is_written(bench: Bench) -> None:
    numbers = [bench.record() for _ in range(1000)]
    bench.journal.close()
    assert bench.times() == numbers
