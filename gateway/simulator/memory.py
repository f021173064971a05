"""What a drive keeps: factory contents, parameters that wait for an ENTER, and the wear of storing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gateway.mapping.profile import Kind, Point
from gateway.mapping.twin import Simulate
from gateway.simulator.bank import Bank


class Memory:
    """The lasting registers of one drive. ``saves`` counts what wears the memory out; ``saved_at`` is
    when the drive last began to store, in the seconds of its clock."""

    def __init__(self, bank: Bank, points: Mapping[str, Point], facts: Simulate) -> None:
        self.saves = 0
        self.saved_at = float("-inf")
        self._bank = bank
        self._points = points
        self._facts = facts
        self._volatile = frozenset(_volatile(points.values()))
        self._stored: dict[int, int] = {}

    def deliver(self) -> None:
        """Factory contents in all lasting registers."""
        factory, words = self._facts.factory, self._bank.words
        for address in words.keys() - self._volatile:
            words[address] = factory.get(address, 0)
        self.keep()

    def keep(self) -> None:
        """What is written is effective and stays after the mains were off."""
        self._bank.activate()
        self._stored = dict(self._bank.effective)

    def power_up(self) -> None:
        """Only what is stored is there; everything volatile is as at delivery."""
        for address in self._volatile & self._bank.words.keys():
            self._bank.words[address] = self._facts.factory.get(address, 0)
        self._bank.written.update(dict.fromkeys(self._bank.written, 0))
        self._bank.words.update(self._stored)
        self._bank.activate()

    def written(self, points: Iterable[Point], now: float) -> None:
        """Act on a write of these points."""
        for point in points:
            self.saves += point.wear is not None and point.then is None
            if point.twin is not None and point.twin in self._points:
                self._bank.put(point.twin, self._bank.raw(point.name))
            if point.name == self._facts.stores:
                self.keep()
                self.saved_at = now
            elif point.name == self._facts.activates:
                self._bank.activate()

    def busy(self, now: float) -> bool:
        """The drive is still storing."""
        return now < self.saved_at + self._facts.saving


def _volatile(points: Iterable[Point]) -> Iterable[int]:
    """Registers with anything in them that is no parameter."""
    for point in points:
        if point.kind is not Kind.PARAMETER:
            yield from range(point.address, point.address + point.words)
