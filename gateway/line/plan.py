"""Which reads fetch everything that is wanted in the least time on the wire.

The blocks of a unit are exact (`gateway.line.cover`). A want is never cut. Where the line cannot hold the
periods that are wanted, the blocks are those for the periods that it can hold: a slow value that a fast block
brought along must not make that block longer once it may come ten times later itself.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple

from gateway.line.cover import Span, cover
from gateway.line.elastic import Draft, factors_for, fit
from gateway.line.interface import Plan, UnitFacts, Want
from gateway.line.requests import may_read
from gateway.mapping.profile import Table

Cost = Callable[[int, int], float]
"""Seconds on the wire of reading so many registers (second) of a unit (first)."""

_ALIKE: Mapping[int, float] = MappingProxyType({})
WEIGHTS = (1.0, 2.0, 5.0, 10.0)
"""By so much the periods of a class are taken to be longer than those of the fastest when blocks are sought
for a line that stretches them: few numbers, so that blocks found before can be used again."""
REMEMBERED = 256
"""Units whose blocks are remembered: units alike share them, and a changed demand touches few."""


def make_plan(wants: Iterable[Want], units: Mapping[int, UnitFacts], cost: Cost) -> Plan:
    """The plan for all that is wanted, periods stretched where the line cannot hold them."""
    return fit(best_drafts(tuple(wants), units, cost))


def best_drafts(wants: Sequence[Want], units: Mapping[int, UnitFacts], cost: Cost) -> list[Draft]:
    """The blocks by which the classes that are to give way last have to give way least."""
    best = make_drafts(wants, units, cost)
    least = factors_for(best)
    if max(least.values(), default=1.0) <= 1:
        return best
    ranks = sorted({want.rank for want in wants})
    for weights in _trials(ranks, least):
        drafts = make_drafts(wants, units, cost, weights)
        factors = factors_for(drafts)
        if _stretches(ranks, factors) < _stretches(ranks, least) and _in_time(wants, drafts, factors):
            best, least = drafts, factors
    return best


def _trials(ranks: Sequence[int], factors: Mapping[int, float]) -> Iterator[Mapping[int, float]]:
    """Weights under which the blocks may be better for a line that stretches periods: the ranks give way one
    after another, the last one first; or each as much as it has to with the blocks there are."""
    for place in range(len(ranks) - 1, 0, -1):
        yield dict.fromkeys(ranks[place:], WEIGHTS[-1])
    least = min(factors.values())
    yield {rank: max(w for w in WEIGHTS if w <= factor / least) for rank, factor in factors.items()}


def _stretches(ranks: Iterable[int], factors: Mapping[int, float]) -> list[float]:
    """How far each rank has to give way, the one first that is to do so last."""
    return [factors.get(rank, 1.0) for rank in ranks]


def make_drafts(
    wants: Iterable[Want], units: Mapping[int, UnitFacts], cost: Cost, weights: Mapping[int, float] = _ALIKE
) -> list[Draft]:
    """The blocks for all that is wanted, each at the period that is wanted. They are the cheapest when the
    periods of each rank are ``weights`` times as long."""
    groups: dict[tuple[int, Table], list[Want]] = {}
    for want in wants:
        groups.setdefault((want.unit, want.table), []).append(want)
    drafts: list[Draft] = []
    for (unit, _), group in sorted(groups.items()):
        drafts += _unit_drafts(units[unit], group, cost, weights)
    return drafts


def _unit_drafts(
    facts: UnitFacts, wants: Sequence[Want], cost: Cost, weights: Mapping[int, float]
) -> list[Draft]:
    """The blocks for what is wanted of one table of one unit."""
    costs = (0.0, *(cost(facts.unit, count) for count in range(1, facts.read_max + 1)))
    wanted = [_Wanted(want, want.period * weights.get(want.rank, 1.0)) for want in wants]
    wanted.sort(key=_address)
    spans = frozenset(Span(one.want.address, one.last, one.period) for one in wanted)
    blocks = _blocks(replace(facts, unit=0), spans, costs)
    return [_draft(block, wanted, costs[block.last - block.first + 1]) for block in blocks]


@lru_cache(REMEMBERED)
def _blocks(facts: UnitFacts, spans: frozenset[Span], costs: tuple[float, ...]) -> tuple[Span, ...]:
    return tuple(sorted(cover(spans, lambda address, count: may_read(facts, address, count), costs)))


class _Wanted(NamedTuple):
    """What is wanted, and the period for which blocks are sought."""

    want: Want
    period: float

    @property
    def last(self) -> int:
        """The last register."""
        return self.want.address + self.want.count - 1


def _draft(block: Span, wanted: Sequence[_Wanted], cost: float) -> Draft:
    """The block, with period and rank of the wants that it is there for."""
    begin = bisect_left(wanted, block.first, key=_address)
    end = bisect_right(wanted, block.last, key=_address)
    reasons = [one.want for one in wanted[begin:end] if one.last <= block.last and one.period == block.period]
    rank = min(want.rank for want in reasons)
    period = min(want.period for want in reasons if want.rank == rank)
    some = reasons[0]
    return Draft(some.unit, some.table, block.first, block.last - block.first + 1, period, rank, cost)


def _in_time(wants: Iterable[Want], drafts: Sequence[Draft], factors: Mapping[int, float]) -> bool:
    """True when every want is read as often as its own class has to be."""
    held: dict[tuple[int, Table], list[tuple[int, int, float]]] = {}
    for draft in drafts:
        block = (draft.address, draft.address + draft.count, draft.period * factors[draft.rank])
        held.setdefault((draft.unit, draft.table), []).append(block)
    return all(
        any(
            first <= want.address
            and want.address + want.count <= end
            and period <= want.period * factors.get(want.rank, 1.0) * (1 + 1e-9)
            for first, end, period in held[want.unit, want.table]
        )
        for want in wants
    )


def _address(one: _Wanted) -> int:
    return one.want.address
