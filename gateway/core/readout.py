"""Registers to values: the points of a block, each with what it held last. Pure.

Most registers of a drive are the same as a moment ago. A point that always means the same is decoded anew
only when its words have changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from gateway.core.drive import Drive
from gateway.core.meaning import Meaningless, is_fixed, meaning_of
from gateway.core.store import Store
from gateway.mapping.profile import Point
from gateway.modbus.encoding import decode
from gateway.tag import Quality, Value


class Reading(NamedTuple):
    """What words say: the part of a sample that needs no time. ``text`` as in `gateway.tag.Sample`."""

    value: Value
    quality: Quality
    text: str | None = None
    reason: str = ""


def reading_of(drive: Drive, store: Store, point: Point, words: Sequence[int]) -> Reading:
    """What a point's words say at present."""
    meaning = meaning_of(drive, store, point)
    if isinstance(meaning, Meaningless):
        return Reading(None, meaning.quality, None, meaning.reason)
    decoded = decode(meaning.encoding, words, meaning.times)
    if decoded.special is not None or decoded.value is None:
        return Reading(None, Quality.INVALID, decoded.special, decoded.special or "cannot be decoded")
    return Reading(decoded.value, Quality.GOOD, decoded.text)


@dataclass(slots=True)
class Slot:
    """A point in a block: its words begin at ``start`` and end before ``end``, counted from the block."""

    point: Point
    tag: str
    start: int
    end: int
    fixed: bool
    words: tuple[int, ...] = ()
    reading: Reading | None = None


class Readout:
    """The blocks of one drive."""

    def __init__(self, drive: Drive, store: Store) -> None:
        self._drive = drive
        self._store = store
        self._blocks: dict[tuple[int, int], tuple[Slot, ...]] = {}

    def slots(self, address: int, count: int) -> tuple[Slot, ...]:
        """The points in a block, deciding points before those that they decide."""
        key = (address, count)
        if key not in self._blocks:
            self._blocks[key] = tuple(
                self._slot(point, address) for point in self._drive.points_in(address, count)
            )
        return self._blocks[key]

    def reading(self, slot: Slot, words: tuple[int, ...]) -> Reading:
        """What the words of a slot say; the samples of the points before it are in the store."""
        if not slot.fixed or slot.reading is None or slot.words != words:
            slot.reading = reading_of(self._drive, self._store, slot.point, words)
            slot.words = words
        return slot.reading

    def _slot(self, point: Point, address: int) -> Slot:
        start = point.address - address
        return Slot(
            point, self._drive.tag(point.name), start, start + point.words, is_fixed(self._drive, point)
        )
