"""One point out of the keys that hold for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal, cast

from gateway.mapping import forms
from gateway.mapping.encodings import Encodings, raw_span
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.inherit import Inherited, Level, Sources
from gateway.mapping.kinds import KINDS
from gateway.mapping.model import NamedValue
from gateway.mapping.node import Path
from gateway.mapping.notation import Place
from gateway.mapping.profile import FREELY, Encoding, Kind, Limits, Pace, Point, Provenance


@dataclass(frozen=True, slots=True)
class Entry:
    """The place of a point in the file: group, tables that it stands in, keys that hold, its own help."""

    group: str
    levels: list[Level]
    keys: Inherited
    help: str


class DatumMaker:
    """Makes the single points of one profile."""

    def __init__(self, encodings: Encodings, sources: Sources, report: Report) -> None:
        self._encodings = encodings
        self._sources = sources
        self._report = report

    def make(self, name: str, place: Place, encoding: Encoding, entry: Entry) -> Point:
        """The point with the defaults of its kind."""
        keys, traits = entry.keys, entry.keys.traits
        named = self._encodings.values(traits.values, keys.place("values")).entries
        kind = traits.kind or Kind.STATUS
        defaults = KINDS[kind]
        access = traits.access or defaults.access
        if access.writable and defaults.role is None:
            remedy = "choose setpoint, switch, command or parameter"
            self._report.error(keys.place("access"), f"kind `{kind}` is never written", remedy)
        return Point(
            name=name,
            group=entry.group,
            kind=kind,
            access=access,
            rate=traits.rate or defaults.rate,
            address=place.address,
            table=place.table,
            notation=place.text,
            encoding=encoding,
            limits=Limits(traits.range.low, traits.range.high) if traits.range and access.writable else None,
            role=defaults.role if access.writable else None,
            by_command_only=kind is Kind.COMMAND and access.writable,
            shift=traits.shift,
            then=traits.then if access.writable else None,
            wear=None if traits.wear == "none" else cast("int | Literal['unknown'] | None", traits.wear),
            pace=Pace(traits.step, traits.slew, traits.interval or 0.0) if access.writable else FREELY,
            danger=self._danger(traits.danger or {}, encoding, keys.place("danger")),
            help=entry.help,
            provenance=self._provenance(entry, named),
            names=self._sources.names(named, entry.levels),
        )

    def look_up_sources(self, levels: list[Level]) -> None:
        """Complain about documents that are not there."""
        self._sources.of(levels)

    def _provenance(self, entry: Entry, named: Mapping[int, Level]) -> Provenance:
        """Where the point comes from; doubts of single names of its values are added to its own."""
        own = self._sources.of(entry.levels)
        doubts = [own.doubt] if own.doubt else []
        doubts += [text for level in named.values() if (text := self._doubt(level, entry.levels))]
        return replace(own, doubt="; ".join(doubts) or None)

    def _doubt(self, level: Level, levels: list[Level]) -> str:
        """What is doubtful about one named value, in words."""
        value = level[1]
        assert isinstance(value, NamedValue)
        if value.source is None and value.doubt is None:
            return ""
        origin = self._sources.of([*levels, level])
        similar = f"from {origin.document} {origin.place}, a similar model" if origin.similar else ""
        reasons = ", ".join(text for text in (similar, value.doubt) if text)
        return f"{value.name}: {reasons}" if reasons else ""

    def _danger(self, table: Mapping[str, str], encoding: Encoding, path: Path) -> Mapping[int, str]:
        """Each raw value that does harm, and what it does."""
        result: dict[int, str] = {}
        for key, text in table.items():
            span = self._danger_span(key, encoding, (*path, key))
            if span is not None:
                result.update(dict.fromkeys(range(span[0], span[1] + 1), text))
        return MappingProxyType(result)

    def _danger_span(self, key: str, encoding: Encoding, path: Path) -> tuple[int, int] | None:
        try:
            low, high = forms.integers_span(key)
        except FormError as error:
            self._report.error(path, error.message, error.remedy, key=True)
            return None
        least, most = raw_span(encoding) or (0, 0)
        if low < least or high > min(most, 0xFFFF):
            message = f"`{key}` does not fit: the raw value can be {least} to {most}"
            self._report.error(path, message, "correct it", key=True)
            return None
        if encoding.values and not any(low <= raw <= high for raw in encoding.values):
            message = f"`{key}` has no name in `values`, so it is never written"
            self._report.error(path, message, "name it, or leave it out", key=True)
            return None
        return low, high
