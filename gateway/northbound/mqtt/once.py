"""At most once: a command that comes again (a retry, a redelivery) gets the first one's answer."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from gateway.bridge.api import DEFAULT_TTL
from gateway.tag import Outcome

REMEMBER = 12 * DEFAULT_TTL
"""Seconds that an answered command is remembered: several times the longest life of a command."""
LIMIT = 4096
"""Most answered commands remembered at a time."""
WAITING_LIMIT = 16
"""Most repetitions of one command that wait for its answer; to more than these nothing is said."""

Reply = TypeVar("Reply")


@dataclass(slots=True)
class Entry(Generic[Reply]):
    """A command that is under way or was answered."""

    content: Hashable
    """What it asks for, to tell a repetition from another command under the same id."""
    outcome: Outcome | None = None
    answered: float = 0.0
    waiting: list[Reply] = field(default_factory=list)
    """Where the answer is also wanted, by repetitions that came before it was there."""

    def wait(self, reply: Reply) -> bool:
        """Have the answer sent there too; False when too many wait already."""
        if len(self.waiting) >= WAITING_LIMIT:
            return False
        self.waiting.append(reply)
        return True


class Once(Generic[Reply]):
    """Remembers commands by a key (drive, name, sender and id). Times are monotonic seconds."""

    def __init__(self) -> None:
        self._under_way: dict[Hashable, Entry[Reply]] = {}
        self._answered: dict[Hashable, Entry[Reply]] = {}

    def find(self, key: Hashable, now: float) -> Entry[Reply] | None:
        """The command that came first under this key, if it is still remembered."""
        self._forget(now)
        return self._under_way.get(key) or self._answered.get(key)

    def begin(self, key: Hashable, content: Hashable) -> Entry[Reply]:
        """Remember a new command; until it is answered, it is never forgotten."""
        entry = self._under_way[key] = Entry(content)
        return entry

    def finish(self, key: Hashable, outcome: Outcome, now: float) -> list[Reply]:
        """Remember a command's answer; who else waits for it."""
        entry = self._under_way.pop(key)
        entry.outcome, entry.answered = outcome, now
        self._answered[key] = entry
        return entry.waiting

    def _forget(self, now: float) -> None:
        while self._answered:
            oldest = next(iter(self._answered))
            young = now - self._answered[oldest].answered < REMEMBER
            if young and len(self._answered) <= LIMIT:
                return
            del self._answered[oldest]
