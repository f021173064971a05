"""What a point's keys say of other points: conditions, cases, selectors, the command that follows a write."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType

from gateway.mapping.encodings import Encodings
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.inherit import Inherited, overlay
from gateway.mapping.layout import Layout
from gateway.mapping.model import Case as RawCase
from gateway.mapping.node import Path
from gateway.mapping.profile import Case, Condition, Constant, Encoding, Limits, Point
from gateway.mapping.shape import nearest
from gateway.mapping.values import Conditions, single_value


class DependentMaker:
    """Completes the points of one profile with what leans on other points and on settings."""

    def __init__(self, layout: Layout, encodings: Encodings, report: Report) -> None:
        self._layout = layout
        self._encodings = encodings
        self._report = report

    def with_cases(self, point: Point) -> Point:
        """The point with its cases; the first one lends it symbol and value type, which all share."""
        keys = self._layout.keys[point.name]
        raw = keys.traits.cases
        if not raw:
            return point
        place = keys.place("cases")
        cases = tuple(self._case(point, keys, case, (*place, i)) for i, case in enumerate(raw))
        for index, case in enumerate(cases):
            self._check_alike(point, cases[0], case, (*place, index))
            if not raw[index].when and index < len(cases) - 1:
                message = "the case holds always, so those behind it are never reached"
                self._report.error((*place, index), message, "put it last, or give it a `when`", key=True)
        return replace(point, encoding=cases[0].encoding, limits=cases[0].limits, cases=cases)

    def make(self, point: Point, conditions: Conditions) -> Point:
        """The point with its conditions and its selectors."""
        keys = self._layout.keys[point.name]
        only_when = conditions.find(keys.traits.only_when, keys.place("only_when"))
        cases = tuple(
            replace(case, when=when)
            for case, when in zip(point.cases, self._whens(keys, conditions), strict=True)
        )
        return replace(
            point,
            only_when=only_when if point.access.writable else (),
            when=conditions.find(keys.traits.when, keys.place("when")),
            cases=cases,
            select=self._select(keys.traits.select or {}, keys.place("select"), conditions),
        )

    def look_up(self, set_aside: Iterable[Inherited], conditions: Conditions) -> None:
        """Complain about what the keys of points that could not be made say of other points."""
        for keys in set_aside:
            for key in ("only_when", "when"):
                conditions.find(getattr(keys.traits, key), keys.place(key))
            self._whens(keys, conditions)
            self._select(keys.traits.select or {}, keys.place("select"), conditions)

    def _whens(self, keys: Inherited, conditions: Conditions) -> list[Condition]:
        """The condition of each case."""
        place = keys.place("cases")
        return [
            conditions.find(raw.when, (*place, index, "when"))
            for index, raw in enumerate(keys.traits.cases or [])
        ]

    def _case(self, point: Point, keys: Inherited, raw: RawCase, path: Path) -> Case:
        laid = overlay(keys, path, raw)
        cut = point.encoding
        encoding = self._encodings.make(
            laid, (cut.bit, cut.width) if cut.width else None, "low" if cut.active_low else "high"
        )
        span = laid.traits.range
        return Case((), encoding, Limits(span.low, span.high) if span and point.access.writable else None)

    def _check_alike(self, point: Point, first: Case, case: Case, path: Path) -> None:
        """The unit of a point never changes, nor its size or what sort of value it has."""
        for what, ours, theirs in _shared(first.encoding, case.encoding):
            if ours != theirs:
                message = f"the cases of `{point.name}` differ in their {what}: {ours} and {theirs}"
                self._report.error(path, message, "make two points, each with a `when`", key=True)

    def _select(self, raw: Mapping[str, str], path: Path, conditions: Conditions) -> Mapping[str, Constant]:
        values: dict[str, Constant] = {}
        for name, text in raw.items():
            place = (*path, name)
            selector = self._layout.points.get(name)
            conditions.used.add(name)
            if name in self._layout.doubtful:
                continue
            if selector is None:
                remedy = nearest(name, list(self._layout.points))
                self._report.unknown_name(place, name, f"`{name}` is no point", remedy, key=True)
            elif not selector.access.writable or self._layout.keys[name].traits.select:
                message = f"`{name}` cannot select: it is not written, or is selected itself"
                self._report.error(place, message, "name a point that is written directly", key=True)
            else:
                try:
                    values[name] = Constant(single_value(text, selector))
                except FormError as error:
                    self._report.error(place, error.message, error.remedy)
        return MappingProxyType(values)


def _shared(first: Encoding, other: Encoding) -> list[tuple[str, object, object]]:
    return [
        ("unit", first.symbol or "none", other.symbol or "none"),
        ("number of registers", first.words, other.words),
        ("sort of value", first.value_type.value, other.value_type.value),
    ]
