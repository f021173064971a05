"""The small forms of the mapping language: each reads one text or says why it cannot.

All numbers are exact. Each function raises `FormError` for a text that is not of its form.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from fractions import Fraction

from gateway.mapping.profile import SerialFormat
from gateway.mapping.units import SYMBOLS

_DECIMAL = re.compile(r"-?\d+(\.\d+)?", re.ASCII)
_HEX = re.compile(r"[0-9A-F]+H")
_FOREIGN_HEX = re.compile(r"0[xX]([0-9A-Fa-f]+)|([0-9A-Fa-f]+)h", re.ASCII)
_GLUED = re.compile(r"(\d[\d./]*)([^\d./ ].*)")
_BINARY = re.compile(r"[01]+B")
_PATTERN = re.compile(r"[01x]*x[01x]*B")
_FRACTION = re.compile(r"(\d+)/(\d+)", re.ASCII)
_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_DURATION = re.compile(r"(\d+(?:\.\d+)?)(ms|s)", re.ASCII)
_FORMAT = re.compile(r"([78])([NEO])([12])")
_PLACEHOLDER = re.compile(r"(-?)<([a-z][a-z0-9_]*)>")
_POSITION = re.compile(r"[0-9A-F]|1[0-5]")
_MAX_DIGITS = 40
_SECONDS = {"ms": Fraction(1, 1000), "s": Fraction(1)}


class FormError(ValueError):
    """A text that is not of the form its key asks for. ``remedy`` tells what to write instead."""

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(message)
        self.message = message
        self.remedy = remedy


@dataclass(frozen=True, slots=True)
class Range:
    """A closed range; an end may be the name of a setting or point."""

    low: Fraction | str
    high: Fraction | str


@dataclass(frozen=True, slots=True)
class Unit:
    """What one count is worth."""

    scale: Fraction
    symbol: str


@dataclass(frozen=True, slots=True)
class Placeholder:
    """``<name>`` or ``-<name>`` in a step."""

    name: str
    negate: bool


def number(text: str) -> Fraction:
    """``14``, ``-7.26``, ``0EH`` or ``1110B``."""
    if len(text) > _MAX_DIGITS:
        raise FormError(f"a number of {len(text)} characters", f"use at most {_MAX_DIGITS}")
    if _DECIMAL.fullmatch(text):
        return Fraction(text)
    if _HEX.fullmatch(text):
        return Fraction(int(text[:-1], 16))
    if _BINARY.fullmatch(text):
        return Fraction(int(text[:-1], 2))
    raise FormError(f"`{text}` is not a number", _number_meant(text))


def _number_meant(text: str) -> str:
    """How others write numbers, and how it is written here."""
    hexadecimal = _FOREIGN_HEX.fullmatch(text)
    if hexadecimal:
        return f"did you mean `{(hexadecimal[1] or hexadecimal[2]).upper()}H`?"
    if _DECIMAL.fullmatch(text.replace(",", ".")):
        return f"did you mean `{text.replace(',', '.')}`?"
    return "write it like 14, -7.26, 0EH or 1110B"


def integer(text: str) -> int:
    """A `number` without decimals."""
    value = number(text)
    if value.denominator != 1:
        raise FormError(f"`{text}` is not a whole number", "leave the decimals out")
    return int(value)


def pattern(text: str) -> tuple[int, int] | None:
    """Mask and bits of ``x01xB``, a raw value of which only some bits count; None for any other text."""
    if not _PATTERN.fullmatch(text):
        return None
    digits = text[:-1]
    mask = int("".join("0" if digit == "x" else "1" for digit in digits), 2)
    return mask, int(digits.replace("x", "0"), 2)


def span(text: str) -> Range:
    """``a..b``, both ends included; the ends are numbers or names."""
    low, dots, high = text.partition("..")
    if not dots:
        raise FormError(f"`{text}` is not a range", "write it like 0..50")
    result = Range(_end(low.strip()), _end(high.strip()))
    if isinstance(result.low, Fraction) and isinstance(result.high, Fraction) and result.low > result.high:
        raise FormError(f"the range `{text}` is empty", "put the lower end first")
    return result


def _end(text: str) -> Fraction | str:
    return text if _NAME.fullmatch(text) else number(text)


def numbers_span(text: str) -> tuple[Fraction, Fraction]:
    """A range of numbers; a single number is the range of just itself."""
    if ".." not in text:
        value = number(text)
        return value, value
    ends = span(text)
    if isinstance(ends.low, str) or isinstance(ends.high, str):
        raise FormError(f"`{text}` is not a range of numbers", "write it like 0..50")
    return ends.low, ends.high


def integers_span(text: str) -> tuple[int, int]:
    """A range of whole numbers; a single number is the range of just itself."""
    low, high = numbers_span(text)
    if low.denominator != 1 or high.denominator != 1:
        raise FormError(f"`{text}` is not a range of whole numbers", "leave the decimals out")
    return int(low), int(high)


def unit(text: str) -> Unit:
    """``0.01 Hz`` or ``10/1023 V``: the number is compulsory and above zero."""
    amount, _, symbol = text.partition(" ")
    if not symbol:
        raise FormError(f"`{text}` is not a unit", _unit_meant(text))
    scale = _amount(amount)
    if scale <= 0:
        raise FormError(f"the number of the unit `{text}` is not above zero", "say what one count is worth")
    if symbol not in SYMBOLS:
        raise FormError(f"`{symbol}` is not a unit symbol", _symbol(symbol))
    return Unit(scale, symbol)


def _unit_meant(text: str) -> str:
    glued = _GLUED.fullmatch(text)
    if glued and glued[2] in SYMBOLS:
        return f"did you mean `{glued[1]} {glued[2]}`?"
    like = f"1 {text}" if text in SYMBOLS else "0.01 Hz"
    return f"write a number and a symbol, like {like}"


def _symbol(text: str) -> str:
    """The symbol that was meant, or all of them."""
    alike = {symbol.casefold(): symbol for symbol in SYMBOLS}
    match = difflib.get_close_matches(text.casefold(), list(alike), n=1, cutoff=0.6)
    return f"did you mean `{alike[match[0]]}`?" if match else f"use one of {' '.join(SYMBOLS)}"


def _amount(text: str) -> Fraction:
    fraction = _FRACTION.fullmatch(text)
    if not fraction:
        return number(text)
    top, bottom = number(fraction[1]), number(fraction[2])
    if not bottom:
        raise FormError(f"`{text}` divides by zero", "say what one count is worth")
    return top / bottom


def duration(text: str) -> float:
    """``200ms`` or ``2s``, in seconds."""
    match = _DURATION.fullmatch(text)
    if not match:
        raise FormError(f"`{text}` is not a time", "write it like 200ms or 2s")
    return float(number(match[1]) * _SECONDS[match[2]])


def time_or_name(text: str) -> float | str:
    """``2s``, in seconds; or the name of what holds the time."""
    return text if _NAME.fullmatch(text) else duration(text)


def durations(text: str) -> tuple[float, float]:
    """``20ms..1s``, in seconds."""
    low, dots, high = text.partition("..")
    if not dots:
        raise FormError(f"`{text}` is not a range of times", "write it like 20ms..1s")
    ends = duration(low.strip()), duration(high.strip())
    if ends[0] > ends[1]:
        raise FormError(f"the range `{text}` is empty", "put the shorter time first")
    return ends


def truth(text: str) -> bool:
    """``true`` or ``false``; nothing else is."""
    if text not in ("true", "false"):
        raise FormError(f"`{text}` is neither true nor false", "write true or false")
    return text == "true"


def name(text: str) -> str:
    """A snake_case name."""
    if not _NAME.fullmatch(text):
        meant = re.sub(r"[^a-z0-9]+", "_", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", text).lower()).strip("_")
        spelled = f"did you mean `{meant}`?" if _NAME.fullmatch(meant) else ""
        remedy = spelled or "use small letters, digits and single _ like output_current"
        raise FormError(f"`{text}` is not a name", remedy)
    return text


def bits(text: str) -> tuple[int, int]:
    """First bit and width of a field: ``3``, ``2..3``, ``C``, ``8..F``."""
    low, dots, high = text.partition("..")
    ends = [low, high] if dots else [low]
    if not all(_POSITION.fullmatch(end) for end in ends):
        raise FormError(f"`{text}` is not a bit position", "write 0 to 15 or 0 to F, or two of them as 2..3")
    first, last = _position(ends[0]), _position(ends[-1])
    if first > last:
        raise FormError(f"the bits `{text}` are in the wrong order", "put the lower bit first")
    return first, last - first + 1


def _position(text: str) -> int:
    return int(text) if text.isdecimal() else int(text, 16)


def serial_format(text: str) -> SerialFormat:
    """``8N2``: data bits, parity, stop bits."""
    match = _FORMAT.fullmatch(text)
    if not match:
        raise FormError(f"`{text}` is not a serial format", "write it like 8N2")
    return SerialFormat(int(match[1]), match[2], int(match[3]))  # type: ignore[arg-type]


def placeholder(text: str) -> Placeholder | None:
    """``<name>`` or ``-<name>``; None for any other text."""
    match = _PLACEHOLDER.fullmatch(text)
    return Placeholder(match[2], bool(match[1])) if match else None
