"""Frequencies and ramp times of a twin: fixed, or in registers where a write can change them."""

from __future__ import annotations

from fractions import Fraction

from gateway.mapping.profile import Bound
from gateway.mapping.twin import Simulate
from gateway.simulator.bank import Bank, Exact
from gateway.simulator.happening import Options

HIGHEST = Fraction(60)
"""Hz, where neither profile nor site tells."""
SHORTEST = Fraction(1, 10)
"""Seconds; no ramp is shorter."""


class Amounts:
    """Looks them up at every use. What the options tell comes first, but a register that was written
    since then has the last word."""

    def __init__(self, bank: Bank, facts: Simulate, options: Options) -> None:
        self._bank = bank
        self._facts = facts
        self._bounds: dict[str, tuple[Bound | None, float | None]] = {
            "max_frequency": (facts.max_frequency, options.max_frequency),
            "base_frequency": (facts.base_frequency, None),
            "acceleration": (facts.acceleration, options.acceleration),
            "deceleration": (facts.deceleration, options.deceleration),
            "fast_deceleration": (facts.fast_deceleration, options.fast_deceleration),
        }

    def preset(self, known: frozenset[str]) -> None:
        """Put the options into those registers that hold amounts; ``known`` are the points."""
        for bound, option in self._bounds.values():
            if isinstance(bound, str) and bound in known and option is not None:
                self._bank.set(bound, option)

    @property
    def max_frequency(self) -> Fraction:
        """Hz."""
        return Fraction(self._find("max_frequency") or HIGHEST)

    @property
    def base_frequency(self) -> Fraction:
        """Hz."""
        return Fraction(self._find("base_frequency") or self.max_frequency)

    def seconds(self, ramp: str) -> Fraction:
        """The time of a ramp between standstill and the base frequency."""
        return max(Fraction(self._find(ramp) or SHORTEST), SHORTEST)

    @property
    def points(self) -> frozenset[str]:
        """The names that hold frequencies, which no frequency can be too high for."""
        frequencies = (self._facts.max_frequency, self._facts.base_frequency)
        return frozenset(bound for bound in frequencies if isinstance(bound, str))

    def _find(self, key: str) -> Exact | None:
        bound, option = self._bounds[key]
        fixed = Fraction(option) if option is not None else None
        if isinstance(bound, str):
            return self._bank.number(bound) or fixed
        return fixed if fixed is not None else bound
