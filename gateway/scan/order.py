"""In which order settings and units are tried, with which reads, and how long that takes at most. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from gateway.mapping.profile import Kind, Point, Profile, SerialFormat
from gateway.modbus.framing import FramingName, framing_of
from gateway.modbus.timing import Timing, timing_of
from gateway.scan.ask import Ask, as_delivered, is_plain

PortKind = Literal["serial", "pseudo", "network", "modbus"]
"""A real port; a pseudo terminal, which carries neither parity nor data bits; a serial line behind a network
connection, whose speed and format are set at the far end; Modbus TCP."""

USUAL_UNITS = range(1, 32)
"""Units that are tried unless others are named: what a line without repeaters can carry."""
NETWORK = (9600, SerialFormat(8, "N", 2))
"""What is assumed of the line behind a network port; only the silences follow from it."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One way in which a line can be set. ``serial`` is False where speed and format are the far end's.
    ``blind``: the port does not carry parity and data bits, so that any format with as many stop bits is
    meant."""

    framing: FramingName
    baud: int = NETWORK[0]
    format: SerialFormat = NETWORK[1]
    serial: bool = True
    blind: bool = False

    def __str__(self) -> str:
        if not self.serial:
            return self.framing
        form = f"8?{self.format.stop_bits}" if self.blind else str(self.format)
        return f"{self.baud} {form} {self.framing}"

    @property
    def as_seen(self) -> Setting:
        """The setting that stands for all that a pseudo terminal cannot tell from it."""
        return replace(self, format=SerialFormat(8, "N", self.format.stop_bits), blind=True)

    def known_to(self, profile: Profile) -> bool:
        """A drive of this model can be set so, as far as that shows."""
        return self.baud in profile.serial.baud and bool(self._possible(profile))

    def format_for(self, profile: Profile) -> SerialFormat:
        """The format to write into a site file for a drive of this model that answered so."""
        possible = self._possible(profile)
        return self.format if self.format in possible or not possible else possible[0]

    def _possible(self, profile: Profile) -> list[SerialFormat]:
        """The formats of a model in which it would have answered."""
        formats = profile.serial.ascii if self.framing == "ascii" else profile.serial.rtu
        seen = self.format.data_bits, self.format.parity
        return [form for form in formats if self.blind or (form.data_bits, form.parity) == seen]

    @property
    def alike(self) -> tuple[object, ...]:
        """What a receiver can tell apart: stop bits are not among it, for a second one is only silence."""
        return self.framing, self.baud, self.format.data_bits, self.format.parity


@dataclass(frozen=True, slots=True)
class Narrowed:
    """What the user chose himself; empty: everything that the profiles know."""

    framings: tuple[FramingName, ...] = ()
    bauds: tuple[int, ...] = ()
    formats: tuple[SerialFormat, ...] = ()
    units: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Round:
    """One setting with the units that are tried in it, and the reads that each of them gets."""

    setting: Setting
    units: tuple[int, ...]
    asks: tuple[Ask, ...]
    timing: Timing

    def seconds(self, patience: float) -> float:
        """How long it takes if nobody answers."""
        size = framing_of(self.setting.framing).size
        each = (self.timing.transaction(size(5), size(2 + 2 * ask.count), patience) for ask in self.asks)
        return len(self.units) * sum(each)


@dataclass(frozen=True, slots=True)
class Plan:
    """A whole scan. ``profiles`` are those that are thought of, as delivered. ``patience``: seconds that a
    unit has until its reply begins. ``all_rounds``: go on after a setting in which somebody answered."""

    rounds: tuple[Round, ...]
    profiles: tuple[Profile, ...]
    patience: float
    all_rounds: bool = False
    forbidden: frozenset[int] = field(default_factory=frozenset)
    """Registers that some profile says must never be read."""

    @property
    def asks(self) -> int:
        """Requests if nobody answers."""
        return sum(len(each.units) * len(each.asks) for each in self.rounds)

    @property
    def seconds(self) -> float:
        """How long it takes if nobody answers."""
        return sum(each.seconds(self.patience) for each in self.rounds)


def make_plan(
    profiles: Sequence[Profile],
    narrowed: Narrowed,
    patience: float,
    port: PortKind = "serial",
    all_rounds: bool = False,
) -> Plan:
    """The order of a scan."""
    profiles = [as_delivered(profile) for profile in profiles]
    forbidden = frozenset(a for p in profiles for low, high in p.modbus.holes for a in range(low, high + 1))
    if port in ("network", "modbus"):
        ranked = _beyond(profiles, narrowed, port)
    else:
        ranked = _ranked(profiles, narrowed, port == "pseudo")
    gap = max((profile.serial.gap for profile in profiles), default=0.0)
    rounds = [
        Round(
            setting,
            tuple(_units(known, narrowed)),
            common_reads(known, forbidden),
            timing_of(setting.framing, setting.baud, setting.format, gap),
        )
        for setting, known in ranked
    ]
    return Plan(
        tuple(each for each in rounds if each.units), tuple(profiles), patience, all_rounds, forbidden
    )


def _ranked(
    profiles: Sequence[Profile], narrowed: Narrowed, blind: bool
) -> list[tuple[Setting, list[Profile]]]:
    """Settings with the profiles that know them, the likeliest first: each profile votes for its factory
    setting, and half as much for each step away from it; RTU comes before ASCII. ``blind``: parity and data
    bits do not show, so that one of the formats stands for all with as many stop bits."""
    votes: dict[Setting, dict[str, float]] = {}
    for profile in profiles:
        for setting, steps in _of_profile(profile, narrowed):
            cast = votes.setdefault(setting.as_seen if blind else setting, {})
            cast[profile.name] = max(cast.get(profile.name, 0.0), 0.5**steps)

    def unlikeliness(setting: Setting) -> tuple[object, ...]:
        return setting.framing != "rtu", -sum(votes[setting].values()), -setting.baud, str(setting.format)

    return [
        (setting, [profile for profile in profiles if profile.name in votes[setting]])
        for setting in sorted(votes, key=unlikeliness)
    ]


def _of_profile(profile: Profile, narrowed: Narrowed) -> Iterator[tuple[Setting, int]]:
    """The settings of a drive model, with how far each is from the factory's."""
    spoken: tuple[tuple[FramingName, tuple[SerialFormat, ...]], ...] = (
        ("rtu", profile.serial.rtu),
        ("ascii", profile.serial.ascii),
    )
    for framing, formats in spoken:
        if not formats or (narrowed.framings and framing not in narrowed.framings):
            continue
        for far, baud in enumerate(narrowed.bauds or profile.serial.baud):
            for farther, form in enumerate(narrowed.formats or formats):
                yield Setting(framing, baud, form), far + farther


def _beyond(
    profiles: Sequence[Profile], narrowed: Narrowed, port: PortKind
) -> list[tuple[Setting, list[Profile]]]:
    framings = ("tcp",) if port == "modbus" else narrowed.framings or ("rtu", "ascii")
    known: dict[FramingName, list[Profile]] = {
        "rtu": [profile for profile in profiles if profile.serial.rtu],
        "ascii": [profile for profile in profiles if profile.serial.ascii],
        "tcp": list(profiles),
    }
    return [(Setting(framing, serial=False), known[framing]) for framing in framings if known[framing]]


def _units(profiles: Sequence[Profile], narrowed: Narrowed) -> Iterator[int]:
    if narrowed.units:
        yield from narrowed.units
        return
    for unit in USUAL_UNITS:
        if any(low <= unit <= high for low, high in (profile.serial.units for profile in profiles)):
            yield unit


def common_reads(profiles: Sequence[Profile], forbidden: frozenset[int]) -> tuple[Ask, ...]:
    """As few single registers as can be, so that every profile's map has one of them."""
    maps = {p.name: _single_registers(p) - forbidden for p in profiles}
    chosen: list[Ask] = []
    while any(maps.values()):
        votes = Counter(address for addresses in maps.values() for address in addresses)
        best = min(votes, key=lambda address: (-votes[address], not _is_status(address, profiles), address))
        chosen.append(Ask(best))
        maps = {name: addresses for name, addresses in maps.items() if best not in addresses}
    return tuple(chosen)


def _single_registers(profile: Profile) -> set[int]:
    return {point.address for point in profile.points.values() if is_plain(point) and point.words == 1}


def _is_status(address: int, profiles: Sequence[Profile]) -> bool:
    """Some profile has a status there, which every drive can always show."""
    return any(_shows_status(point, address) for profile in profiles for point in profile.points.values())


def _shows_status(point: Point, address: int) -> bool:
    return point.address == address and point.kind is Kind.STATUS and is_plain(point)
