"""The cheapest blocks for the registers that are wanted of one table of one unit.

A block that is read often brings slower values along for nothing, and a slow block may reach across a fast
one. In a cheapest set no two blocks cross, and one lies inside another only when it is read more often: what
both hold the faster one brings anyway, so the slower can do without it. Such sets are searched by dynamic
programming over ranges of wants in the order of their addresses: blocks side by side at the top, and inside
each block, by the same rule, those for what has to be read more often than the block.

The result is exact for wants that do not overlap in part (the points of a profile hardly ever do), as long
as no block need reach across more than `ACROSS` wants that are faster than itself. Beyond that it is still
within the unit's limits and brings every want in time.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import accumulate, takewhile
from typing import NamedTuple

ACROSS = 16
"""So many faster wants may lie inside a block and be read by blocks of their own. Bounds the time of
planning; units that let 16 registers be read at once can never need more."""

_NEVER = float("inf")


class Span(NamedTuple):
    """Registers that are read together, from ``first`` to ``last``, every ``period`` seconds."""

    first: int
    last: int
    period: float


Legal = Callable[[int, int], bool]
"""May so many registers (second) from an address (first) be read at once? Then any part of them may that
begins and ends with what is wanted."""


def cover(spans: Iterable[Span], legal: Legal, costs: Sequence[float]) -> list[Span]:
    """The blocks that bring every span at least as often as it is wanted, in the least time on the wire.

    ``costs`` are the seconds on the wire of reading 0, 1, 2 ... registers, up to the most at once.
    """
    return list(_Cover(needed(spans), legal, costs).blocks())


def needed(spans: Iterable[Span]) -> list[Span]:
    """The spans, in the order of their addresses, without those that others bring along in any case."""
    ordered = sorted(set(spans), key=lambda span: (span.first, -span.last, span.period))
    longest = max((span.last - span.first for span in ordered), default=0)
    kept: list[Span] = []
    for span in ordered:
        near = takewhile(lambda other, span=span: other.first + longest >= span.first, reversed(kept))  # type: ignore[misc]
        if not any(other.last >= span.last and other.period <= span.period for other in near):
            kept.append(span)
    return kept


class _Row(NamedTuple):
    """The cheapest covers of all ranges with one begin: what each costs, and where its last block begins."""

    costs: list[float]
    begins: list[int]


class _Cover:
    """Spans are known by their index, periods by their level: 0 is the fastest. Above all levels is the top:
    there everything is still to be covered. ``items`` of a level are the spans that are faster."""

    def __init__(self, spans: Sequence[Span], legal: Legal, costs: Sequence[float]) -> None:
        periods = sorted({span.period for span in spans})
        self._top = len(periods)
        self._periods = periods
        self._rates = [1 / period for period in periods]
        self._firsts = [span.first for span in spans]
        self._lasts = [span.last for span in spans]
        self._levels = [bisect_left(periods, span.period) for span in spans]
        self._items = [
            [i for i, at in enumerate(self._levels) if at < level] for level in range(self._top + 1)
        ]
        self._places = [[0, *accumulate(at < level for at in self._levels)] for level in range(self._top + 1)]
        self._reads = costs
        self._reach = self._reaches(legal)
        self._rows: dict[tuple[int, int], _Row] = {}
        self._choices: dict[tuple[int, int], tuple[float, int]] = {}

    def blocks(self) -> Iterator[Span]:
        """The blocks of a cheapest cover."""
        return self._within(self._top, 0, len(self._firsts) - 1)

    def _reaches(self, legal: Legal) -> list[int]:
        """For each span the last one that a block may hold that begins with it."""
        tops = list(accumulate(self._lasts, max))
        reaches: list[int] = []
        end = 0
        for begin, first in enumerate(self._firsts):
            end = max(end, begin)
            while end + 1 < len(tops) and legal(first, tops[end + 1] - first + 1):
                end += 1
            reaches.append(end)
        return reaches

    def _within(self, level: int, begin: int, end: int) -> Iterator[Span]:
        """The blocks for what is faster than a level, in a range of spans."""
        low, high = self._places[level][begin], self._places[level][end + 1] - 1
        while low <= high:
            start = self._row(level, low).begins[high - low]
            yield from self._block(self._items[level][start], self._items[level][high])
            high = start - 1

    def _block(self, begin: int, end: int) -> Iterator[Span]:
        """A block for a range, and those inside it."""
        level = self._choice(begin, end)[1]
        yield Span(self._firsts[begin], max(self._lasts[begin : end + 1]), self._periods[level])
        yield from self._within(level, begin, end)

    def _row(self, level: int, low: int) -> _Row:
        """The covers of the items of a level from one on."""
        row = self._rows.get((level, low))
        if row is None:
            row = self._rows[level, low] = _Row([], [])
            end = len(self._items[level])
            for high in range(low, end if level == self._top else min(end, low + ACROSS)):
                cost, begin = self._last_block(self._items[level], low, high, row.costs)
                row.costs.append(cost)
                row.begins.append(begin)
        return row

    def _last_block(
        self, items: Sequence[int], low: int, high: int, costs: Sequence[float]
    ) -> tuple[float, int]:
        """The cost of the cheapest cover of the items from ``low`` to ``high``, and where its last block
        begins; ``costs`` are those of the shorter ones. Choices that cannot be cheaper are not looked at."""
        firsts, levels, reach = self._firsts, self._levels, self._reach
        reads, rates, choices = self._reads, self._rates, self._choices
        best, where, end = _NEVER, high, items[high]
        slowest, behind = levels[end], self._lasts[end] + 1
        for place in range(high, low - 1, -1):
            begin = items[place]
            if reach[begin] < end:
                break
            before = costs[place - low - 1] if place > low else 0.0
            level = levels[begin] if levels[begin] < slowest else slowest
            if before + reads[behind - firsts[begin]] * rates[level] < best:
                choice = choices.get((begin, end)) or self._choice(begin, end)
                if before + choice[0] < best:
                    best, where = before + choice[0], place
        return best, where

    def _choice(self, begin: int, end: int) -> tuple[float, int]:
        """What a block for a range costs with the faster ones inside it, and the best level for it: one that
        is wanted in the range, but none slower than what it begins and ends with."""
        known = self._choices.get((begin, end))
        if known is None:
            read = self._reads[max(self._lasts[begin : end + 1]) - self._firsts[begin] + 1]
            known = min(self._levelled(read, begin, end))
            self._choices[begin, end] = known
        return known

    def _levelled(self, read: float, begin: int, end: int) -> Iterator[tuple[float, int]]:
        count = 0
        for level in range(min(self._levels[begin], self._levels[end]) + 1):
            faster, count = count, self._places[level + 1][end + 1] - self._places[level + 1][begin]
            if count > faster <= ACROSS:
                row = self._row(level, self._places[level][begin]) if faster else None
                inside = row.costs[faster - 1] if row else 0.0
                yield read * self._rates[level] + inside, level
