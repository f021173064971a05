"""Which reads fetch everything that is wanted in the least time on the wire.

Within a class of equal periods the blocks are exact: wants sorted by address, the best cut found by dynamic
programming. Classes are taken from fast to slow; a slower want that a faster block covers rides along, and
at the end two blocks of different classes become one where that saves line time. A want is never cut.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from gateway.line.elastic import Draft, fit
from gateway.line.interface import Plan, UnitFacts, Want
from gateway.line.requests import may_read

Cost = Callable[[int, int], float]
"""Seconds on the wire of reading so many registers (second) of a unit (first)."""


def make_plan(wants: Iterable[Want], units: Mapping[int, UnitFacts], cost: Cost) -> Plan:
    """The plan for all that is wanted, periods stretched where the line cannot hold them."""
    return fit(make_drafts(wants, units, cost))


def make_drafts(wants: Iterable[Want], units: Mapping[int, UnitFacts], cost: Cost) -> list[Draft]:
    """The blocks for all that is wanted, each at the period that is wanted."""
    groups: dict[tuple[int, str], list[Want]] = {}
    for want in wants:
        groups.setdefault((want.unit, want.table), []).append(want)
    drafts: list[Draft] = []
    for (unit, _), group in sorted(groups.items()):
        drafts += _UnitPlan(units[unit], cost).drafts(group)
    return drafts


@dataclass(frozen=True, slots=True)
class _UnitPlan:
    """Plans the reads of one table of one unit."""

    facts: UnitFacts
    cost: Cost

    def drafts(self, wants: Sequence[Want]) -> list[Draft]:
        drafts: list[Draft] = []
        for period in sorted({want.period for want in wants}):
            left = [want for want in wants if want.period == period and not _covered(want, drafts)]
            drafts += self._cover(left)
        return self._merged(drafts)

    def _cover(self, wants: Sequence[Want]) -> list[Draft]:
        """The cheapest blocks for wants of one period."""
        spans = _outermost(wants)
        best: list[tuple[float, int]] = [(0.0, 0)]
        for end in range(1, len(spans) + 1):
            best.append(min(self._last_blocks(spans, best, end)))
        drafts = []
        end = len(spans)
        while end:
            start = best[end][1]
            drafts.append(self._draft(spans[start][0], spans[end - 1][1], wants))
            end = start
        return drafts[::-1]

    def _last_blocks(
        self, spans: Sequence[tuple[int, int]], best: Sequence[tuple[float, int]], end: int
    ) -> Iterable[tuple[float, int]]:
        """Total cost and first span of each block that may end with span ``end - 1``."""
        last = spans[end - 1][1]
        for start in range(end - 1, -1, -1):
            count = last - spans[start][0] + 1
            if count > self.facts.read_max:
                return
            if may_read(self.facts, spans[start][0], count):
                yield best[start][0] + self.cost(self.facts.unit, count), start

    def _draft(self, first: int, last: int, wants: Iterable[Want]) -> Draft:
        inside = [want for want in wants if first <= want.address and want.address + want.count - 1 <= last]
        return Draft(
            unit=self.facts.unit,
            table=inside[0].table,
            address=first,
            count=last - first + 1,
            period=inside[0].period,
            rank=min(want.rank for want in inside),
            cost=self.cost(self.facts.unit, last - first + 1),
        )

    def _merged(self, drafts: list[Draft]) -> list[Draft]:
        """Make one block of two as long as that takes less of the line."""
        while (better := self._best_merge(drafts)) is not None:
            drafts = better
        return drafts

    def _best_merge(self, drafts: list[Draft]) -> list[Draft] | None:
        for one, other in combinations(drafts, 2):
            both = self._union(one, other)
            if both is not None and both.load < one.load + other.load:
                return [both, *(draft for draft in drafts if draft not in (one, other))]
        return None

    def _union(self, one: Draft, other: Draft) -> Draft | None:
        first = min(one.address, other.address)
        count = max(one.address + one.count, other.address + other.count) - first
        if not may_read(self.facts, first, count):
            return None
        return Draft(
            unit=one.unit,
            table=one.table,
            address=first,
            count=count,
            period=min(one.period, other.period),
            rank=min(one.rank, other.rank),
            cost=self.cost(one.unit, count),
        )


def _covered(want: Want, drafts: Iterable[Draft]) -> bool:
    return any(
        draft.address <= want.address and want.address + want.count <= draft.address + draft.count
        for draft in drafts
    )


def _outermost(wants: Iterable[Want]) -> list[tuple[int, int]]:
    """First and last address of the wants that lie in no other, in ascending order."""
    spans: list[tuple[int, int]] = []
    for first, last in sorted({(w.address, -(w.address + w.count - 1)) for w in wants}):
        if not spans or -last > spans[-1][1]:
            spans.append((first, -last))
    return spans
