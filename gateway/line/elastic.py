"""What becomes of periods that the line cannot hold, and how old values can get.

Periods stretch by rank: the highest number first and up to `MOST`, rank 0 last; when even that does not do,
all stretch alike. No demand is ever dropped.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from gateway.line.interface import Block, Plan
from gateway.mapping.profile import Table

CAPACITY = 0.97
"""Share of the line that planned reads may take; the rest is for probes and for writes now and then."""
MOST = 10.0
"""A rank stretches at most so far before the next rank has to give way."""

_ROUNDS = 1000


@dataclass(frozen=True, slots=True)
class Draft:
    """A block before its period is settled."""

    unit: int
    table: Table
    address: int
    count: int
    period: float
    rank: int
    cost: float

    @property
    def load(self) -> float:
        """Share of the line that it takes."""
        return self.cost / self.period


def fit(drafts: Sequence[Draft], factors: Mapping[int, float] | None = None) -> Plan:
    """The plan that holds: periods stretched as far as needed (by ``factors``, if those are known already),
    worst ages worked out."""
    factors = factors_for(drafts) if factors is None else factors
    periods = [draft.period * factors[draft.rank] for draft in drafts]
    costs = [draft.cost for draft in drafts]
    stretch = max(factors.values(), default=1.0)
    ages = _worst_ages(costs, periods, full=stretch > 1)
    blocks = tuple(
        Block(draft.unit, draft.address, draft.count, period, draft.cost, age, draft.table)
        for draft, period, age in zip(drafts, periods, ages, strict=True)
    )
    load = sum(cost / period for cost, period in zip(costs, periods, strict=True))
    return Plan(blocks, load, stretch)


def factors_for(drafts: Iterable[Draft]) -> Mapping[int, float]:
    """By what each rank's periods are to be multiplied so that the line can hold them."""
    loads: dict[int, float] = {}
    for draft in drafts:
        loads[draft.rank] = loads.get(draft.rank, 0.0) + draft.load
    factors = dict.fromkeys(loads, 1.0)
    for rank in sorted(loads, reverse=True):
        others = sum(loads[r] / factors[r] for r in loads if r != rank)
        if others + loads[rank] <= CAPACITY:
            return factors
        room = CAPACITY - others
        factors[rank] = min(MOST, loads[rank] / room) if room > 0 else MOST
    return _all_alike(loads, factors)


def _all_alike(loads: Mapping[int, float], factors: Mapping[int, float]) -> Mapping[int, float]:
    """Stretch every rank further by what is still missing."""
    more = max(1.0, sum(loads[rank] / factors[rank] for rank in loads) / CAPACITY)
    return {rank: factor * more for rank, factor in factors.items()}


def _worst_ages(costs: Sequence[float], periods: Sequence[float], full: bool) -> list[float]:
    """How old each block's values can be just before they are read anew.

    A value is as old as its period and the time that its next read may be late in ending. That is at most
    the longest stretch for which the line can be busy without a pause, and at most the period plus the one
    transaction that may already be on the wire. A ``full`` line, which has to stretch periods, never pauses.
    """
    longest = max(costs, default=0.0)
    busy = math.inf if full else _busy_period(costs, periods, longest)
    return [period + min(busy, period + longest) for period in periods]


def _busy_period(costs: Sequence[float], periods: Sequence[float], blocking: float) -> float:
    """Longest time that the line is busy when all blocks fall due at once behind another transaction."""
    busy = blocking + sum(costs)
    for _ in range(_ROUNDS):
        asked = blocking + sum(
            math.ceil(busy / period) * cost for cost, period in zip(costs, periods, strict=True)
        )
        if asked <= busy:
            return busy
        busy = asked
    return math.inf
