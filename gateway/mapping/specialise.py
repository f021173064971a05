"""A profile for one drive instance: what its settings alone decide is decided. Pure.

Afterwards only conditions on points remain, which the core looks at while it runs.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from types import MappingProxyType

from gateway.mapping.condition import Condition, Term
from gateway.mapping.device import CommLoss
from gateway.mapping.profile import Access, Case, Command, Point, Profile, Step, Word

Settings = Mapping[str, Fraction]


def specialise(profile: Profile, settings: Settings) -> Profile:
    """The profile of a drive with these settings, all of which are given.

    Addresses are shifted. Terms on settings that hold are dropped. Cases and points that a setting rules
    out are left out, and so is everything that leans on them; a case that nothing else decides becomes
    the point's own meaning. Conditions of commands and preconditions keep their settings, so that a
    refusal can name them. A profile in which the settings decide nothing comes back as it is.
    """
    points = _points(profile, settings)
    there = _There(settings, points)
    commands = {c.name: made for c in profile.commands.values() if (made := there.command(c)) is not None}
    special = replace(
        profile,
        points=MappingProxyType({name: _followed(point, points, commands) for name, point in points.items()}),
        words=MappingProxyType({word.address: word for word in _words(profile, points, settings)}),
        commands=MappingProxyType(commands),
        modbus=replace(
            profile.modbus,
            probe=_probe(profile.modbus.probe, points),
            identity=tuple(term for term in profile.modbus.identity if term.name in points),
            holes=tuple(_holes(profile.modbus.holes, points.values())),
        ),
        serial=replace(profile.serial, comm_loss=_comm_loss(profile.serial.comm_loss, settings)),
    )
    return profile if special == profile else special


def left(condition: Condition, settings: Settings, names: Collection[str] | None = None) -> Condition | None:
    """What remains of a condition once its settings are known; None when it can never hold: a setting
    speaks against it, or it is about a point that is not among ``names``."""
    remaining: list[Term] = []
    for term in condition:
        if not term.setting:
            if names is not None and term.name not in names:
                return None
            remaining.append(term)
        elif not any(low <= settings[term.name] <= high for low, high in term.ranges):
            return None
    return tuple(remaining)


def shifted(address: int, shift: str | None, settings: Settings) -> int:
    """An address with the setting that ``shift`` names added to it."""
    return address if shift is None else address + int(settings[shift])


def _points(profile: Profile, settings: Settings) -> dict[str, Point]:
    """The points that this drive has. One that is left out may take others with it."""
    names: Collection[str] = profile.points.keys()
    while True:
        there = _There(settings, names)
        found = {p.name: made for p in profile.points.values() if (made := there.point(p)) is not None}
        if found.keys() == set(names):
            return found
        names = found.keys()


@dataclass(frozen=True, slots=True)
class _There:
    """Settings of a drive, and the names of the points that it has."""

    settings: Settings
    names: Collection[str] | Mapping[str, Point]

    def point(self, point: Point) -> Point | None:
        """The point as this drive has it; None when it has not."""
        when = left(point.when, self.settings, self.names)
        if when is None or not self._known(point.select):
            return None
        address = shifted(point.address, point.shift, self.settings)
        notation = point.notation if address == point.address else f"{address:04X}H"
        made = replace(point, when=when, address=address, notation=notation, shift=None)
        cased = self._with_cases(made) if point.cases else made
        if cased is None or not self._known([cased.encoding.times]):
            return None
        return cased if self._may_be_written(cased) else _read_only(cased)

    def command(self, command: Command) -> Command | None:
        """The command without the steps that a setting rules out; None for one that this drive cannot do."""
        steps = tuple(made for step in command.steps if (made := self._step(step)) is not None)
        written = [name for step in steps for name in step.write]
        assert isinstance(self.names, Mapping)
        if not steps or not all(name in self.names and self.names[name].access.writable for name in written):
            return None
        terms = [*command.only_when, *(term for step in steps for term in (*step.when, *step.until))]
        if not self._known(term.name for term in terms if not term.setting):
            return None
        return replace(command, steps=steps) if self._known(command.args.values()) else None

    def _step(self, step: Step) -> Step | None:
        when = left(step.when, self.settings, self.names)
        return None if when is None else replace(step, when=when)

    def _with_cases(self, point: Point) -> Point | None:
        cases: list[Case] = []
        for case in point.cases:
            when = left(case.when, self.settings, self.names)
            if when is not None and self._known([case.encoding.times]):
                cases.append(replace(case, when=when))
            if when == ():
                break
        if not cases:
            return None
        meant = replace(point, encoding=cases[0].encoding, limits=cases[0].limits)
        return replace(meant, cases=() if not cases[0].when else tuple(cases))

    def _may_be_written(self, point: Point) -> bool:
        """False when a limit or a precondition leans on what this drive has not."""
        limits = [point.limits, *(case.limits for case in point.cases)]
        bounds = [bound for span in limits if span is not None for bound in (span.low, span.high)]
        needed = [term.name for term in point.only_when if not term.setting]
        return self._known([*(bound for bound in bounds if isinstance(bound, str)), *needed])

    def _known(self, names: Iterable[str | None]) -> bool:
        return all(name is None or name in self.settings or name in self.names for name in names)


def _read_only(point: Point) -> Point | None:
    """The point without what belongs to writing; None when then nothing is left of it."""
    if not point.access.readable:
        return None
    return replace(
        point,
        access=Access.READ,
        role=None,
        by_command_only=False,
        limits=None,
        cases=tuple(replace(case, limits=None) for case in point.cases),
        only_when=(),
        then=None,
    )


def _followed(point: Point, points: Collection[str], commands: Collection[str]) -> Point:
    """The point without a twin or a following command that this drive has not."""
    return replace(
        point,
        twin=point.twin if point.twin in points else None,
        then=point.then if point.then in commands else None,
    )


def _words(profile: Profile, points: Mapping[str, Point], settings: Settings) -> list[Word]:
    words = (_word(word, points, settings) for word in profile.words.values())
    return [word for word in words if word.fields]


def _word(word: Word, points: Mapping[str, Point], settings: Settings) -> Word:
    """The word as this drive has it. A bit that is a pulse under other settings only is kept in the image."""
    fields = tuple(name for name in word.fields if name in points)
    pulses = 0
    for name in fields:
        cut = points[name].encoding
        pulses |= ((1 << cut.width) - 1) << cut.bit if points[name].pulse else 0
    address = shifted(word.address, word.shift, settings)
    return replace(word, address=address, shift=None, fields=fields, pulse_mask=pulses)


def _probe(probe: str, points: Mapping[str, Point]) -> str:
    """The probe, or another point where a setting has left it out."""
    if probe == "loop_back" or probe in points:
        return probe
    return next((point.name for point in points.values() if point.access.readable), "")


def _holes(holes: Iterable[tuple[int, int]], points: Iterable[Point]) -> Iterator[tuple[int, int]]:
    """The holes without the registers to which a setting has moved points."""
    taken = {point.address + index for point in points for index in range(point.words)}
    for first, last in holes:
        free = [address for address in range(first, last + 1) if address not in taken]
        starts = [address for address in free if address - 1 not in free]
        ends = [address for address in free if address + 1 not in free]
        yield from zip(starts, ends, strict=True)


def _comm_loss(loss: CommLoss, settings: Settings) -> CommLoss:
    """Without an action where the settings say that the drive does not look at the line."""
    when = left(loss.when, settings)
    if when is None:
        return CommLoss(when=loss.when, stops_when=loss.stops_when, blind=True)
    after = settings.get(loss.after_from) if loss.after_from else None
    return replace(loss, when=when) if after is None else replace(loss, when=when, after=float(after))
