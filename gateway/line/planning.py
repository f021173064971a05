"""The plan of a line at run time: made anew when something else is wanted, or units prove slower."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gateway.line.interface import Plan, UnitFacts, Want
from gateway.line.plan import make_plan
from gateway.line.reachability import Unit
from gateway.line.requests import without
from gateway.line.schedule import Schedule
from gateway.line.transaction import Wire
from gateway.line.units import Units

REPLAN_EVERY = 10.0
"""Least seconds between plans made anew because turnarounds turned out different."""
REPACE_EVERY = 0.5
"""Seconds between adjustments of a full line to how fast its units are; the plan's promises stay."""
DRIFT = 0.25
"""Relative change of a turnaround, beyond 2 ms, that makes the plan worth making anew."""


class Planning:
    """Keeps the plan, and lets the schedule follow it."""

    def __init__(self, units: Units, wire: Wire, schedule: Schedule) -> None:
        self.plan = Plan()
        self._units = units
        self._wire = wire
        self._schedule = schedule
        self._wants: tuple[Want, ...] = ()
        self._forbidden: dict[int, tuple[tuple[int, int], ...]] = {}
        self._planned: dict[int, float] = {}
        self._planned_at = self._paced_at = -math.inf

    def want(self, wants: Sequence[Want], now: float) -> None:
        """Replace everything that is wanted."""
        self._wants = tuple(wants)
        self._units.want(self._wants)
        self._replan(now)

    def forbid(self, unit: int, gaps: tuple[tuple[int, int], ...], now: float) -> None:
        """Let no planned read of a unit pass over these addresses."""
        self._forbidden[unit] = gaps
        self._replan(now)

    def pace(self, now: float) -> None:
        """Let the schedule follow the plan, the units that are there, and how fast they really are."""
        self._paced_at = now
        there = [block for block in self.plan.blocks if self._units[block.unit].up is not False]
        load = sum(self._present_cost(block.unit, block.count) / block.period for block in there)
        self._schedule.replan(self.plan, load, now)

    def follow_drift(self, unit: Unit, now: float) -> bool:
        """Make the plan anew when a unit turns out faster or slower than it was planned; True if so."""
        if self.plan.stretch > 1 and now - self._paced_at >= REPACE_EVERY:
            self.pace(now)
        usual, planned = unit.turnaround.usual, self._planned.get(unit.facts.unit, math.inf)
        if now - self._planned_at < REPLAN_EVERY or abs(usual - planned) <= 0.002 + DRIFT * planned:
            return False
        self._replan(now)
        return True

    def _replan(self, now: float) -> None:
        self._planned = {unit.facts.unit: _rounded(unit.turnaround.usual) for unit in self._units}
        self._planned_at = now
        facts = {unit.facts.unit: self._for_plan(unit.facts) for unit in self._units}
        self.plan = make_plan(self._wants, facts, self._read_cost)
        self.pace(now)

    def _for_plan(self, facts: UnitFacts) -> UnitFacts:
        gaps = self._forbidden.get(facts.unit)
        return without(facts, gaps) if gaps else facts

    def _read_cost(self, unit: int, count: int) -> float:
        return self._wire.read_cost(count, self._planned[unit], self._units.facts(unit).pause_read)

    def _present_cost(self, unit: int, count: int) -> float:
        usual = self._units[unit].turnaround.usual
        return self._wire.read_cost(count, usual, self._units.facts(unit).pause_read)


def _rounded(turnaround: float) -> float:
    """A turnaround to plan with: units that are nearly alike can then share their blocks."""
    return float(f"{turnaround:.2g}")
