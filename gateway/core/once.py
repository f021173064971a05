"""At most once: a command that comes twice is carried out once, over restarts too (safety.md H3). Pure.

The same id with the same content is a repetition, for as long as the id is remembered, and gets the first
one's outcome; with another content it is refused. Afterwards it is another command: somebody who always gives
the same id must not get last week's answer.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from gateway.core.attempts import KEEP_UNSENT, Attempt, Attempts, forget, key
from gateway.tag import Cause, Outcome, Verdict

KEEP = 10_000
"""Ids remembered of commands for which something was sent."""

KEEP_SECONDS = 60.0
"""Seconds from its outcome on that an id is remembered: as long as a command can be meant at all, whatever
proves that it is."""

KEEP_TTLS = 10
"""And at least so many times its time to live."""

RESTARTED = Outcome(
    verdict=Verdict.UNKNOWN,
    cause=Cause.SHUTTING_DOWN,
    reason="the gateway ended after it was put on record and before its outcome was; it is not sent again",
)

Key = tuple[str, str]
"""Way in and id of a command."""

Waiter = tuple[int, int]
"""Session and request number of somebody who waits for the outcome."""


@dataclass(frozen=True, slots=True)
class UnderWay:
    """A command that has no outcome yet, and who else waits for it."""

    content: str
    waiting: list[Waiter] = field(default_factory=list)


class Once:
    """The ids of commands under way and done, with who waits for them and their outcomes."""

    def __init__(self) -> None:
        self._under_way: dict[Key, UnderWay] = {}
        self._done = Attempts()

    def restore(self, attempts: Attempts, lived: float) -> None:
        """Take up the ids of earlier runs. What has no outcome gets `RESTARTED`, now."""
        self._done = attempts
        for name in [name for name, attempt in attempts.sent.items() if attempt.outcome is None]:
            attempt = attempts.sent.pop(name)
            attempt.at, attempt.outcome = lived, RESTARTED
            attempts.sent[name] = attempt

    def used_otherwise(self, way: Key, content: str, lived: float) -> bool:
        """True if the id is remembered with something else in it. ``lived`` is now."""
        self._forget_old(way, lived)
        under_way, done = self._under_way.get(way), self._find(way)
        first = under_way.content if under_way else done.content if done else ""
        return first not in ("", content)

    def first(self, way: Key, content: str, waiter: Waiter) -> bool:
        """True when this id is not remembered; otherwise the waiter is kept for its outcome, unless
        there is one (`outcome`)."""
        if self._find(way) is not None:
            return False
        if way in self._under_way:
            self._under_way[way].waiting.append(waiter)
            return False
        self._under_way[way] = UnderWay(content)
        return True

    def outcome(self, way: Key) -> Outcome | None:
        """The outcome of an id that is done."""
        done = self._find(way)
        return done.outcome if done else None

    def _find(self, way: Key) -> Attempt | None:
        return self._done.sent.get(key(*way)) or self._done.unsent.get(key(*way))

    def _forget_old(self, way: Key, lived: float) -> None:
        for table in (self._done.sent, self._done.unsent):
            done = table.get(key(*way))
            if done is not None and _until(done) <= lived:
                del table[key(*way)]

    def room(self, lived: float) -> bool:
        """True unless another id would push one out of memory before its time. ``lived`` is now."""
        sent = self._done.sent
        while len(sent) + len(self._under_way) > KEEP:
            oldest = next(iter(sent), None)
            if oldest is None or _until(sent[oldest]) > lived:
                return False
            del sent[oldest]
        return True

    def finish(self, way: Key, outcome: Outcome, at: float, ttl: float) -> list[Waiter]:
        """Keep the outcome, which came at ``at`` (lived time), of what was to wait ``ttl`` seconds at most;
        returns the repetitions that wait for it."""
        under_way = self._under_way.pop(way)
        done = self._done.sent if outcome.sent else self._done.unsent
        done[key(*way)] = Attempt(at=at, ttl=ttl, content=under_way.content, outcome=outcome)
        forget(self._done.unsent, KEEP_UNSENT)
        return under_way.waiting


def _until(done: Attempt) -> float:
    """Until when an id has to be remembered, in lived time."""
    return done.at + max(KEEP_SECONDS, KEEP_TTLS * done.ttl)
