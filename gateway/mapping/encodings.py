"""From the keys of a point to its `Encoding`, and what an encoding can hold."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from types import MappingProxyType
from typing import NamedTuple

from gateway.mapping import forms
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError, Unit
from gateway.mapping.inherit import Inherited, Level
from gateway.mapping.model import Modbus, NamedValue, Values, ValueTable
from gateway.mapping.node import Path
from gateway.mapping.profile import Encoding, NumberType, WordOrder
from gateway.mapping.shape import nearest

_WORDS = {"u16": 1, "s16": 1, "u32": 2, "s32": 2, "u64": 4, "f32": 2, "bcd": 1}
REGISTER = 16
"""Bits of a register."""
_TEXT = re.compile(r"text ([1-9]\d{0,2})", re.ASCII)
_IN_FIELDS = ("u16", "s16", "bcd")

Pattern = tuple[int, int, str]
"""Mask, bits and name of raw values of which only some bits count."""


class Names(NamedTuple):
    """The names of a table of values: of single raw values, and of those that fit a pattern."""

    values: Mapping[int, str]
    patterns: tuple[Pattern, ...] = ()
    entries: Mapping[int, Level] = MappingProxyType({})
    """Where each name is written, and what is said of it there."""


_NAMELESS = Names(MappingProxyType({}))


class Encodings:
    """Makes the encodings of one profile."""

    def __init__(self, shared: Mapping[str, ValueTable], modbus: Modbus, report: Report) -> None:
        self._report = report
        self._order: WordOrder = modbus.words.value if modbus.words else "high_first"
        self._shared = {name: self.names(table, ("values", name)) for name, table in shared.items()}
        self._sure = {name for name in shared if not report.wrong(("values", name))}

    def make(self, keys: Inherited, bits: tuple[int, int] | None = None, active: str = "high") -> Encoding:
        """The encoding of a point, or of the field at ``bits`` (first bit and width)."""
        traits = keys.traits
        unit = traits.unit or Unit(Fraction(1), "")
        kind, words = self._type(traits.type or "u16", keys.place("type"), field=bits is not None)
        names = self.values(traits.values, keys.place("values"))
        encoding = Encoding(
            type=kind,
            words=words,
            word_order=traits.words or self._order,
            bit=bits[0] if bits else 0,
            width=bits[1] if bits else 0,
            active_low=active == "low",
            scale=unit.scale,
            symbol=unit.symbol or None,
            times=traits.times,
            offset=traits.offset or Fraction(0),
            values=names.values,
            patterns=names.patterns,
            special=self._special(traits.special or {}, keys.place("special")),
            counts=traits.counts,
        )
        self._fits(encoding, keys)
        return encoding

    def values(self, raw: Values | None, path: Path) -> Names:
        """The names of a table in place or of a shared one."""
        if raw is None:
            return _NAMELESS
        if isinstance(raw, dict):
            return self.names(raw, path)
        if raw not in self._shared:
            message = f"`{raw}` is none of the tables under `values`"
            self._report.unknown_name(path, raw, message, nearest(raw, list(self._shared)))
        return self._shared.get(raw, _NAMELESS)

    def knows(self, raw: Values | None) -> bool:
        """False for a shared table that is not there, or has errors itself."""
        return not isinstance(raw, str) or raw in self._sure

    def names(self, table: ValueTable, path: Path) -> Names:
        """The names of a table; each raw value must have one name, and each name one place."""
        result: dict[int, str] = {}
        entries: dict[int, Level] = {}
        patterns: list[Pattern] = []
        for key, entry in table.items():
            cut = forms.pattern(key)
            if cut is not None:
                self._apart(key, (*cut, entry.name), patterns, result, (*path, key))
                patterns.append((*cut, entry.name))
            elif (raw := self._key(key, (*path, key))) is not None:
                self._once(raw, entry, result, (*path, key))
                self._apart(key, (-1, raw, entry.name), patterns, {}, (*path, key))
                result[raw] = entry.name
                entries[raw] = ((*path, key), entry)
        return Names(MappingProxyType(result), tuple(patterns), entries)

    def _apart(
        self, key: str, own: Pattern, patterns: list[Pattern], single: Mapping[int, str], path: Path
    ) -> None:
        """No raw value may fit two keys. A single value is a pattern whose mask is -1: all bits count."""
        for mask, bits, name in [*patterns, *((-1, raw, name) for raw, name in single.items())]:
            if not (bits ^ own[1]) & mask & own[0]:
                message = f"`{key}` fits raw values that are named `{name}` already"
                self._report.error(path, message, "make the patterns differ in a bit that counts", key=True)
            elif name == own[2]:
                self._report.error(path, f"the name `{name}` stands for two raw values", "use another name")

    def _once(self, raw: int, entry: NamedValue, known: Mapping[int, str], path: Path) -> None:
        if raw in known:
            self._report.error(
                path, f"the raw value {raw} has a name already, `{known[raw]}`", "keep one of them", key=True
            )
        elif entry.name in known.values():
            self._report.error(path, f"the name `{entry.name}` stands for two raw values", "use another name")

    def _special(self, table: Mapping[str, str], path: Path) -> Mapping[int, str]:
        pairs = ((self._key(key, (*path, key)), name) for key, name in table.items())
        return MappingProxyType({raw: name for raw, name in pairs if raw is not None})

    def _key(self, text: str, path: Path) -> int | None:
        try:
            return forms.integer(text)
        except FormError as error:
            self._report.error(path, error.message, error.remedy, key=True)
            return None

    def _type(self, text: str, path: Path, *, field: bool) -> tuple[NumberType, int]:
        """Number type and registers that it takes."""
        match = _TEXT.fullmatch(text)
        if match and not field:
            return NumberType.TEXT, (int(match[1]) + 1) // 2
        known = _IN_FIELDS if field else tuple(_WORDS)
        if text not in known:
            what = "the type of a field" if field else "a type"
            more = "" if field else " or text 20"
            self._report.error(path, f"`{text}` is not {what}", f"use one of {' '.join(known)}{more}")
            return NumberType.U16, 1
        return NumberType(text), _WORDS[text]

    def _fits(self, encoding: Encoding, keys: Inherited) -> None:
        """Complain about raw values that cannot occur, and about names for what is no count."""
        self._unmixed(encoding, keys)
        self._fit_patterns(encoding, keys)
        self._fits_width(encoding, keys)
        span = raw_span(encoding)
        self._fit_counts(encoding, span, keys)
        for key, table in (("values", encoding.values), ("special", encoding.special)):
            if table and span is None:
                self._report.error(
                    keys.place(key),
                    f"`{key}` cannot stand beside `type: {encoding.type}`",
                    "leave one of them out",
                )
            for raw in table:
                if span is not None and not span[0] <= raw <= span[1]:
                    self._report.error(
                        keys.place(key),
                        f"the raw value {raw} of `{key}` does not fit: it can be {span[0]} to {span[1]}",
                        "correct the value or the width",
                    )

    def _fits_width(self, encoding: Encoding, keys: Inherited) -> None:
        """A single bit has no sign and no digits, and a digit has four bits."""
        if encoding.width == 1 and encoding.type is not NumberType.U16:
            message = f"`type: {encoding.type}` stands on a single bit"
            self._report.error(keys.place("type"), message, "leave it out")
        elif encoding.type is NumberType.BCD and encoding.width % 4:
            message = f"a width of {encoding.width} bits is no number of whole digits"
            self._report.error(keys.place("type"), message, "correct `bit` or the type")

    def _fit_counts(self, encoding: Encoding, span: tuple[int, int] | None, keys: Inherited) -> None:
        """What is written at most must be something that the register can hold."""
        if encoding.counts is None:
            return
        low, high = encoding.counts
        if span is None:
            message = f"`counts` cannot stand beside `type: {encoding.type}`"
            self._report.error(keys.place("counts"), message, "leave one of them out", key=True)
        elif low < span[0] or high > span[1]:
            message = f"the counts {low} to {high} do not fit: they can be {span[0]} to {span[1]}"
            self._report.error(keys.place("counts"), message, "correct the counts or the type")

    def _fit_patterns(self, encoding: Encoding, keys: Inherited) -> None:
        """A pattern speaks of the bits of one unsigned value."""
        size = encoding.width or REGISTER
        if encoding.patterns and (encoding.type is not NumberType.U16):
            message = f"patterns cannot stand beside `type: {encoding.type}`"
            self._report.error(keys.place("values"), message, "leave the type out")
        for mask, _, name in encoding.patterns:
            if mask >> size:
                message = f"the pattern of `{name}` has more than {size} bits"
                self._report.error(keys.place("values"), message, "correct the pattern or the width")

    def _unmixed(self, encoding: Encoding, keys: Inherited) -> None:
        """A unit is for amounts: neither a single bit nor named values have one."""
        amount = encoding.symbol or encoding.times or encoding.offset
        named = encoding.values or encoding.patterns
        text = encoding.type is NumberType.TEXT
        if amount and (named or text or encoding.width == 1):
            key = next(key for key in ("unit", "times", "offset") if key in keys.where)
            what = "`values`" if named else "a text" if text else "a single bit"
            message = f"`{key}` cannot stand beside {what}"
            self._report.error(keys.place(key), message, "leave one of them out", key=True)


def raw_span(encoding: Encoding) -> tuple[int, int] | None:
    """Least and greatest raw value; None when they are no counts (text, floating point)."""
    width = encoding.width or 16 * encoding.words
    if encoding.type in (NumberType.TEXT, NumberType.F32):
        return None
    if encoding.type is NumberType.BCD:
        return 0, 10 ** (width // 4) - 1
    if encoding.type in (NumberType.S16, NumberType.S32):
        return -(1 << width - 1), (1 << width - 1) - 1
    return 0, (1 << width) - 1


def value_span(encoding: Encoding) -> tuple[Fraction, Fraction] | None:
    """Least and greatest value in the unit; None when a setting or point multiplies it, or no counts."""
    span = raw_span(encoding)
    if span is None or encoding.times is not None:
        return None
    return span[0] * encoding.scale + encoding.offset, span[1] * encoding.scale + encoding.offset
