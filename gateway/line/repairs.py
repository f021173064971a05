"""What to change on a line that cannot do what is wanted of it, and what each change would bring. Pure.

Every repair is computed with the planner itself, never estimated. A faster line loses nothing; then come
longer periods, fewer fast reads, and at last more wire.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from gateway.line.elastic import CAPACITY, Draft
from gateway.line.forecast import Forecast, Setup, demand_of, drafts_of, forecast
from gateway.line.interface import Want

LONGEST = 100.0
"""A period is not lengthened by more than this factor: a line that needs it needs another repair."""

Kind = Literal["baud", "period", "periods", "demote", "split"]


@dataclass(frozen=True, slots=True)
class Repair:
    """A change and what it brings.

    ``kind`` and ``value``: run the line at ``value`` baud; read class ``rate`` every ``value`` seconds
    (``period``); make all periods ``value`` times as long (``periods``); move ``value`` reads of class
    ``rate`` into the next slower one (``demote``; ``moved`` tells which wants); spread the units over
    ``value`` lines (``split``; the forecast is that of the worst of them). ``beside`` is a change that has to
    be made too, because neither is enough alone.
    """

    kind: Kind
    value: float
    forecast: Forecast
    rate: str = ""
    moved: tuple[Want, ...] = ()
    beside: Repair | None = None


def repairs(setup: Setup) -> list[Repair]:
    """The cheapest change of each kind; those that are enough come first. Empty when all is well."""
    if forecast(setup).fits:
        return []
    faster = _faster(setup)
    found = [repair for repair in (faster, *_others(setup)) if repair is not None]
    if faster is not None and not any(repair.forecast.fits for repair in found):
        more = _others(_with_baud(setup, round(faster.value)))
        found += [replace(repair, beside=faster) for repair in more if repair and repair.forecast.fits]
    return sorted(found, key=lambda repair: not repair.forecast.fits)


def _others(setup: Setup) -> tuple[Repair | None, ...]:
    return _longer(setup), _fewer_fast(setup), _split(setup)


def _faster(setup: Setup) -> Repair | None:
    """The lowest speed that is enough, else the highest that there is."""
    best = None
    for baud in sorted(baud for baud in setup.bauds if baud > setup.settings.baud):
        best = Repair("baud", baud, forecast(_with_baud(setup, baud)))
        if best.forecast.fits:
            break
    return best


def _longer(setup: Setup) -> Repair | None:
    """A longer period for the class that costs most; where that is not enough, longer periods for all."""
    loads = _loads(setup)
    if not loads or sum(loads.values()) <= CAPACITY:
        return None
    rate = max(loads, key=lambda name: loads[name])
    present = setup.wants[rate][0].period
    for period in _round_periods(present):
        changed = _with_period(setup, rate, period)
        if demand_of(changed) <= CAPACITY:
            return Repair("period", period, forecast(changed), rate)
    factor = math.ceil(10 * sum(loads.values()) / CAPACITY) / 10
    changed = replace(setup, wants={name: _slower(wants, factor) for name, wants in setup.wants.items()})
    return Repair("periods", factor, forecast(changed))


def _fewer_fast(setup: Setup) -> Repair | None:
    """Move as few reads as will do, the dearest first, from the fastest class to the next slower one."""
    classes = sorted((wants[0].period, name) for name, wants in setup.wants.items() if wants)
    if len(classes) < 2 or demand_of(setup) <= CAPACITY:
        return None
    (_, fast), (_, slower) = classes[0], classes[1]
    blocks = sorted(_blocks_of(setup, fast), key=lambda draft: -draft.cost)
    for number in range(1, len(blocks) + 1):
        moved = tuple(want for want in setup.wants[fast] if _within(want, blocks[:number]))
        changed = _moved(setup, moved, fast, slower)
        if demand_of(changed) <= CAPACITY:
            return Repair("demote", number, forecast(changed), fast, moved)
    return None


def _split(setup: Setup) -> Repair | None:
    """The fewest lines over which the units can be spread, as evenly as may be."""
    for lines in range(2, len(setup.units) + 1):
        worst = max((forecast(part) for part in _parts(setup, lines)), key=_badness)
        if worst.fits:
            return Repair("split", lines, worst)
    return None


def _loads(setup: Setup) -> dict[str, float]:
    """Share of the wire that each class takes."""
    loads = dict.fromkeys((name for name, wants in setup.wants.items() if wants), 0.0)
    names = {setup.wants[name][0].period: name for name in loads}
    for draft in drafts_of(setup):
        loads[names[draft.period]] += draft.load
    return loads


def _round_periods(present: float) -> Iterator[float]:
    """Longer periods that people would choose: 1, 2, 5 times a power of ten."""
    power = math.floor(math.log10(present))
    for exponent in range(power, power + 4):
        for digit in (1, 2, 5):
            period = round(digit * 10.0**exponent, 6)
            if present < period <= LONGEST * present:
                yield period


def _with_baud(setup: Setup, baud: int) -> Setup:
    return replace(setup, settings=replace(setup.settings, baud=baud))


def _with_period(setup: Setup, rate: str, period: float) -> Setup:
    wants = tuple(replace(want, period=period) for want in setup.wants[rate])
    return replace(setup, wants={**setup.wants, rate: wants})


def _slower(wants: tuple[Want, ...], factor: float) -> tuple[Want, ...]:
    return tuple(replace(want, period=factor * want.period) for want in wants)


def _blocks_of(setup: Setup, rate: str) -> list[Draft]:
    period = setup.wants[rate][0].period
    return [draft for draft in drafts_of(setup) if draft.period == period]


def _within(want: Want, blocks: list[Draft]) -> bool:
    return any(
        (block.unit, block.table) == (want.unit, want.table)
        and block.address <= want.address
        and want.address + want.count <= block.address + block.count
        for block in blocks
    )


def _moved(setup: Setup, moved: tuple[Want, ...], fast: str, slower: str) -> Setup:
    pattern = setup.wants[slower][0]
    later = tuple(replace(want, period=pattern.period, rank=pattern.rank) for want in moved)
    staying = tuple(want for want in setup.wants[fast] if want not in moved)
    return replace(setup, wants={**setup.wants, fast: staying, slower: setup.wants[slower] + later})


def _parts(setup: Setup, lines: int) -> Iterator[Setup]:
    for number in range(lines):
        units = setup.units[number::lines]
        numbers = {facts.unit for facts in units}
        yield replace(
            setup,
            units=units,
            wants={
                name: tuple(want for want in wants if want.unit in numbers)
                for name, wants in setup.wants.items()
            },
            comm_loss={unit: after for unit, after in setup.comm_loss.items() if unit in numbers},
        )


def _badness(part: Forecast) -> tuple[bool, float]:
    return not part.fits, part.demand
