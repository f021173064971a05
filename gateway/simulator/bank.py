"""The holding registers of a drive: which exist, what they hold, and the profile's names for them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from gateway.mapping.profile import NumberType, Point, Table
from gateway.simulator.refusal import RefusalError

Span = tuple[int, int]
"""First and last address."""


class UnsupportedError(Exception):
    """The mapping asks for something that this simulator does not model; the message says what."""


@dataclass(frozen=True, slots=True)
class Slot:
    """Where a named value lies in a register, and what one count of it is worth."""

    address: int
    shift: int
    mask: int
    signed: bool
    scale: float
    offset: float

    @classmethod
    def of(cls, point: Point) -> Slot:
        """The slot of a profile's point."""
        encoding = point.encoding
        plain = encoding.type in (NumberType.U16, NumberType.S16) and encoding.times is None
        if point.table is not Table.HOLDING or point.words != 1 or not plain:
            raise UnsupportedError(f"{point.name}: only 16-bit values in holding registers can be simulated")
        mask = (1 << (encoding.width or 16)) - 1
        signed = encoding.type is NumberType.S16
        return cls(point.address, encoding.bit, mask, signed, float(encoding.scale), float(encoding.offset))

    def decode(self, word: int) -> float:
        """The value that the register's word holds."""
        raw = (word >> self.shift) & self.mask
        if self.signed and raw & 0x8000:
            raw -= 0x10000
        return raw * self.scale + self.offset

    def encode(self, word: int, value: float) -> int:
        """The word with the value in it, to the nearest count and held within what fits."""
        raw = round((value - self.offset) / self.scale)
        lowest, highest = (-0x8000, 0x7FFF) if self.signed else (0, self.mask)
        bits = min(max(raw, lowest), highest) & self.mask
        return (word & ~(self.mask << self.shift)) | bits << self.shift


class Bank:
    """Register contents by address. An address that is not in ``spans`` does not exist."""

    def __init__(self, spans: Iterable[Span], points: Mapping[str, Point]) -> None:
        self.words = {address: 0 for low, high in spans for address in range(low, high + 1)}
        self._points = points
        self._slots: dict[str, Slot] = {}

    def read(self, address: int, count: int) -> tuple[int, ...]:
        """``count`` registers from ``address`` on; all of them must exist."""
        self.require(address, count)
        return tuple(self.words[at] for at in range(address, address + count))

    def require(self, address: int, count: int) -> None:
        """Refuse addresses that do not exist."""
        if any(at not in self.words for at in range(address, address + count)):
            raise RefusalError("illegal_address")

    def get(self, name: str) -> float:
        """The value of a point in its unit; bits count as 0 and 1."""
        slot = self._slot(name)
        return slot.decode(self.words[slot.address])

    def on(self, name: str) -> bool:
        """True when the point is not 0."""
        return self.get(name) != 0

    def set(self, name: str, value: float) -> None:
        """Show a value in its unit."""
        slot = self._slot(name)
        self.words[slot.address] = slot.encode(self.words[slot.address], value)

    def show(self, values: Mapping[str, float]) -> None:
        """Set those of the values for which the profile has a point."""
        for name, value in values.items():
            if name in self._points:
                self.set(name, value)

    def clear(self, names: Iterable[str]) -> None:
        """Set points back to 0."""
        for name in names:
            self.set(name, 0)

    def _slot(self, name: str) -> Slot:
        if name not in self._slots:
            self._slots[name] = Slot.of(self._points[name])
        return self._slots[name]
