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
"""Most commands remembered at a time; then the oldest answered one goes."""
WAITING_LIMIT = 16
"""Most repetitions of one command that wait for its answer."""

Reply = TypeVar("Reply")


@dataclass(slots=True)
class Entry(Generic[Reply]):
    """A command that is under way or was answered."""

    content: Hashable
    """What it asks for, to tell a repetition from another command under the same id."""
    began: float
    outcome: Outcome | None = None
    waiting: list[Reply] = field(default_factory=list)
    """Where the answer is also wanted, by repetitions that came before it was there."""

    def wait(self, reply: Reply) -> bool:
        """Have the answer sent there too; False when too many wait already."""
        if len(self.waiting) >= WAITING_LIMIT:
            return False
        self.waiting.append(reply)
        return True


class Once(Generic[Reply]):
    """Remembers commands by a key (drive, name and id), in the order of their coming."""

    def __init__(self) -> None:
        self._entries: dict[Hashable, Entry[Reply]] = {}

    def find(self, key: Hashable, now: float) -> Entry[Reply] | None:
        """The command that came first under this key, if it is still remembered."""
        self._forget(now)
        return self._entries.get(key)

    def begin(self, key: Hashable, content: Hashable, now: float) -> Entry[Reply]:
        """Remember a new command."""
        entry = self._entries[key] = Entry(content, now)
        return entry

    def _forget(self, now: float) -> None:
        """Drop answered commands that are old, or are too many. Those under way always stay."""
        for key, entry in list(self._entries.items()):
            young = now - entry.began < REMEMBER
            if entry.outcome is None:
                continue
            if young and len(self._entries) < LIMIT:
                return
            del self._entries[key]
