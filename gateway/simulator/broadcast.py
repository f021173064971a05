"""Commands to all drives at once: a layout of their own, at unit 0, which nobody answers."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from gateway.mapping.profile import Broadcast, ModbusFacts
from gateway.simulator import frame
from gateway.simulator.bank import Bank, Exact
from gateway.simulator.frame import Request

WRITE = 0x10
SUFFIX = "_all"


class Receiver:
    """Takes broadcasts apart. What the layout does not know is ignored, and so is the whole frame."""

    def __init__(self, layout: Broadcast, facts: ModbusFacts, settings: Mapping[str, Fraction]) -> None:
        self._layout = layout
        self._facts = facts
        self._bank = Bank((), layout.points, settings)

    def values(self, request: Request) -> dict[str, Exact] | None:
        """What is commanded, by the names of the layout without ``_all``, in their units; None: nothing."""
        if request.function != WRITE or WRITE not in self._facts.functions:
            return None
        write = frame.parse_write(request.data)
        if not 1 <= write.count <= self._facts.write_max or write.byte_count != 2 * write.count:
            return None
        addresses = range(write.address, write.address + write.count)
        known = self._bank.words.keys() | self._bank.written.keys()
        if any(address not in known for address in addresses):
            return None
        for address, word in zip(addresses, write.words, strict=True):
            self._bank.store(address, word)
        return self._within(addresses)

    def _within(self, addresses: range) -> dict[str, Exact] | None:
        found: dict[str, Exact] = {}
        for point in self._layout.points.values():
            if point.address in addresses:
                value = self._bank.exact(point.name)
                high = point.limits.high if point.limits else None
                if isinstance(high, Fraction) and value > high:
                    return None
                found[point.name.removesuffix(SUFFIX)] = value
        return found

    @property
    def in_percent(self) -> bool:
        """The frequency is a share of the highest one."""
        frequency = self._layout.points.get("frequency" + SUFFIX)
        return frequency is not None and frequency.encoding.symbol == "%"
