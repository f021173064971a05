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

    def show(self, values: Mapping[str, float]) -> None:
        """Bring all of them up to date; ``values`` are those of `SHOWN`."""
        for name, sources in self._shows.items():
            if len(sources) == 1:
                self._show(name, self._value(sources[0], values))
            else:
                bits = (self._value(source, values) != 0 for source in sources)
                self._bank.put(name, sum(on << place for place, on in enumerate(bits)))

    def _show(self, name: str, value: float) -> None:
        codes = self._codes.get(name)
        if codes is None:
            self._bank.set(name, value)
        else:
            self._bank.put(name, codes.get(int(value), 0))

    def _value(self, source: str, values: Mapping[str, float]) -> float:
        found = values.get(source)
        return self._bank.get(source) if found is None else found
