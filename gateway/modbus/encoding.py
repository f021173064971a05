"""Raw register words to values and back, as a point's `Encoding` says.

Between words and value stands the *raw* number: a count (signed where the type is), the number that the
digits of a BCD value spell, the field's own bits, or, for f32, the 32-bit pattern. All arithmetic is exact
(`Fraction`); a float is made once, at the end.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from gateway.mapping.profile import Encoding, NumberType
from gateway.tag import Value, ValueType

WORD = 0xFFFF
_SIGNED = frozenset({NumberType.S16, NumberType.S32})

NOT_DECIMAL = "not_decimal"
"""`Decoded.special` of a BCD value with a digit above 9."""
NOT_A_NUMBER = "not_a_number"
"""`Decoded.special` of a float that is NaN or infinite."""


class EncodingError(ValueError):
    """The value cannot be written in this encoding; the message says why."""


@dataclass(frozen=True, slots=True)
class Decoded:
    """A value as clients see it.

    ``text`` is the name of an enumeration value. ``special`` is the name of a raw value that is no number;
    then ``value`` is None.
    """

    value: Value
    text: str | None = None
    special: str | None = None


def decode(encoding: Encoding, words: Sequence[int], times: Fraction = Fraction(1)) -> Decoded:
    """The value in ``words``; ``times`` is the present value of the point that `Encoding.times` names.

    Never fails on what a drive may send. Raises `EncodingError` only when the number of words is wrong.
    """
    pattern = _pattern(encoding, words)
    raw = _typed(encoding, pattern)
    special = _special(encoding, pattern, raw)
    if special is not None or raw is None:
        return Decoded(None, special=special or NOT_DECIMAL)
    match encoding.value_type:
        case ValueType.TEXT:
            return Decoded(_text(raw, encoding.words))
        case ValueType.BOOLEAN:
            return Decoded(bool(raw))
        case ValueType.INTEGER:
            return Decoded(raw, text=encoding.values.get(raw) or _by_pattern(encoding, pattern))
        case ValueType.NUMBER:
            return _scaled(encoding, raw, times)


def extract(encoding: Encoding, words: Sequence[int]) -> int:
    """The raw number in ``words``. Raises `EncodingError` for a BCD value with a digit above 9."""
    raw = _typed(encoding, _pattern(encoding, words))
    if raw is None:
        raise EncodingError("not a BCD number: a digit is above 9")
    return raw


def encode(encoding: Encoding, value: Fraction, times: Fraction = Fraction(1)) -> int:
    """The raw number nearest to ``value`` (ties to even).

    Raises `EncodingError` when it does not fit the type or the counts that may be written, is no raw number
    of a bit or enumeration, or would be read as a special value.
    """
    if encoding.type is NumberType.TEXT:
        raise EncodingError("a text cannot be written as a number")
    factor = encoding.scale * times
    if factor == 0:
        raise EncodingError("the scale is zero at present, so that no raw value can be told")
    exact = (value - encoding.offset) / factor if _is_scaled(encoding) else value
    raw = _float_pattern(exact) if encoding.type is NumberType.F32 else _count(encoding, exact)
    if encoding.counts is not None and not encoding.counts[0] <= raw <= encoding.counts[1]:
        low, high = encoding.counts
        raise EncodingError(f"it would be {raw} counts, and the drive takes {low} to {high}")
    pattern = _bits(encoding, raw)
    if (name := _special(encoding, pattern, raw)) is not None:
        raise EncodingError(f"raw value {raw} means {name}, not a number")
    return raw


def to_words(encoding: Encoding, raw: int) -> tuple[int, ...]:
    """The words to write for a raw number. A field has no words of its own: see `insert`."""
    if encoding.width:
        raise EncodingError("a field can only be put into its word")
    bits = _bits(encoding, raw)
    words = tuple(bits >> shift & WORD for shift in range(16 * (encoding.words - 1), -1, -16))
    return words[::-1] if encoding.word_order == "low_first" else words


def insert(encoding: Encoding, raw: int, word: int) -> int:
    """``word`` with the field set to ``raw`` and all other bits kept."""
    if not encoding.width:
        raise EncodingError("only a field can be put into a word")
    mask = _mask(encoding.width)
    field = _bits(encoding, raw) ^ (mask if encoding.active_low else 0)
    return word & ~(mask << encoding.bit) & WORD | field << encoding.bit


def _mask(bits: int) -> int:
    return (1 << bits) - 1


def _size(encoding: Encoding) -> int:
    """Bits that the raw value occupies."""
    return encoding.width or 16 * encoding.words


def _pattern(encoding: Encoding, words: Sequence[int]) -> int:
    """The bits of the value as an unsigned number."""
    if len(words) != encoding.words:
        raise EncodingError(f"{len(words)} words where the value has {encoding.words}")
    bits = 0
    for word in reversed(words) if encoding.word_order == "low_first" else words:
        bits = bits << 16 | word
    if not encoding.width:
        return bits
    mask = _mask(encoding.width)
    return (bits >> encoding.bit & mask) ^ (mask if encoding.active_low else 0)


def _typed(encoding: Encoding, pattern: int) -> int | None:
    """The raw number of a bit pattern; None where BCD digits are no digits."""
    if encoding.type in _SIGNED and pattern >> (_size(encoding) - 1):
        return pattern - (1 << _size(encoding))
    if encoding.type is NumberType.BCD:
        digits = f"{pattern:x}"
        return int(digits) if digits.isdecimal() else None
    return pattern


def _bits(encoding: Encoding, raw: int) -> int:
    """The bit pattern of a raw number. Raises `EncodingError` when it does not fit."""
    low, high = _raw_range(encoding)
    if not low <= raw <= high:
        raise EncodingError(f"raw value {raw} does not fit: {encoding.type} here holds {low}..{high}")
    if encoding.type is NumberType.BCD:
        return int(str(raw), 16)
    return raw & _mask(_size(encoding))


def _raw_range(encoding: Encoding) -> tuple[int, int]:
    size = _size(encoding)
    if encoding.type in _SIGNED:
        return -(1 << size - 1), _mask(size - 1)
    if encoding.type is NumberType.BCD:
        # An incomplete top digit (a field of 6 bits, say) holds what its bits can spell.
        return 0, (min(9, _mask(size % 4)) + 1) * int(10 ** (size // 4)) - 1
    return 0, _mask(size)


def _special(encoding: Encoding, pattern: int, raw: int | None) -> str | None:
    """The name of a raw value that is no number; profiles may give it signed or as its bits."""
    if pattern in encoding.special:
        return encoding.special[pattern]
    return None if raw is None else encoding.special.get(raw)


def _by_pattern(encoding: Encoding, pattern: int) -> str | None:
    """The name of the profile's pattern that the bits fit."""
    fitting = (name for mask, bits, name in encoding.patterns if pattern & mask == bits)
    return next(fitting, None)


def _is_scaled(encoding: Encoding) -> bool:
    return encoding.value_type is ValueType.NUMBER


def _text(raw: int, words: int) -> str:
    """Two characters a word, high byte first; what follows a NUL and blanks at the end are filling."""
    return raw.to_bytes(2 * words, "big").split(b"\0", 1)[0].decode("latin-1").rstrip()


def _scaled(encoding: Encoding, raw: int, times: Fraction) -> Decoded:
    if encoding.type is not NumberType.F32:
        return Decoded(_nearest(raw, encoding.scale, times, encoding.offset))
    (single,) = struct.unpack(">f", raw.to_bytes(4, "big"))
    if not math.isfinite(single):
        return Decoded(None, special=NOT_A_NUMBER)
    return Decoded(float(Fraction(single) * encoding.scale * times + encoding.offset))


def _nearest(raw: int, scale: Fraction, times: Fraction, offset: Fraction) -> float:
    """The float nearest to ``raw * scale * times + offset``: integers are divided exactly rounded, and it is
    three times as fast as with fractions."""
    below = scale.denominator * times.denominator
    above = raw * scale.numerator * times.numerator
    if not offset:
        return above / below
    return (above * offset.denominator + offset.numerator * below) / (below * offset.denominator)


def _count(encoding: Encoding, exact: Fraction) -> int:
    raw = round(exact)
    if encoding.value_type is not ValueType.NUMBER and raw != exact:
        raise EncodingError(f"{float(exact):g} is not a whole number")
    _bits(encoding, raw)
    return raw


def _float_pattern(exact: Fraction) -> int:
    try:
        return int.from_bytes(struct.pack(">f", float(exact)), "big")
    except OverflowError:
        raise EncodingError("too large for a 32-bit float") from None
