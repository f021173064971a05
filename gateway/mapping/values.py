"""Values as authors write them in conditions and steps: ``true``, ``line``, ``0FH``, ``2..39``."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from gateway.mapping import forms
from gateway.mapping.encodings import REGISTER, value_span
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.model import Condition as RawCondition
from gateway.mapping.node import Path
from gateway.mapping.profile import Condition, Point, Setting, Term
from gateway.mapping.shape import nearest
from gateway.tag import ValueType

Target = Point | Setting
Span = tuple[Fraction, Fraction]


def value_ranges(text: str, target: Target) -> list[Span]:
    """The closed ranges that a text means for a point or setting: several only for a pattern's name."""
    patterns = target.encoding.patterns if isinstance(target, Point) else ()
    for mask, bits, name in patterns:
        if name == text:
            return fitting(mask, bits, target.encoding.width or REGISTER)  # type: ignore[union-attr]
    return [value_range(text, target)]


def fitting(mask: int, bits: int, width: int) -> list[Span]:
    """The ranges of raw values of so many bits that fit a pattern."""
    low = (mask & -mask).bit_length() - 1 if mask else width
    free = [bit for bit in range(low, width) if not mask >> bit & 1]
    starts = [bits]
    for bit in free:
        starts += [start | 1 << bit for start in starts]
    return [(Fraction(start), Fraction(start + (1 << low) - 1)) for start in sorted(starts)]


def value_range(text: str, target: Target) -> Span:
    """The closed range that a text means for a point or setting: raw for names, else in the unit.

    Raises `FormError` when the target cannot have such a value.
    """
    names = target.encoding.values if isinstance(target, Point) else target.values
    if isinstance(target, Point) and target.encoding.patterns:
        return _beside_patterns(text, target)
    if isinstance(target, Point) and target.encoding.value_type is ValueType.BOOLEAN:
        bit = Fraction(forms.truth(text))
        return bit, bit
    if isinstance(target, Point) and target.encoding.value_type is ValueType.TEXT:
        raise FormError(f"`{target.name}` is a text", "only numbers, bits and names can be compared")
    if names:
        return _named(text, names, target.name)
    low, high = forms.numbers_span(text)
    _inside(text, low, high, target)
    return low, high


def single_value(text: str, target: Target) -> Fraction:
    """The one value that a text means. Raises `FormError` as `value_range`, and for ranges."""
    low, high = value_range(text, target)
    if low != high:
        raise FormError(f"`{text}` is a range", "write one value")
    return low


def _named(text: str, names: Mapping[int, str], owner: str) -> tuple[Fraction, Fraction]:
    for raw, name in names.items():
        if name == text:
            return Fraction(raw), Fraction(raw)
    remedy = nearest(text, list(names.values()))
    try:
        low, high = forms.numbers_span(text)
    except FormError:
        raise FormError(f"`{owner}` has no value `{text}`", remedy) from None
    if not any(low <= raw <= high for raw in names) or (low == high and low not in names):
        raise FormError(f"`{owner}` has no value `{text}`", remedy)
    return low, high


def _beside_patterns(text: str, point: Point) -> Span:
    """A single raw value, or a range of them, of a point that also has patterns."""
    encoding = point.encoding
    for raw, name in encoding.values.items():
        if name == text:
            return Fraction(raw), Fraction(raw)
    try:
        low, high = forms.numbers_span(text)
    except FormError:
        known = [*encoding.values.values(), *(name for *_, name in encoding.patterns)]
        raise FormError(f"`{point.name}` has no value `{text}`", nearest(text, known)) from None
    _inside(text, low, high, point)
    return low, high


def _inside(text: str, low: Fraction, high: Fraction, target: Target) -> None:
    if isinstance(target, Point):
        span = value_span(target.encoding)
    else:
        span = (target.low, target.high) if target.low is not None and target.high is not None else None
    if span is not None and not (span[0] <= low and high <= span[1]):
        raise FormError(
            f"`{target.name}` never is `{text}`", f"it can be {in_words(span[0])} to {in_words(span[1])}"
        )


def in_words(value: Fraction) -> str:
    """A number for people: decimals where they end, else rounded."""
    return str(value) if value.denominator == 1 else f"{float(value):g}"


class Conditions:
    """Looks up the names of conditions."""

    def __init__(self, points: Mapping[str, Point], settings: Mapping[str, Setting], report: Report) -> None:
        self._points = points
        self._settings = settings
        self._report = report
        self.used: set[str] = set()

    def find(self, raw: RawCondition | None, path: Path) -> Condition:
        """The condition with its names looked up; terms that cannot be are complained about and left out."""
        terms = (self._term(name, values, (*path, name)) for name, values in (raw or {}).items())
        return tuple(term for term in terms if term is not None)

    def target(self, name: str, path: Path, *, key: bool = True) -> Target | None:
        """The point or setting of that name; None, with a finding, when there is none to look at."""
        found: Target | None = self._points.get(name) or self._settings.get(name)
        self.used.add(name)
        if found is None:
            known = [*self._points, *self._settings]
            message = f"`{name}` is no point and no setting"
            self._report.unknown_name(path, name, message, _spelling(name, known), key=key)
        elif isinstance(found, Point) and not found.access.readable:
            message = f"`{name}` cannot be read, so nothing can depend on it"
            self._report.error(path, message, "name a point that can be read", key=key)
            return None
        return found

    def _term(self, name: str, values: str | list[str], path: Path) -> Term | None:
        target = self.target(name, path)
        if target is None:
            return None
        places = (
            [(values, path)] if isinstance(values, str) else [(v, (*path, i)) for i, v in enumerate(values)]
        )
        ranges: list[Span] = []
        for text, place in places:
            try:
                ranges += value_ranges(text, target)
            except FormError as error:
                self._report.error(place, error.message, error.remedy)
        written = values if isinstance(values, str) else f"[{', '.join(values)}]"
        return Term(name, tuple(ranges), f"{name}: {written}", setting=isinstance(target, Setting))


def _spelling(name: str, known: list[str]) -> str:
    """As `nearest`, without the list of everything."""
    remedy = nearest(name, known)
    return remedy if remedy.startswith("did") else "declare it, or correct the name"
