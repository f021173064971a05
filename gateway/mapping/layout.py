"""What the points of a profile occupy, gathered while they are made."""

from __future__ import annotations

from dataclasses import dataclass, field

from gateway.mapping.encodings import REGISTER
from gateway.mapping.inherit import Inherited
from gateway.mapping.node import Path
from gateway.mapping.notation import Place
from gateway.mapping.profile import Point, Table, Word


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
    """Every name of a point with its place, those that are taken already included."""
    set_aside: list[Inherited] = field(default_factory=list)
    """The keys of what could not be made into a point."""
    doubtful: set[str] = field(default_factory=set)
    """Points whose keys have errors: others are not judged by what they mean."""
    displaced: set[str] = field(default_factory=set)
    """Those of them that may lie elsewhere, or be read or written otherwise."""

    def keep(self, point: Point, keys: Inherited) -> bool:
        """Add a point; False when its name is taken (which is told with all names)."""
        self.names.append((point.name, keys.path))
        cut = point.encoding
        first = point.address * REGISTER + cut.bit
        last = first + (cut.width or REGISTER * cut.words) - 1
        access = point.access
        self.claims.append(
            Claim(point.table, first, last, point.name, keys.path, access.readable, access.writable)
        )
        if point.name in self.points:
            return False
        self.points[point.name] = point
        self.keys[point.name] = keys
        return True

    def claim_constant(self, name: str, path: Path, place: Place, bits: tuple[int, int]) -> None:
        """Occupy the bits (first and width) of a field that always has the same value."""
        first = place.address * REGISTER + bits[0]
        self.claims.append(
            Claim(place.table, first, first + bits[1] - 1, name, path, reads=False, writes=True)
        )

    def keep_word(self, word: Word) -> None:
        """Add a cut register; where one address is cut twice, the cut that is written is kept."""
        written = any(self.points[name].access.writable for name in word.fields)
        if written or word.address not in self.words:
            self.words[word.address] = word
