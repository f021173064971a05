"""Where a value lies in registers, and how its number is written there."""

from __future__ import annotations

import struct
from collections.abc import Mapping, MutableMapping

from gateway.mapping.profile import Encoding, NumberType

_SIGNED = (NumberType.S16, NumberType.S32)
_LARGEST = 3.4e38
"""What a 32-bit floating point number can surely hold."""


class Slot:
    """One raw value: a field of a register, a register, or several of them. Worked out once, since a
    drive shows its values many times a second."""

    __slots__ = (
        "_by_weight",
        "_plain",
        "addresses",
        "counts",
        "encoding",
        "highest",
        "offset",
        "scale",
        "width",
    )

    def __init__(self, address: int, encoding: Encoding) -> None:
        self.encoding = encoding
        self.addresses = range(address, address + encoding.words)
        """The registers, in the order of their addresses."""
        self._by_weight = self.addresses if encoding.word_order == "low_first" else self.addresses[::-1]
        self.width = encoding.width or 16 * encoding.words
        self.highest = (1 << self.width) - 1
        self.scale, self.offset = float(encoding.scale), float(encoding.offset)
        plain_scale = encoding.scale == 1 and encoding.offset == 0 and encoding.times is None
        self.counts = plain_scale and encoding.type is not NumberType.F32
        """The raw value is the value."""
        self._plain = encoding.type not in (*_SIGNED, NumberType.BCD)

    def read(self, cells: Mapping[int, int]) -> int:
        """The raw value: with its sign, or as the number that its decimal digits mean."""
        bits = (self._bits(cells) >> self.encoding.bit) & self.highest
        if self._plain:
            return bits
        if self.encoding.type is NumberType.BCD:
            return sum((bits >> 4 * place & 0xF) * 10**place for place in range(self.width // 4))
        return bits - self.highest - 1 if bits >> (self.width - 1) else bits

    def write(self, cells: MutableMapping[int, int], raw: int) -> None:
        """Put a raw value in, held within what fits; the other fields of the register stay."""
        bits = self._fitting(raw) << self.encoding.bit
        whole = self._bits(cells) & ~(self.highest << self.encoding.bit) | bits
        for address in self._by_weight:
            cells[address] = whole & 0xFFFF
            whole >>= 16

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
        if self._plain:
            return min(max(raw, 0), self.highest)
        if self.encoding.type is NumberType.BCD:
            digits = self.width // 4
            number = min(max(raw, 0), 10**digits - 1)
            return sum(number // 10**place % 10 << 4 * place for place in range(digits))
        half = 1 << (self.width - 1)
        return min(max(raw, -half), half - 1) & self.highest

    def _bits(self, cells: Mapping[int, int]) -> int:
        whole = 0
        for address in reversed(self._by_weight):
            whole = whole << 16 | cells[address]
        return whole
