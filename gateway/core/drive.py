"""A drive at run time: what its registers mean, its limits, and the core's picture of its words. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from gateway.core.expected import Expected
from gateway.line.interface import UnitFacts
from gateway.mapping.profile import FREELY, Limits, Pace, Point, Profile, Table, Word
from gateway.mapping.site import DriveConfig
from gateway.modbus.encoding import insert, to_words
from gateway.tag import Origin, tag_of

FUNCTION_LOOP_BACK = 0x08


@dataclass(slots=True)
class Commanded:
    """The command that moved or stopped a drive last (`gateway.core.motion`): its name, whether it went to
    all drives of the line, past the word of this one, and whether the drive has shown it since."""

    name: str
    to_all: bool = False
    shown: bool = False


class Drive:
    """One drive of the site.

    ``image`` holds the words that were last commanded, by address. It stands in where a word cannot be
    read, and for a stop, which waits for no read.
    """

    def __init__(self, config: DriveConfig) -> None:
        self.config = config
        self.name = config.name
        self.line = config.line
        self.unit = config.unit
        self.profile = config.profile
        self.image: dict[int, int] = {}
        self.commanded: Commanded | None = None
        """What moved or stopped it last; None where nobody here did since it was last away."""
        self.owed: set[str] = set()
        """Commands that have to follow writes that were made (`Point.then`)."""
        self.doubt = ""
        """Why it may be of another model than the site says; then nothing of it is believed but what it is
        recognised by."""
        self.local = ""
        """Why it does not obey the line, as far as that was seen; empty while it does."""
        self.expected = Expected(self.profile.points, depends_on)
        self.selection: dict[str, int] = {}
        """Selectors and the raw values that they hold, as far as that is known."""
        self.worn: Callable[[Iterable[str]], str] = lambda names: ""
        """Why these points may not be written once more today (`gateway.core.wear`); "" if they may."""
        self.setpoint: tuple[Origin, float] | None = None
        """Who last wrote a setpoint that was read back, and when (monotonic); None when the drive may not
        hold it any more."""
        self.written: dict[str, float] = {}
        """Per point, when a frame that writes it was last on the wire (monotonic)."""
        self.facts = unit_facts(config)
        self._blocks: dict[tuple[int, int], tuple[Point, ...]] = {}
        self._depth = depths(self.profile)

    def tag(self, point: str) -> str:
        """The tag of a point of this drive."""
        return tag_of(self.name, point)

    def points_in(self, address: int, count: int) -> tuple[Point, ...]:
        """The readable points that lie wholly within these registers, deciding points before those that
        they decide."""
        key = (address, count)
        if key not in self._blocks:
            inside = [
                point
                for point in self.profile.points.values()
                if is_polled(point)
                and not point.select
                and address <= point.address
                and point.address + point.words <= address + count
            ]
            self._blocks[key] = tuple(sorted(inside, key=lambda point: self._depth[point.name]))
        return self._blocks[key]

    def limits(self, point: Point, limits: Limits | None) -> tuple[Fraction, Fraction] | None:
        """A range for writing in the point's unit: the profile's limits, narrowed by the site."""
        ranges = []
        if limits is not None:
            ranges.append((self._bound(limits.low), self._bound(limits.high)))
        if point.name in self.config.ranges:
            ranges.append(self.config.ranges[point.name])
        if not ranges:
            return None
        return max(low for low, _ in ranges), min(high for _, high in ranges)

    def pace(self, point: Point) -> Pace:
        """How fast a point may be changed: as the profile says, narrowed by the site."""
        return point.pace.within(self.config.limits.get(point.name, FREELY))

    def word(self, point: Point) -> Word | None:
        """The word that a field belongs to, None for a point that has its registers to itself."""
        return self.profile.words.get(point.address) if point.encoding.width else None

    def words_to_read(self, raws: Mapping[str, int]) -> list[int]:
        """Addresses of the words that must be read before these points can be written.

        A word with other fields than those written is read each time it can be: a drive that was restarted
        unnoticed, or obeyed somebody else, no longer holds what was commanded last, and a run bit out of
        an old image would start a motor (safety.md H7, H8).
        """
        addresses = []
        for name in raws:
            word = self.word(self.profile.points[name])
            if word is None or word.address in addresses:
                continue
            if self._readable(word) and not self._covered(word, raws):
                addresses.append(word.address)
        return addresses

    def _readable(self, word: Word) -> bool:
        """True when reading the register shows the word that is written there."""
        return any(self.profile.points[name].access.readable for name in word.fields)

    def _covered(self, word: Word, raws: Mapping[str, int]) -> bool:
        """True when every field that is neither constant nor a pulse is among those written."""
        return all(name in raws or self.profile.points[name].pulse for name in word.fields)

    def compose(self, raws: Mapping[str, int], fresh: Mapping[int, int]) -> tuple[int, tuple[int, ...]]:
        """Address and words of the one frame that writes these raw values.

        Fields are laid over ``fresh`` (words just read), else over the image, else over zeros; bits
        that are always the same get their value, and pulses of the past are dropped.
        """
        registers: dict[int, int] = {}
        for name, raw in raws.items():
            point = self.profile.points[name]
            word = self.word(point)
            if word is None:
                registers.update(enumerate(to_words(point.encoding, raw), point.address))
            else:
                base = registers.get(word.address)
                if base is None:
                    base = rest_of(word, fresh.get(word.address, self.image.get(word.address, 0)))
                registers[word.address] = insert(point.encoding, raw, base)
        first = min(registers)
        return first, tuple(registers[first + offset] for offset in range(len(registers)))

    def settled(self, address: int, words: tuple[int, ...]) -> tuple[int, ...]:
        """The words with their pulse bits back at rest: what the drive holds once the pulse is over."""
        return tuple(
            rest_of(self.profile.words[a], w) if a in self.profile.words else w
            for a, w in enumerate(words, address)
        )

    def commanding(self, address: int, words: tuple[int, ...]) -> dict[int, int]:
        """Note words that are about to be sent; returns the image as it was, for `refused`."""
        before = dict(self.image)
        for name in list(self.selection):
            if address <= self.profile.points[name].address < address + len(words):
                del self.selection[name]
        for at, word in enumerate(self.settled(address, words), address):
            if at in self.profile.words and self.profile.words[at].image:
                self.image[at] = word
        return before

    def refused(self, address: int, count: int, before: dict[int, int]) -> None:
        """The drive does not hold the words at these addresses; the image is again what it was."""
        for at in range(address, address + count):
            self.image.pop(at, None)
            if at in before:
                self.image[at] = before[at]

    def forget(self) -> None:
        """Nothing is known of the drive's words any more: it may have been restarted."""
        self.image.clear()
        self.commanded = None
        self.selection.clear()
        self.owed.clear()
        self.setpoint = None

    def _bound(self, bound: Fraction | str) -> Fraction:
        return self.config.settings[bound] if isinstance(bound, str) else bound


def depends_on(point: Point) -> tuple[str, ...]:
    """The points and settings whose values decide what this point means."""
    terms = [*point.when, *(term for case in point.cases for term in case.when)]
    names = [term.name for term in terms]
    for encoding, limits in ((point.encoding, point.limits), *((c.encoding, c.limits) for c in point.cases)):
        bounds = (limits.low, limits.high) if limits else ()
        names += [name for name in (encoding.times, *bounds) if isinstance(name, str)]
    return tuple(dict.fromkeys(names))


def depths(profile: Profile) -> dict[str, int]:
    """How many points stand between each point and those that depend on nothing (no circles: loader)."""
    known: dict[str, int] = {}

    def depth(name: str) -> int:
        if name not in profile.points:
            return -1
        if name not in known:
            known[name] = 1 + max((depth(other) for other in depends_on(profile.points[name])), default=-1)
        return known[name]

    return {name: depth(name) for name in profile.points}


def rest_of(word: Word, value: int) -> int:
    """A word's value without its pulses and with its constant bits."""
    return value & ~word.pulse_mask & ~word.always_mask | word.always_bits


def is_polled(point: Point) -> bool:
    """True for a point that reads of holding registers can bring."""
    return point.access.readable and point.table is Table.HOLDING


def unit_facts(config: DriveConfig) -> UnitFacts:
    """What the line has to know of a drive."""
    profile = config.profile
    points = [point for point in profile.points.values() if is_polled(point)]
    return UnitFacts(
        unit=config.unit,
        functions=profile.modbus.functions,
        read_max=profile.modbus.read_max,
        write_max=profile.modbus.write_max,
        write_one=profile.modbus.write_one,
        readable=_merged((point.address, point.address + point.words - 1) for point in points),
        probe=_probe(config, points),
        bridge=profile.modbus.bridge,
        holes=profile.modbus.holes,
        loop_back=FUNCTION_LOOP_BACK in profile.modbus.functions,
        reply_usual=profile.serial.reply_usual,
        reply_max=profile.serial.reply_max,
        pause_read=profile.serial.pause_read,
        pause_write=profile.serial.pause_write,
        pause_broadcast=profile.serial.pause_broadcast,
        error_functions=profile.modbus.error_functions,
    )


def _probe(config: DriveConfig, points: list[Point]) -> tuple[int, int]:
    if not points:
        return 0, 0
    named = config.profile.points.get(config.profile.modbus.probe)
    point = named or next((p for p in points if p.kind == "status"), points[0])
    return point.address, point.words


def _merged(spans: Iterable[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    merged: list[tuple[int, int]] = []
    for low, high in sorted(spans):
        if merged and low <= merged[-1][1] + 1:
            merged[-1] = (merged[-1][0], max(high, merged[-1][1]))
        else:
            merged.append((low, high))
    return tuple(merged)
