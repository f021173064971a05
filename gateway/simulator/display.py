"""What a drive shows of itself in its registers."""

from __future__ import annotations

from collections.abc import Mapping

from gateway.mapping.profile import Kind, Point
from gateway.mapping.twin import SHOWN, Simulate
from gateway.simulator.bank import Bank


class Display:
    """The points that show something, and what. A point with a name of `SHOWN` shows that by itself."""

    def __init__(self, bank: Bank, points: Mapping[str, Point], facts: Simulate) -> None:
        self._bank = bank
        self._codes = facts.codes
        own = {
            name: (name,)
            for name in SHOWN
            if name in points and points[name].access.readable and points[name].kind is not Kind.PARAMETER
        }
        self._shows: Mapping[str, tuple[str, ...]] = {**own, **facts.shows}
        self._shown: dict[str, tuple[float, ...]] = {}

    def forget(self) -> None:
        """The registers may hold something else now."""
        self._shown.clear()

    def show(self, values: Mapping[str, float]) -> None:
        """Bring all of them up to date; ``values`` are those of `SHOWN`."""
        for name, sources in self._shows.items():
            found = tuple([self._value(source, values) for source in sources])
            if self._shown.get(name) != found or not self._bank.steady(name):
                self._shown[name] = found
                self._show(name, found)

    def _show(self, name: str, values: tuple[float, ...]) -> None:
        codes = self._codes.get(name)
        if len(values) > 1:
            self._bank.put(name, sum((value != 0) << place for place, value in enumerate(values)))
        elif codes is not None:
            self._bank.put(name, codes.get(int(values[0]), 0))
        else:
            self._bank.set(name, values[0])

    def _value(self, source: str, values: Mapping[str, float]) -> float:
        found = values.get(source)
        return self._bank.get(source) if found is None else found
