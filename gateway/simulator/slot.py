"""Where a value lies in registers, and how its number is written there."""

from __future__ import annotations

import struct
from collections.abc import Mapping, MutableMapping
from dataclasses import dataclass

from gateway.mapping.profile import Encoding, NumberType

_SIGNED = (NumberType.S16, NumberType.S32)
_LARGEST = 3.4e38
"""What a 32-bit floating point number can surely hold."""


@dataclass(frozen=True, slots=True)
class Slot:
    """One raw value: a field of a register, a register, or several of them."""

    address: int
    encoding: Encoding

    @property
    def addresses(self) -> range:
        """The registers, in the order of their addresses."""
        return range(self.address, self.address + self.encoding.words)

    @property
    def width(self) -> int:
        """Bits of the value."""
        return self.encoding.width or 16 * self.encoding.words

    @property
    def highest(self) -> int:
        """All bits set."""
        return (1 << self.width) - 1

    def read(self, cells: Mapping[int, int]) -> int:
        """The raw value: with its sign, or as the number that its decimal digits mean."""
        bits = (self._bits(cells) >> self.encoding.bit) & self.highest
        if self.encoding.type in _SIGNED and bits >> (self.width - 1):
            return bits - self.highest - 1
        if self.encoding.type is NumberType.BCD:
            return sum((bits >> 4 * place & 0xF) * 10**place for place in range(self.width // 4))
        return bits

    def write(self, cells: MutableMapping[int, int], raw: int) -> None:
        """Put a raw value in, held within what fits; the other fields of the register stay."""
        bits = self._fitting(raw) << self.encoding.bit
        whole = self._bits(cells) & ~(self.highest << self.encoding.bit) | bits
        for place, address in enumerate(self._by_weight()):
            cells[address] = whole >> 16 * place & 0xFFFF

    def number(self, raw: int) -> float:
        """The count that a raw value stands for; it is another number only in floating point."""
        if self.encoding.type is NumberType.F32:
            value: float = struct.unpack(">f", raw.to_bytes(4, "big"))[0]
            return value if abs(value) < float("inf") else 0.0
        return raw

    def raw(self, number: float) -> int:
        """The raw value nearest to a count."""
        if self.encoding.type is NumberType.F32:
            return int.from_bytes(struct.pack(">f", min(max(number, -_LARGEST), _LARGEST)), "big")
        return round(number)

    def _fitting(self, raw: int) -> int:
        if self.encoding.type in _SIGNED:
            half = 1 << (self.width - 1)
            return min(max(raw, -half), half - 1) & self.highest
        if self.encoding.type is NumberType.BCD:
            digits = self.width // 4
            number = min(max(raw, 0), 10**digits - 1)
            return sum(number // 10**place % 10 << 4 * place for place in range(digits))
        return min(max(raw, 0), self.highest)

    def _bits(self, cells: Mapping[int, int]) -> int:
        return sum(cells[address] << 16 * place for place, address in enumerate(self._by_weight()))

    def _by_weight(self) -> range:
        """Addresses, that of the lowest 16 bits first."""
        if self.encoding.word_order == "low_first":
            return self.addresses
        return self.addresses[::-1]
