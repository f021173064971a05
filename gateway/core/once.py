"""At most once: a command that comes twice is carried out once, over restarts too (safety.md H3). Pure."""

from __future__ import annotations

from gateway.core.attempts import KEEP_UNSENT, Attempt, Attempts, forget, key
from gateway.tag import Cause, Outcome, Verdict

KEEP = 10_000
"""Ids remembered of commands for which something was sent."""

KEEP_TTLS = 10
"""An id for which something was sent is remembered at least so many times its time to live."""

RESTARTED = Outcome(
    verdict=Verdict.UNKNOWN,
    cause=Cause.SHUTTING_DOWN,
    reason="the gateway ended after it was put on record and before its outcome was; it is not sent again",
)

Key = tuple[str, str]
"""Way in and id of a command."""

Waiter = tuple[int, int]
"""Session and request number of somebody who waits for the outcome."""


class Once:
    """The ids of commands under way and done, with who waits for them and their outcomes."""

    def __init__(self) -> None:
        self._waiting: dict[Key, list[Waiter]] = {}
        self._done = Attempts()

    def restore(self, attempts: Attempts) -> None:
        """Take up the ids of earlier runs. What has no outcome gets `RESTARTED`."""
        self._done = attempts
        for attempt in attempts.sent.values():
            attempt.outcome = attempt.outcome or RESTARTED

    def first(self, key: Key, waiter: Waiter) -> bool:
        """True when this id was never seen; otherwise the waiter is kept for its outcome, unless
        there is one (`outcome`)."""
        if self.outcome(key) is not None:
            return False
        if key in self._waiting:
            self._waiting[key].append(waiter)
            return False
        self._waiting[key] = []
        return True

    def outcome(self, way: Key) -> Outcome | None:
        """The outcome of an id that is done."""
        done = self._done.sent.get(key(*way)) or self._done.unsent.get(key(*way))
        return done.outcome if done else None

    def room(self, lived: float) -> bool:
        """True unless another id would push one out of memory before its time. ``lived`` is now."""
        sent = self._done.sent
        while len(sent) + len(self._waiting) > KEEP:
            oldest = next(iter(sent), None)
            if oldest is None or sent[oldest].at + KEEP_TTLS * sent[oldest].ttl > lived:
                return False
            del sent[oldest]
        return True

    def finish(self, way: Key, outcome: Outcome, at: float, ttl: float) -> list[Waiter]:
        """Keep the outcome of what was given at ``at`` (lived time), to wait ``ttl`` seconds at most; returns
        the duplicates that wait for it."""
        done = self._done.sent if outcome.sent else self._done.unsent
        done[key(*way)] = Attempt(at=at, ttl=ttl, outcome=outcome)
        forget(self._done.unsent, KEEP_UNSENT)
        return self._waiting.pop(way, [])
