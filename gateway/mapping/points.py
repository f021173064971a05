"""From the groups of a profile to its points and cut registers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal, cast

from gateway.mapping import forms
from gateway.mapping.encodings import Encodings, raw_span
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.inherit import Inherited, Level, Sources, inherit
from gateway.mapping.kinds import KINDS
from gateway.mapping.model import BitField, Group, NamedValue, Register
from gateway.mapping.node import Path
from gateway.mapping.notation import Notations, Place
from gateway.mapping.profile import Encoding, Kind, Limits, Point, Provenance, Table, Word

_NUMBER = "<n>"
_REGISTER = 16


@dataclass(frozen=True, slots=True)
class Claim:
    """Bits of a table that an entry occupies; bit 0 of register 1 is bit 16."""

    table: Table
    first: int
    last: int
    name: str
    path: Path
    reads: bool
    writes: bool


@dataclass(slots=True)
class Layout:
    """The points of a profile, where their keys are written, and what they occupy."""

    points: dict[str, Point] = field(default_factory=dict)
    keys: dict[str, Inherited] = field(default_factory=dict)
    words: dict[int, Word] = field(default_factory=dict)
    claims: list[Claim] = field(default_factory=list)
    names: list[tuple[str, Path]] = field(default_factory=list)


class PointMaker:
    """Makes the points of one profile."""

    def __init__(self, notations: Notations, encodings: Encodings, sources: Sources, report: Report) -> None:
        self._notations = notations
        self._encodings = encodings
        self._sources = sources
        self._report = report
        self.layout = Layout()

    def add(self, name: str, group: Group) -> None:
        """Add all points of a group."""
        path: Path = ("groups", name)
        self._check_name(name, path)
        for entry, register in group.points.items():
            own = (*path, "points", entry)
            levels: list[Level] = [(path, group), (own, register)]
            if register.bits is None:
                self._add_points(name, entry, register, levels)
            else:
                self._add_fields(name, entry, register, levels)

    def _add_points(self, group: str, entry: str, register: Register, levels: list[Level]) -> None:
        """A register that is a point, or several by ``repeat``."""
        keys = inherit(levels)
        if register.image:
            self._report.error(
                (*keys.path, "image"), "`image` stands on a point without `bits`", "leave it out"
            )
        first = self._place(register.at, keys.path)
        if first is None:
            return
        encoding = self._encodings.make(keys)
        stride = register.stride or encoding.words
        for index, name in self._repeated(entry, register.repeat, keys.path):
            place = self._shifted(first, index * stride, keys.path)
            if place is not None:
                help_ = register.help or ""
                self._keep(self._point(name, group, place, encoding, keys, levels, help_), keys)

    def _add_fields(self, group: str, entry: str, register: Register, levels: list[Level]) -> None:
        """A register that is cut into fields."""
        path = levels[-1][0]
        place = self._place(register.at, path)
        self._check_name(entry, path)
        if register.repeat or register.stride:
            self._report.error(
                (*path, "repeat"),
                "`repeat` beside `bits` is not supported by this version",
                "write each register down",
            )
        if place is None or register.bits is None:
            return
        word = Word(place.address, register.image)
        for name, bit_field in register.bits.items():
            own = (*path, "bits", name)
            word = self._add_field(word, group, name, bit_field, place, [*levels, (own, bit_field)])
        self._keep_word(word)

    def _add_field(
        self, word: Word, group: str, entry: str, raw: BitField, place: Place, levels: list[Level]
    ) -> Word:
        """One field, or several by ``repeat``; gives back the word with what it adds."""
        keys = inherit(levels)
        first, width = raw.bit
        for index, name in self._repeated(entry, raw.repeat, keys.path):
            bit = first + index * (raw.stride or width)
            if bit + width > _REGISTER:
                self._report.error(
                    keys.path, f"`{name}` ends beyond bit 15", "correct `bit`, `repeat` or `stride`"
                )
            elif raw.always is not None:
                self._claim(name, keys.path, place, bit, width, reads=True, writes=True)
                word = self._constant(word, raw, bit, width, keys)
            else:
                encoding = self._encodings.make(keys, (bit, width), raw.active)
                point = self._point(name, group, place, encoding, keys, levels, raw.help or "")
                word = self._field_of(word, replace(point, pulse=raw.pulse or 0.0), keys)
        return word

    def _constant(self, word: Word, raw: BitField, bit: int, width: int, keys: Inherited) -> Word:
        """The word with the bits that every write lays over it."""
        value = raw.always or 0
        if not 0 <= value < 1 << width:
            self._report.error((*keys.path, "always"), f"{value} does not fit {width} bits", "correct it")
            return word
        mask = (1 << width) - 1 << bit
        return replace(word, always_mask=word.always_mask | mask, always_bits=word.always_bits | value << bit)

    def _field_of(self, word: Word, point: Point, keys: Inherited) -> Word:
        """Keep the point of a field, and the word with it."""
        if not self._keep(point, keys):
            return word
        cut = point.encoding
        mask = (1 << cut.width) - 1 << cut.bit if point.pulse else 0
        if point.pulse and not point.access.writable:
            self._report.error(
                (*keys.path, "pulse"),
                "`pulse` stands on a field that is never written",
                "leave it out, or give it a kind that is written",
            )
        return replace(word, pulse_mask=word.pulse_mask | mask, fields=(*word.fields, point.name))

    def _point(
        self,
        name: str,
        group: str,
        place: Place,
        encoding: Encoding,
        keys: Inherited,
        levels: list[Level],
        help_: str,
    ) -> Point:
        traits = keys.traits
        kind = traits.kind or Kind.STATUS
        defaults = KINDS[kind]
        access = traits.access or defaults.access
        if access.writable and defaults.role is None:
            self._report.error(
                keys.place("access"),
                f"kind `{kind}` is never written",
                "choose setpoint, switch, command or parameter",
            )
        return Point(
            name=name,
            group=group,
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
            wear=cast("int | Literal['unknown'] | None", traits.wear),
            danger=self._danger(traits.danger or {}, encoding, keys.place("danger")),
            help=help_,
            provenance=self._provenance(keys, levels),
        )

    def _provenance(self, keys: Inherited, levels: list[Level]) -> Provenance:
        """Where the point comes from; doubts of single names of its values are added to its own."""
        own = self._sources.of(levels)
        table = keys.traits.values if isinstance(keys.traits.values, dict) else {}
        doubts = [own.doubt] if own.doubt else []
        doubts += [text for entry in table.values() if (text := self._doubt(entry, keys))]
        return replace(own, doubt="; ".join(doubts) or None)

    def _doubt(self, entry: NamedValue, keys: Inherited) -> str:
        """What is doubtful about one named value, in words."""
        if entry.source is None and entry.doubt is None:
            return ""
        origin = self._sources.of([(keys.path, entry)])
        similar = f"from {origin.document} {origin.place}, a similar model" if origin.similar else ""
        reasons = ", ".join(text for text in (similar, entry.doubt) if text)
        return f"{entry.name}: {reasons}" if reasons else ""

    def _danger(self, table: Mapping[str, str], encoding: Encoding, path: Path) -> Mapping[int, str]:
        result: dict[int, str] = {}
        span = raw_span(encoding) or (0, 0)
        for key, text in table.items():
            try:
                low, high = forms.integers_span(key)
            except FormError as error:
                self._report.error((*path, key), error.message, error.remedy, key=True)
                continue
            if low < span[0] or high > min(span[1], 0xFFFF):
                self._report.error(
                    (*path, key),
                    f"`{key}` does not fit: the raw value can be {span[0]} to {span[1]}",
                    "correct it",
                    key=True,
                )
                continue
            result.update(dict.fromkeys(range(low, high + 1), text))
        return MappingProxyType(result)

    def _keep(self, point: Point, keys: Inherited) -> bool:
        """Add a point; False when its name is taken (which is told with all names)."""
        self.layout.names.append((point.name, keys.path))
        cut = point.encoding
        width = cut.width or _REGISTER * cut.words
        place = Place(point.table, point.address, point.notation)
        reads, writes = point.access.readable, point.access.writable
        self._claim(point.name, keys.path, place, cut.bit, width, reads=reads, writes=writes)
        if point.name in self.layout.points:
            return False
        self.layout.points[point.name] = point
        self.layout.keys[point.name] = keys
        return True

    def _claim(
        self, name: str, path: Path, place: Place, bit: int, width: int, *, reads: bool, writes: bool
    ) -> None:
        first = place.address * _REGISTER + bit
        self.layout.claims.append(Claim(place.table, first, first + width - 1, name, path, reads, writes))

    def _keep_word(self, word: Word) -> None:
        """Add a cut register; where one address is cut twice, the cut that is written is kept."""
        points = self.layout.points
        written = any(points[name].access.writable for name in word.fields)
        if written or word.address not in self.layout.words:
            self.layout.words[word.address] = word

    def _repeated(self, entry: str, numbers: tuple[int, int] | None, path: Path) -> Iterator[tuple[int, str]]:
        """Index and name of each repeat; one, if there is no ``repeat``."""
        if (numbers is not None) != (_NUMBER in entry):
            self._report.error(
                path,
                f"`{entry}`: `<n>` in the name and `repeat` belong together",
                "write both or none",
                key=True,
            )
            return
        first, last = numbers or (0, 0)
        if first < 0 or last > 0xFFFF:
            self._report.error((*path, "repeat"), "numbers of repeats go from 0 to 65535", "correct them")
            return
        self._check_name(entry.replace(_NUMBER, "0"), path)
        for index in range(last - first + 1):
            yield index, entry.replace(_NUMBER, str(first + index))

    def _check_name(self, name: str, path: Path) -> None:
        try:
            forms.name(name)
        except FormError as error:
            self._report.error(path, error.message, error.remedy, key=True)

    def _place(self, text: str, path: Path) -> Place | None:
        try:
            return self._notations.find(text)
        except FormError as error:
            self._report.error((*path, "at"), error.message, error.remedy)
            self._report.partial = True
            return None

    def _shifted(self, place: Place, distance: int, path: Path) -> Place | None:
        try:
            return self._notations.shifted(place, distance)
        except FormError as error:
            self._report.error((*path, "at"), error.message, error.remedy)
            self._report.partial = True
            return None
