"""From the section ``simulate`` of a file to its facts: names looked up, addresses and values found."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from types import MappingProxyType
from typing import Any

from gateway.mapping import forms
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.node import Path
from gateway.mapping.notation import Notations
from gateway.mapping.profile import Bound, Condition, Constant, Point, Setting
from gateway.mapping.shape import nearest
from gateway.mapping.simulate import RawExternal, RawSimulate, Terms
from gateway.mapping.twin import SHOWN, External, Lock, Simulate
from gateway.mapping.values import Conditions, single_value

SECTION = "simulate"
_FREQUENCIES = ("max_frequency", "base_frequency")
_TIMES = ("acceleration", "deceleration", "fast_deceleration")
_POINTS = ("panel_frequency", "reset", "activates", "stores")
_CONDITIONS = (
    "run_when",
    "frequency_when",
    "panel_frequency_when",
    "coast_when",
    "forward_only_when",
    "initialise_when",
    "reset_when",
)
_PLAIN = ("actions", "comm_timeout", "refuses", "saving", "restart_time")


class TwinMaker:
    """Resolves the section of one profile. What cannot be found is complained about and left out."""

    def __init__(
        self,
        points: Mapping[str, Point],
        settings: Mapping[str, Setting],
        notations: Notations,
        conditions: Conditions,
        report: Report,
    ) -> None:
        self._points = points
        self._settings = settings
        self._notations = notations
        self._conditions = conditions
        self._report = report
        self._groups = {point.group for point in points.values()}

    def make(self, raw: RawSimulate | None) -> Simulate | None:
        """The facts of the section; None when the file has none."""
        if raw is None:
            return None
        facts: dict[str, Any] = {key: getattr(raw, key) for key in _PLAIN if key in raw.model_fields_set}
        for key in (*_FREQUENCIES, *_TIMES):
            if (text := getattr(raw, key)) is not None:
                facts[key] = self._amount(text, key)
        for key in _POINTS:
            if (name := getattr(raw, key)) is not None:
                facts[key] = self._known(name, self._points, (SECTION, key))
        for key in _CONDITIONS:
            facts[key] = self._condition(getattr(raw, key), (SECTION, key))
        return Simulate(**facts, **self._tables(raw))

    def _tables(self, raw: RawSimulate) -> dict[str, Any]:
        return {
            "factory": MappingProxyType(self._factory(raw.factory)),
            "units": MappingProxyType(
                {n: (unit.scale, unit.symbol) for n, unit in raw.units.items() if self._key("units", n)}
            ),
            "shows": MappingProxyType(self._shows(raw.shows)),
            "codes": MappingProxyType(self._codes(raw.codes)),
            "history": tuple(self._listed(raw.history, self._points, (SECTION, "history"))),
            "alarms": MappingProxyType(dict(raw.alarms)),
            "external_fault": self._external(raw.external_fault, raw.alarms),
            "locks": tuple(self._locks(raw)),
            "restarts": MappingProxyType(self._restarts(raw.restarts)),
        }

    def _amount(self, text: str, key: str) -> Bound:
        """A number (a time for ramps), or the name of a point or setting."""
        try:
            forms.name(text)
        except FormError:
            return self._number(text, key)
        self._known(text, {**self._points, **self._settings}, (SECTION, key))
        self._conditions.used.add(text)
        return text

    def _number(self, text: str, key: str) -> Fraction:
        try:
            return Fraction(str(forms.duration(text))) if key in _TIMES else forms.number(text)
        except FormError as error:
            self._report.error((SECTION, key), error.message, error.remedy)
            return Fraction(1)

    def _factory(self, rows: Mapping[str, list[str]]) -> dict[int, int]:
        found: dict[int, int] = {}
        for text, row in rows.items():
            path: Path = (SECTION, "factory", text)
            try:
                first = self._notations.find(text).address
                found |= {first + index: _word(value) for index, value in enumerate(row)}
            except FormError as error:
                self._report.error(path, error.message, error.remedy, key=True)
        return found

    def _shows(self, raw: Mapping[str, list[str]]) -> dict[str, tuple[str, ...]]:
        sources = dict.fromkeys([*SHOWN, *self._points])
        return {
            name: tuple(self._listed(what, sources, (SECTION, "shows", name)))
            for name, what in raw.items()
            if self._key("shows", name)
        }

    def _codes(self, raw: Mapping[str, Mapping[str, int]]) -> dict[str, Mapping[int, int]]:
        found: dict[str, Mapping[int, int]] = {}
        for name, table in raw.items():
            if not self._key("codes", name):
                continue
            try:
                found[name] = MappingProxyType({forms.integer(key): code for key, code in table.items()})
            except FormError as error:
                self._report.error((SECTION, "codes", name), error.message, error.remedy)
        return found

    def _external(self, raw: RawExternal | None, alarms: Mapping[str, int]) -> External | None:
        if raw is None:
            return None
        place: Path = (SECTION, "external_fault")
        self._known(raw.trips, {**self._points, **alarms}, (*place, "trips"))
        if raw.by is not None:
            self._known(raw.by, self._points, (*place, "by"))
        if raw.action is not None:
            self._known(raw.action, {**self._points, **self._settings}, (*place, "action"))
        return External(raw.trips, raw.by, raw.action)

    def _locks(self, raw: RawSimulate) -> Iterable[Lock]:
        known = dict.fromkeys([*self._points, *self._groups])
        for index, lock in enumerate(raw.locks):
            place: Path = (SECTION, "locks", index)
            what = self._listed(lock.what, known, (*place, "what"))
            yield Lock(self._condition(lock.when, (*place, "when")), tuple(what), lock.reason)

    def _restarts(self, raw: Mapping[str, str]) -> dict[str, Constant]:
        found = {}
        for name, text in raw.items():
            if self._key("restarts", name):
                try:
                    found[name] = Constant(single_value(text, self._points[name]))
                except FormError as error:
                    self._report.error((SECTION, "restarts", name), error.message, error.remedy)
        return found

    def _condition(self, raw: Terms | None, path: Path) -> Condition:
        return self._conditions.find(
            {name: values[0] if len(values) == 1 else values for name, values in (raw or {}).items()}, path
        )

    def _listed(self, names: Iterable[str], known: Mapping[str, object], path: Path) -> list[str]:
        return [name for i, name in enumerate(names) if self._known(name, known, (*path, i))]

    def _key(self, table: str, name: str) -> str | None:
        return self._known(name, self._points, (SECTION, table, name), key=True)

    def _known(self, name: str, known: Mapping[str, object], path: Path, *, key: bool = False) -> str | None:
        """The name, or None with a finding when nothing is called so."""
        if name in known:
            return name
        self._report.unknown_name(path, name, f"there is no `{name}`", nearest(name, list(known)), key=key)
        return None


def _word(text: str) -> int:
    """The contents of one register."""
    word = forms.integer(text)
    if not 0 <= word <= 0xFFFF:
        raise FormError(f"`{text}` does not fit a register", "write 0 to FFFFH")
    return word
