"""What a client gives to write, or as an argument: which types stand for a value of a node's type. Pure.

Many clients do not look at the type of a node first: they send an integer in whatever width they use, and a
number as Float. Nothing is guessed: an integer for a Double is refused, because it is what a client sends
that means raw counts, and a number for a Boolean because nobody knows what it means.
"""

from __future__ import annotations

import struct

from asyncua import ua

from gateway.tag import Value

_INTEGERS = frozenset(
    {
        ua.VariantType.SByte,
        ua.VariantType.Byte,
        ua.VariantType.Int16,
        ua.VariantType.UInt16,
        ua.VariantType.Int32,
        ua.VariantType.UInt32,
        ua.VariantType.Int64,
        ua.VariantType.UInt64,
    }
)
_TAKEN: dict[ua.VariantType, frozenset[ua.VariantType]] = {
    ua.VariantType.Int32: _INTEGERS,
    ua.VariantType.Int64: _INTEGERS,
    ua.VariantType.Double: frozenset({ua.VariantType.Double, ua.VariantType.Float}),
    ua.VariantType.Variant: _INTEGERS
    | {ua.VariantType.Boolean, ua.VariantType.Double, ua.VariantType.Float, ua.VariantType.String},
}
_TEXT_OR_BIT = frozenset({ua.VariantType.Boolean, ua.VariantType.String})
_NUMBERS = _INTEGERS | {ua.VariantType.Double, ua.VariantType.Float}
_MISTAKEN: dict[ua.VariantType, frozenset[ua.VariantType]] = {
    ua.VariantType.Int32: frozenset({ua.VariantType.Boolean}),
    ua.VariantType.Int64: frozenset({ua.VariantType.Boolean}),
    ua.VariantType.Double: _TEXT_OR_BIT,
    ua.VariantType.Boolean: _NUMBERS | {ua.VariantType.String},
}
MOST_TEXT = 200
"""Characters of a value that are passed on at most although it cannot be taken."""
_FLOAT_DIGITS = range(6, 9)
"""Decimal digits that every Float keeps, up to those that are one short of telling any two apart."""


def is_taken(variant: ua.Variant | None, kind: ua.VariantType) -> bool:
    """True when the variant holds one value that stands for a value of type ``kind``.

    Whether an integer is too large for the point is for the core to say.
    """
    return (
        variant is not None
        and variant.VariantType in _TAKEN.get(kind, {kind})
        and variant.Value is not None
        and not isinstance(variant.Value, list)
    )


def is_plain(variant: ua.Variant) -> bool:
    """True when the variant holds one value that could be a point's, of whatever type, and is not long."""
    return is_taken(variant, ua.VariantType.Variant) and len(str(variant.Value)) <= MOST_TEXT


def is_mistaken(variant: ua.Variant | None, kind: ua.VariantType) -> bool:
    """True when the variant holds one plain value that no point of type ``kind`` takes, in no protocol: the
    core refuses it, in the same words for everybody. What else is not taken is a matter of OPC UA."""
    return variant is not None and variant.VariantType in _MISTAKEN.get(kind, ()) and is_plain(variant)


def value_of(variant: ua.Variant) -> Value:
    """The value in a variant that `is_taken`."""
    value: Value = variant.Value
    if variant.VariantType == ua.VariantType.Float and isinstance(value, float):
        return _shortest(value)
    return value


def _shortest(value: float) -> float:
    """The shortest decimal that is this Float. A client that writes 59.9 as Float sends
    59.90000152587890625, which would be above a limit of 59.9."""
    for digits in _FLOAT_DIGITS:
        decimal = float(f"{value:.{digits}g}")
        if struct.pack("<f", decimal) == struct.pack("<f", value):
            return decimal
    return value
