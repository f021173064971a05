"""From the groups of a profile to its points and cut registers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from gateway.mapping import forms
from gateway.mapping.datum import DatumMaker, Entry
from gateway.mapping.encodings import REGISTER, Encodings
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.inherit import Inherited, Level, Sources, inherit
from gateway.mapping.layout import Layout
from gateway.mapping.lost import NAME
from gateway.mapping.model import BitField, Broadcast, Group, Register
from gateway.mapping.node import Path
from gateway.mapping.notation import Notations, Place, UnknownNotationError
from gateway.mapping.profile import Point, Word

_NUMBER = "<n>"
_MOST_REPEATS = 256


class PointMaker:
    """Makes the points of one profile."""

    def __init__(self, notations: Notations, encodings: Encodings, sources: Sources, report: Report) -> None:
        self._notations = notations
        self._encodings = encodings
        self._datum = DatumMaker(encodings, sources, report)
        self._report = report
        self.layout = Layout()

    def add(self, name: str, group: Group | Broadcast, path: Path) -> None:
        """Add all points of a group."""
        self._check_name(name, path)
        for entry, register in group.points.items():
            own = (*path, "points", entry)
            levels: list[Level] = [(path, group), (own, register)]
            place = self._place(register.at, own)
            if place is None or self._report.lost.displaces(own):
                self._set_aside(levels, register.bits or {})
            elif register.bits is None:
                self._add_points(name, place, register, levels)
            else:
                self._add_fields(name, place, register, levels)

    def _set_aside(self, levels: list[Level], fields: Mapping[str, BitField]) -> None:
        """A datum that cannot be made; what it says of other points is still looked at."""
        path = levels[-1][0]
        self._report.lost.doubt(path)
        for name, field in fields.items():
            self._set_aside([*levels, ((*path, "bits", name), field)], {})
        if not fields:
            self._datum.look_up_sources(levels)
            self.layout.set_aside.append(inherit(levels))

    def _add_points(self, group: str, first: Place, register: Register, levels: list[Level]) -> None:
        """A register that is a point, or several by ``repeat``."""
        keys = inherit(levels)
        path = keys.path
        if register.image:
            self._report.error(
                (*path, "image"), "`image` stands on a point without `bits`", "leave it out", key=True
            )
        encoding = self._encodings.make(keys)
        entry = Entry(group, levels, keys, register.help or "")
        stride = register.stride or encoding.words
        for index, name in self._repeated(str(path[-1]), register.repeat, register.stride, path):
            place = self._shifted(first, index * stride, path)
            if place is None:
                break
            point = self._datum.make(name, place, encoding, entry)
            self.layout.keep(
                replace(
                    point,
                    silent=register.silent,
                    twin=register.twin,
                    pause=register.pause or 0.0,
                    sets=register.sets,
                ),
                keys,
            )

    def _add_fields(self, group: str, place: Place, register: Register, levels: list[Level]) -> None:
        """A register that is cut into fields."""
        path = levels[-1][0]
        if register.sets is not None:
            remedy = "leave it out"
            self._report.error((*path, "sets"), "`sets` stands on a register with `bits`", remedy, key=True)
        for index, frame in self._repeated(str(path[-1]), register.repeat, register.stride, path):
            at = self._shifted(place, index * (register.stride or 1), path)
            if at is None:
                for name in register.bits or {}:
                    self._report.lost.declare(name)
                break
            number = None if register.repeat is None else register.repeat[0] + index
            self._check_name(frame, path)
            self._add_word(group, at, register, levels, number)

    def _add_word(
        self, group: str, place: Place, register: Register, levels: list[Level], number: int | None
    ) -> None:
        """One cut register; ``number`` fills the names of its fields when the register is repeated."""
        path = levels[-1][0]
        word = Word(place.address, register.image, shift=inherit(levels).traits.shift)
        pause = register.pause or 0.0
        for name, raw in (register.bits or {}).items():
            own: Level = ((*path, "bits", name), raw)
            if self._report.lost.displaces(own[0]):
                self._set_aside([*levels, own], {})
                continue
            if number is not None and not self._numbered(name, raw, own[0]):
                continue
            filled = name if number is None else name.replace(_NUMBER, str(number))
            word = self._add_field(word, filled, raw, place, _entry(group, [*levels, own], raw), pause)
        self.layout.keep_word(word)

    def _numbered(self, name: str, raw: BitField, path: Path) -> bool:
        """True when a field of a repeated register gets a name of its own in each of them."""
        if raw.repeat is not None:
            message = f"`{name}` is repeated in a register that is repeated"
            self._report.error((*path, "repeat"), message, "write each register down", key=True)
            self._report.lost.declare(name)
            return False
        if _NUMBER not in name and raw.always is None:
            message = f"`{name}` stands in a register that is repeated, and has no `<n>` in its name"
            self._report.error(path, message, "add <n>", key=True)
            self._report.lost.declare(name)
            return False
        return True

    def _add_field(
        self, word: Word, called: str, raw: BitField, place: Place, entry: Entry, pause: float
    ) -> Word:
        """One field, or several by ``repeat``; gives back the word with what it adds."""
        first, width = raw.bit
        path = entry.keys.path
        for index, name in self._repeated(called, raw.repeat, raw.stride, path):
            bit = first + index * (raw.stride or width)
            if bit + width > REGISTER:
                remedy = "correct `bit`, `repeat` or `stride`"
                self._report.error(path, f"`{name}` ends beyond bit 15", remedy, key=True)
                self._report.lost.declare(called)
                break
            if raw.always is not None:
                self.layout.claim_constant(name, path, place, (bit, width))
                word = self._constant(word, raw.always, (bit, width), path)
            else:
                encoding = self._encodings.make(entry.keys, (bit, width), raw.active)
                point = self._datum.make(name, place, encoding, entry)
                word = self._with_field(word, replace(point, pulse=raw.pulse or 0.0, pause=pause), entry.keys)
        return word

    def _constant(self, word: Word, value: int, bits: tuple[int, int], path: Path) -> Word:
        """The word with the bits (first and width) that every write lays over it."""
        bit, width = bits
        if not 0 <= value < 1 << width:
            self._report.error((*path, "always"), f"{value} does not fit a width of {width}", "correct it")
            return word
        mask = (1 << width) - 1 << bit
        return replace(word, always_mask=word.always_mask | mask, always_bits=word.always_bits | value << bit)

    def _with_field(self, word: Word, point: Point, keys: Inherited) -> Word:
        """Keep the point of a field, and the word with it."""
        if not self.layout.keep(point, keys):
            return word
        cut = point.encoding
        mask = (1 << cut.width) - 1 << cut.bit if point.pulse else 0
        if point.pulse and not point.access.writable:
            message, remedy = (
                "`pulse` stands on a field that is never written",
                "give it a kind that is written",
            )
            self._report.error((*keys.path, "pulse"), message, remedy, key=True)
        return replace(word, pulse_mask=word.pulse_mask | mask, fields=(*word.fields, point.name))

    def _repeated(
        self, entry: str, numbers: tuple[int, int] | None, stride: int | None, path: Path
    ) -> Iterator[tuple[int, str]]:
        """Index and name of each repeat; one, if there is no ``repeat``."""
        if numbers is None and stride:
            self._report.error((*path, "stride"), "`stride` without `repeat`", "leave it out", key=True)
        if (numbers is not None) != (_NUMBER in entry):
            message = f"`{entry}`: `<n>` in the name and `repeat` belong together"
            self._report.error(path, message, "write both or none", key=True)
            self._report.lost.declare(entry if numbers is None else f"{entry}{_NUMBER}")
            self._report.lost.declare(entry)
            return
        first, last = numbers or (0, 0)
        if first < 0 or last - first >= _MOST_REPEATS:
            message = f"at most {_MOST_REPEATS} repeats, numbered from 0 on"
            self._report.error((*path, "repeat"), message, "write fewer")
            self._report.lost.declare(entry)
            return
        self._check_name(entry.replace(_NUMBER, "0"), path)
        for index in range(last - first + 1):
            yield index, entry.replace(_NUMBER, str(first + index))

    def _check_name(self, name: str, path: Path) -> None:
        try:
            forms.name(name)
        except FormError as error:
            self._report.error((*path, NAME), error.message, error.remedy, key=True)

    def _place(self, text: str, path: Path) -> Place | None:
        """The place of an address; None, with a finding, when it is none."""
        try:
            return self._notations.find(text)
        except FormError as error:
            self._misplaced(error, path)
            return None

    def _shifted(self, place: Place, distance: int, path: Path) -> Place | None:
        try:
            return self._notations.shifted(place, distance)
        except FormError as error:
            self._misplaced(error, path)
            self._report.lost.declare(str(path[-1]))
            return None

    def _misplaced(self, error: FormError, path: Path) -> None:
        if not isinstance(error, UnknownNotationError):
            self._report.error((*path, "at"), error.message, error.remedy)


def _entry(group: str, levels: list[Level], raw: BitField) -> Entry:
    return Entry(group, levels, inherit(levels), raw.help or "")
