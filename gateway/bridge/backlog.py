"""What waits for a watcher. Pure.

A watcher that keeps up gets every batch as it was read. For one that falls behind, batches are folded
into the latest sample of each tag, so that the memory it takes is bounded by what it watches and it
can never hold up anybody else.
"""

from __future__ import annotations

from collections import deque

from gateway.bridge.api import Batch, ControlState, DriveState, Happened, Periods, Replaced, Update
from gateway.tag import Sample

MAX_BATCHES = 64
"""Batches kept apart before they are folded."""

MAX_EVENTS = 256
"""Events kept; beyond that the oldest are dropped."""


class Backlog:
    """Updates that wait for one watcher, bounded."""

    def __init__(self) -> None:
        self._batches: deque[Batch] = deque()
        self._drives: dict[str, DriveState] = {}
        self._controls: dict[str, ControlState] = {}
        self._periods: dict[str, float] = {}
        self._events: deque[Happened] = deque(maxlen=MAX_EVENTS)
        self._replaced: Replaced | None = None

    def put(self, update: Update) -> None:
        """Add an update, folding older ones when there are too many."""
        match update:
            case Batch():
                self._batches.append(update)
                if len(self._batches) > MAX_BATCHES:
                    self._batches = deque([_fold(self._batches)])
            case DriveState():
                self._drives[update.drive] = update
            case ControlState():
                self._controls[update.drive] = update
            case Periods():
                self._periods.update(update.periods)
            case Happened():
                self._events.append(update)
            case Replaced():
                self._replaced = update

    def take(self) -> Update | None:
        """Remove and return what should be told next, None when nothing waits.

        Drive states come before samples, so that nobody hears of a value from a drive that he holds
        to be away.
        """
        if self._replaced is not None:
            replaced, self._replaced = self._replaced, None
            return replaced
        if self._drives:
            return self._drives.pop(next(iter(self._drives)))
        if self._controls:
            return self._controls.pop(next(iter(self._controls)))
        if self._periods:
            periods, self._periods = self._periods, {}
            return Periods(periods)
        if self._events:
            return self._events.popleft()
        return self._batches.popleft() if self._batches else None


def _fold(batches: deque[Batch]) -> Batch:
    """One batch with the latest sample of each tag, in the order of those samples."""
    latest: dict[str, Sample] = {}
    count = skipped = 0
    for batch in batches:
        skipped += batch.skipped
        for sample in batch.samples:
            count += 1
            latest.pop(sample.tag, None)
            latest[sample.tag] = sample
    return Batch(batches[-1].seq, tuple(latest.values()), skipped + count - len(latest))
