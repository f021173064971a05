"""Registers to values: the points of a block, each with what it held last. Pure.

Most registers of a drive are the same as a moment ago. A point that always means the same is decoded anew
only when its words have changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from gateway.core.drive import Drive
from gateway.core.meaning import Meaning, Meaningless, is_fixed, meaning_of
from gateway.core.store import Store
from gateway.mapping.profile import Point
from gateway.modbus.encoding import decode
from gateway.tag import Quality, Value

UNREADABLE = ("invalid", "not_decimal", "not_a_number")
"""Names of raw values that say nothing but that the reading is bad. Any other name (``switched_off``) is what
the drive holds in place of a number: it is no fault, and there is no number to show."""


class Reading(NamedTuple):
    """What words say: the part of a sample that needs no time. ``text`` as in `gateway.tag.Sample`."""

    value: Value
    quality: Quality
    text: str | None = None
    reason: str = ""


def reading_of(drive: Drive, store: Store, point: Point, words: Sequence[int]) -> Reading:
    """What a point's words say at present."""
    return read_as(meaning_of(drive, store, point), words)


def read_as(meaning: Meaning | Meaningless, words: Sequence[int]) -> Reading:
    """What words say that have this meaning."""
    if isinstance(meaning, Meaningless):
        return Reading(None, meaning.quality, None, meaning.reason)
    decoded = decode(meaning.encoding, words, meaning.times)
    if decoded.special is not None and decoded.special not in UNREADABLE:
        return Reading(None, Quality.NOT_APPLICABLE, decoded.special, decoded.special)
    if decoded.special is not None or decoded.value is None:
        return Reading(None, Quality.INVALID, decoded.special, decoded.special or "cannot be decoded")
    return Reading(decoded.value, Quality.GOOD, decoded.text)


@dataclass(slots=True)
class Slot:
    """A point in a block: its words begin at ``start`` and end before ``end``, counted from the block.
    ``meaning`` is None where it depends on other points."""

    point: Point
    tag: str
    start: int
    end: int
    meaning: Meaning | Meaningless | None
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
        if slot.meaning is None:
            return reading_of(self._drive, self._store, slot.point, words)
        if slot.reading is None or slot.words != words:
            slot.reading, slot.words = read_as(slot.meaning, words), words
        return slot.reading

    def _slot(self, point: Point, address: int) -> Slot:
        start = point.address - address
        fixed = is_fixed(self._drive, point)
        meaning = meaning_of(self._drive, self._store, point) if fixed else None
        return Slot(point, self._drive.tag(point.name), start, start + point.words, meaning)
