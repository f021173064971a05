"""Does a value come back as it was written, and a raw value as it was read?"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from gateway.mapping.encodings import raw_span
from gateway.mapping.profile import Encoding, Point, Profile
from gateway.modbus.encoding import decode, encode, insert, to_words

_EXACT = 2**50
"""Raw values whose scaled value a client's number can hold."""


def check_round_trips(profile: Profile) -> int:
    """Every point in every of its cases; gives back how many raw values went round."""
    points = [*profile.points.values(), *(profile.broadcast.points.values() if profile.broadcast else ())]
    return sum(
        _round(encoding, raw) for point in points for encoding in encodings(point) for raw in raws(encoding)
    )


def encodings(point: Point) -> list[Encoding]:
    return [case.encoding for case in point.cases] or [point.encoding]


def raws(encoding: Encoding) -> Iterator[int]:
    """Ends, middle and neighbours of what the raw value can be."""
    low, high = raw_span(encoding) or (0, -1)
    middle = (low + high) // 2
    for raw in {low, low + 1, middle, middle + 1, high - 1, high, 0, 1, -1, *encoding.values}:
        if low <= raw <= high:
            yield raw


def _round(encoding: Encoding, raw: int) -> bool:
    words = (insert(encoding, raw, 0),) if encoding.width else to_words(encoding, raw)
    read = decode(encoding, words)
    if read.special is not None or isinstance(read.value, str) or abs(raw) > _EXACT:
        return False
    assert read.value is not None
    assert encode(encoding, Fraction(read.value)) == raw, (encoding, raw, read)
    assert read.text is None or read.text in encoding.values.values() or encoding.patterns
    return True
