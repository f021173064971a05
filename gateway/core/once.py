"""At most once: a command that comes twice is carried out once (safety.md H3). Pure."""

from __future__ import annotations

from collections import OrderedDict

from gateway.tag import Outcome

KEEP = 10_000
"""Ids remembered; the oldest finished ones go first."""

Key = tuple[str, str]
"""Way in and id of a command."""

Waiter = tuple[int, int]
"""Session and request number of somebody who waits for the outcome."""


class Once:
    """The ids of commands under way and done, with who waits for them and their outcomes."""

    def __init__(self) -> None:
        self._waiting: dict[Key, list[Waiter]] = {}
        self._done: OrderedDict[Key, Outcome] = OrderedDict()

    def first(self, key: Key, waiter: Waiter) -> bool:
        """True when this id was never seen; otherwise the waiter is kept for its outcome, unless
        there is one (`outcome`)."""
        if key in self._done:
            return False
        if key in self._waiting:
            self._waiting[key].append(waiter)
            return False
        self._waiting[key] = []
        return True

    def outcome(self, key: Key) -> Outcome | None:
        """The outcome of an id that is done."""
        return self._done.get(key)

    def finish(self, key: Key, outcome: Outcome) -> list[Waiter]:
        """Keep the outcome; returns the duplicates that wait for it."""
        self._done[key] = outcome
        while len(self._done) > KEEP:
            self._done.popitem(last=False)
        return self._waiting.pop(key, [])
