"""Which watched samples may have grown older than promised. Pure.

A read of the plan brings many tags, and while it comes in time none of them can be old: only the tags of
reads that are late need a look.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field

from gateway.core.store import STALE_PERIODS

Key = tuple[str, int, int]
"""A read: drive, address, count."""


@dataclass(slots=True)
class Group:
    """Tags that one read brings every ``period`` seconds; none of them was read before ``at`` (monotonic)."""

    period: float
    at: float
    tags: list[str] = field(default_factory=list)


class Ages:
    """The reads of all plans, and when each came last."""

    def __init__(self) -> None:
        self._groups: dict[Key, Group] = {}

    def plan(self, drive: str, groups: dict[tuple[int, int], Group]) -> None:
        """Take over the reads of a drive, by address and count, in place of those before."""
        for key in [key for key in self._groups if key[0] == drive]:
            del self._groups[key]
        self._groups.update({(drive, address, count): group for (address, count), group in groups.items()})

    def came(self, drive: str, address: int, count: int, at: float) -> None:
        """A read came in: all its tags are as new as it is, or newer. It may itself be older than what was
        told meanwhile: a reply in doubt is as old as the first like it."""
        group = self._groups.get((drive, address, count))
        if group is not None:
            group.at = at

    def older(self, tags: Collection[str], at: float) -> None:
        """These tags hold what is known since an earlier instant, by whatever read."""
        for group in self._groups.values():
            if group.at > at and not set(group.tags).isdisjoint(tags):
                group.at = at

    def late(self, now: float) -> Iterator[str]:
        """The tags of all reads that are late."""
        for group in self._groups.values():
            if now - group.at > STALE_PERIODS * group.period:
                yield from group.tags
