"""What a line will be able to do, worked out before anything runs. Pure.

All figures hold while every unit answers as it usually does; `Forecast.write_silent` is what remains when one
does not. Times are seconds. `gateway.line.repairs` knows what to change when something does not fit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from gateway.line.elastic import Draft, fit
from gateway.line.interface import Block, LineSettings, UnitFacts, Want
from gateway.line.plan import best_drafts, make_drafts
from gateway.line.reachability import FLOOR
from gateway.line.transaction import Wire
from gateway.modbus.framing import framing_of
from gateway.modbus.timing import timing_of

WRITTEN = 2
"""Registers of the write whose latency is told: a run command and its frequency."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """A line as it is configured, and what will be wanted of it.

    ``wants`` are by rate class. ``bauds`` are the speeds that all its units speak. ``comm_loss`` tells after
    how many seconds without a request a unit takes the line for dead, where it does. ``turnaround`` is how
    long every unit is taken to need before it replies; None: what the unit's facts say.
    """

    settings: LineSettings
    units: tuple[UnitFacts, ...]
    wants: Mapping[str, tuple[Want, ...]]
    bauds: tuple[int, ...] = ()
    comm_loss: Mapping[int, float] = field(default_factory=dict)
    turnaround: float | None = None


@dataclass(frozen=True, slots=True)
class PlannedRead:
    """A block, the period that is wanted of it, and the bytes of its request and reply on the wire."""

    block: Block
    wanted: float
    request: int
    reply: int


@dataclass(frozen=True, slots=True)
class Watchdog:
    """A unit that takes the line for dead after ``after`` seconds without a request.

    ``floor`` is the least time in which every unit of the line can be asked once, each with its shortest
    question; ``fitting`` how many units like this one could be, within ``after``. ``planned`` is the longest
    time between two reads of this unit by the plan, infinite when nothing of it is read.
    """

    unit: int
    after: float
    floor: float
    fitting: int
    planned: float

    @property
    def possible(self) -> bool:
        """True when there is a way to visit all units in time."""
        return self.floor <= self.after

    @property
    def fed(self) -> bool:
        """True when the planned reads visit the unit in time."""
        return self.possible and self.planned <= self.after


@dataclass(frozen=True, slots=True)
class Forecast:
    """What a line will do.

    ``demand`` is the share of the wire that all reads would take at the periods wanted (above 1: more than
    there is), ``load`` the share they take at the periods of the plan, which are up to ``stretch`` times
    longer. ``write`` is the longest time from asking for a stop until its last bit has left: the transaction
    on the wire, the silence behind it, and the frame itself; other writes may also wait for those before
    them, and every second one for a read. ``write_silent`` is the same when the transaction on the wire gets
    no answer.
    """

    reads: tuple[PlannedRead, ...]
    demand: float
    load: float
    stretch: float
    write: float
    write_silent: float
    watchdogs: tuple[Watchdog, ...]

    @property
    def fits(self) -> bool:
        """True when every period is held and no unit takes the line for dead."""
        return self.stretch <= 1 and all(watchdog.fed for watchdog in self.watchdogs)


def forecast(setup: Setup) -> Forecast:
    """What the line of a setup will do."""
    return _Paper(setup).forecast()


def demand_of(setup: Setup) -> float:
    """Share of the wire that all reads would take at the periods wanted."""
    return sum(draft.load for draft in drafts_of(setup))


def drafts_of(setup: Setup) -> list[Draft]:
    """The blocks that fetch all that is wanted, at the periods wanted."""
    return _Paper(setup).drafts


class _Paper:
    """A line on paper: what transactions cost, and what follows from it."""

    def __init__(self, setup: Setup) -> None:
        settings = setup.settings
        timing = timing_of(settings.framing, settings.baud, settings.format, settings.gap)
        self._wire = Wire(framing_of(settings.framing), timing, settings.echo)
        self._setup = setup
        self._units = {facts.unit: facts for facts in setup.units}
        wants = [want for wants in setup.wants.values() for want in wants]
        self.drafts = make_drafts(wants, self._units, self._cost)
        self._best = best_drafts(wants, self._units, self._cost)

    def forecast(self) -> Forecast:
        plan = fit(self._best)
        costs = [block.cost for block in plan.blocks] or [0.0]
        unanswered = [self._unanswered(block) for block in plan.blocks] or [0.0]
        return Forecast(
            reads=tuple(map(self._read, self._best, plan.blocks)),
            demand=sum(draft.load for draft in self.drafts),
            load=plan.load,
            stretch=plan.stretch,
            write=max(costs) + self._own_frame(),
            write_silent=max(unanswered) + self._own_frame(),
            watchdogs=tuple(
                self._watchdog(unit, after, plan.blocks) for unit, after in self._setup.comm_loss.items()
            ),
        )

    def _cost(self, unit: int, count: int) -> float:
        """Seconds of line that reading ``count`` registers takes."""
        return self._wire.read_cost(count, self._turnaround(unit), self._units[unit].pause_read)

    def _turnaround(self, unit: int) -> float:
        own = self._units[unit].reply_usual
        return own if self._setup.turnaround is None else self._setup.turnaround

    def _read(self, draft: Draft, block: Block) -> PlannedRead:
        size = self._wire.framing.size
        return PlannedRead(block, draft.period, size(5), size(2 + 2 * block.count))

    def _unanswered(self, block: Block) -> float:
        """Seconds that a read occupies the line when nothing comes back."""
        size = self._wire.framing.size
        frames = self._wire.timing.duration(size(5) + size(2 + 2 * block.count))
        return frames + max(FLOOR, self._units[block.unit].reply_max)

    def _own_frame(self) -> float:
        return self._wire.timing.duration(self._wire.framing.size(6 + 2 * WRITTEN))

    def _visit(self, unit: int) -> float:
        """Seconds of line that the shortest question to a unit takes."""
        return self._cost(unit, self._units[unit].probe[1])

    def _watchdog(self, unit: int, after: float, blocks: tuple[Block, ...]) -> Watchdog:
        floor = sum(self._visit(other) for other in self._units)
        planned = min((block.worst_age for block in blocks if block.unit == unit), default=math.inf)
        return Watchdog(unit, after, floor, int(after / self._visit(unit)), planned)
