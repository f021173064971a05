"""Which monitored items want which tag how often, summed up into demands. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple


class Item(NamedTuple):
    """One monitored item of one subscription."""

    subscription: int
    item: int


class Interest:
    """Per tag the fastest period that any item wants, and what of it the core has not been told.

    An item that is disabled is not in here.
    """

    def __init__(self) -> None:
        self._tags: dict[str, dict[Item, float]] = {}
        self._tag_of: dict[Item, str] = {}
        self._told: dict[str, float] = {}
        self._changed: set[str] = set()

    def want(self, item: Item, tag: str, period: float) -> None:
        """The item wants the tag every ``period`` seconds, whatever it wanted before."""
        self.drop(item)
        self._tags.setdefault(tag, {})[item] = period
        self._tag_of[item] = tag
        self._changed.add(tag)

    def drop(self, item: Item) -> None:
        """The item wants nothing any more. An unknown item is passed over."""
        tag = self._tag_of.pop(item, None)
        if tag is None:
            return
        del self._tags[tag][item]
        if not self._tags[tag]:
            del self._tags[tag]
        self._changed.add(tag)

    def __contains__(self, tag: str) -> bool:
        return tag in self._tags

    def period(self, tag: str) -> float | None:
        """The fastest period wanted, in seconds; None when no item wants the tag."""
        return min(self._tags[tag].values()) if tag in self._tags else None

    def take_changes(self) -> dict[str, float | None]:
        """What differs from what the core was told, which from now on counts as told."""
        changes = {tag: self.period(tag) for tag in self._changed if self.period(tag) != self._told.get(tag)}
        self._changed.clear()
        for tag, period in changes.items():
            self._tell(tag, period)
        return changes

    def give_back(self, tags: Iterable[str]) -> None:
        """The core could not be told about these after all."""
        for tag in tags:
            self._told[tag] = math.nan  # differs from everything, so that it will be told again
            self._changed.add(tag)

    def _tell(self, tag: str, period: float | None) -> None:
        if period is None:
            self._told.pop(tag, None)
        else:
            self._told[tag] = period
