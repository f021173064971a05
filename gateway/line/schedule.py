"""What goes onto the line next: one decision, one transaction.

Order: stop; the proof of a stop; commands; reads by deadline (earliest first, each block keeping its phase);
probes. Commands leave reads half of the line: what a command took is owed to the reads that waited meanwhile.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from gateway.line.interface import Block, Job, Plan, Priority

READ_PATIENCE = 0.5
"""Seconds after which a read that was asked once counts as late."""
PROBE_PATIENCE = 0.5
"""Seconds after which a probe counts as late, so that a full line cannot hide a returning unit."""

ReadyAt = Callable[[int], float]
"""The instant from which a unit may be asked; infinite while it is held to be down."""


def _always(unit: int) -> float:
    return -math.inf


@dataclass(slots=True)
class Due:
    """A planned read and when it is next due."""

    block: Block
    at: float
    pace: float
    """Seconds after which it is due again: its period, or less on an overloaded line."""
    done: int = 0
    """Registers of the block that were read already, if it has to be read in parts."""
    read_at: float = -math.inf
    """When it was last answered."""

    @property
    def deadline(self) -> float:
        """When it counts as late."""
        return self.at + self.block.period

    @property
    def unit(self) -> int:
        """The unit to be asked."""
        return self.block.unit


@dataclass(slots=True)
class Waiting:
    """A job that was asked and not sent yet."""

    job: Job
    asked: float

    @property
    def at(self) -> float:
        """It is due from the moment it was asked."""
        return self.asked

    @property
    def deadline(self) -> float:
        """Its place among planned reads, for jobs of priority READ."""
        return self.asked + READ_PATIENCE

    @property
    def unit(self) -> int:
        """The unit to be asked."""
        return self.job.request.unit


@dataclass(frozen=True, slots=True)
class Probe:
    """A silent unit's turn to be asked whether it is back."""

    unit: int
    at: float

    @property
    def deadline(self) -> float:
        """When it counts as late."""
        return self.at + PROBE_PATIENCE


Choice = Due | Waiting | Probe


class Schedule:
    """The reads that are due and the jobs that wait."""

    def __init__(self) -> None:
        self._reads: list[Due] = []
        self._jobs: list[Waiting] = []
        self._owed = 0.0
        self._stops: Counter[int] = Counter()
        """Units to which stops went, and which of all stops was the last."""

    def replan(self, plan: Plan, load: float, now: float) -> None:
        """Take a new plan, or another load: what the blocks of the units that are there really take of the
        wire at the periods of the plan. A read that was planned before stays the same object and keeps its
        phase: it may be on the wire just now."""
        old = {_key(due.block): due for due in self._reads}
        hurry = _hurry(plan, load)
        self._reads = []
        for block in plan.blocks:
            due = old.get(_key(block)) or Due(block, now, 0.0)
            due.block, due.at, due.pace = block, min(due.at, now + block.period), hurry * block.period
            self._reads.append(due)

    def ask(self, job: Job, now: float) -> None:
        """Let a job wait for its turn."""
        self._jobs.append(Waiting(job, now))

    @property
    def asked(self) -> bool:
        """True while a job waits."""
        return bool(self._jobs)

    def withdraw(self, job_id: int) -> bool:
        """Forget a waiting job; False when none of that id waits."""
        waiting = [entry for entry in self._jobs if entry.job.id == job_id]
        for entry in waiting:
            self._jobs.remove(entry)
        return bool(waiting)

    def drain(self) -> list[Job]:
        """Take out all jobs that wait."""
        jobs = [entry.job for entry in self._jobs]
        self._jobs.clear()
        return jobs

    def expired(self, now: float) -> list[Job]:
        """Take out the jobs whose deadline has passed."""
        gone = [entry for entry in self._jobs if _expiry(entry.job) <= now]
        for entry in gone:
            self._jobs.remove(entry)
        return [entry.job for entry in gone]

    def choose(
        self, now: float, ready_at: ReadyAt, probe: Probe | None = None, stop_at: ReadyAt = _always
    ) -> Choice | None:
        """What should go out now; None when nothing is due. Nothing is taken out."""
        if (stop := self._next_stop(now, stop_at)) is not None:
            return stop
        if (proof := self._first(Priority.PROOF, now, ready_at)) is not None:
            return proof
        read = self._next_read(now, ready_at)
        if read is None:
            self._owed = 0.0
        if self._owed <= 0 and (command := self._first(Priority.COMMAND, now, ready_at)) is not None:
            return command
        if (
            probe is not None
            and probe.at <= now
            and (read is None or probe.deadline <= min(now, read.deadline))
        ):
            return probe
        return read or self._first(Priority.PROBE, now, ready_at)

    def spent(self, choice: Choice, seconds: float) -> None:
        """Account for line time: commands run up a debt to the reads, reads pay it off."""
        if isinstance(choice, Waiting) and choice.job.priority is Priority.STOP:
            self._stops[choice.unit] = max(self._stops.values(), default=0) + 1
        if isinstance(choice, Waiting) and choice.job.priority in (Priority.PROOF, Priority.COMMAND):
            self._owed += seconds
        elif isinstance(choice, Due) or (
            isinstance(choice, Waiting) and choice.job.priority is Priority.READ
        ):
            self._owed = max(0.0, self._owed - seconds)

    def wake(self, floor: float, ready_at: ReadyAt, stop_at: ReadyAt = _always) -> float:
        """When something is next due or expires, not before ``floor``; infinite when nothing ever is.

        On a full line something is due already: the search ends with the first such read.
        """
        earliest = math.inf
        for due in self._reads:
            if due.at < earliest:
                earliest = min(earliest, max(due.at, ready_at(due.block.unit)))
                if earliest <= floor:
                    return floor
        for entry in self._jobs:
            ready = stop_at if entry.job.priority is Priority.STOP else ready_at
            earliest = min(earliest, ready(entry.unit), _expiry(entry.job))
        return max(floor, earliest)

    def _next_stop(self, now: float, ready_at: ReadyAt) -> Waiting | None:
        """The oldest stop to the unit that was stopped longest ago: a sick one, to which stops are sent again
        and again, keeps no stop to another one waiting (H20)."""
        stops = [e for e in self._jobs if e.job.priority is Priority.STOP and ready_at(e.unit) <= now]
        return min(stops, key=lambda entry: self._stops[entry.unit], default=None)

    def _first(self, priority: Priority, now: float, ready_at: ReadyAt) -> Waiting | None:
        """The oldest waiting job of a priority whose unit may be asked."""
        return next((e for e in self._jobs if e.job.priority is priority and ready_at(e.unit) <= now), None)

    def _next_read(self, now: float, ready_at: ReadyAt) -> Choice | None:
        """The read with the earliest deadline of those that are due, planned or asked once."""
        best: Choice | None = None
        deadline = math.inf
        for due in self._reads:
            if due.at <= now and due.deadline < deadline and ready_at(due.block.unit) <= now:
                best, deadline = due, due.deadline
        for entry in self._jobs:
            if (
                entry.job.priority is Priority.READ
                and entry.deadline < deadline
                and ready_at(entry.unit) <= now
            ):
                best, deadline = entry, entry.deadline
        return best


def settle(due: Due, now: float) -> None:
    """Set when a read that was answered is due again: in phase, whole periods that passed left out.

    On an overloaded line there is no phase to keep: there all reads are late alike, and take turns. What is
    later than its pace is forgiven, or a full line would never catch up with what once disturbed it.
    """
    if due.pace < due.block.period:
        due.at = max(due.at + due.pace, now)
    else:
        due.at += due.pace * max(1.0, (now - due.at) // due.pace)


def postpone(due: Due, until: float) -> None:
    """Let a read wait that failed."""
    due.at = max(due.at, until)


def _hurry(plan: Plan, load: float) -> float:
    """By what to shorten the periods of an overloaded line, so that it is full; never below what is wanted.

    What silent units leave free goes to the others: a plan's promises hold with all units there. Reads that
    come due faster than the wire can carry them would break those promises.
    """
    return 1.0 if plan.stretch <= 1 else min(1.0, max(load, 1 / plan.stretch))


def _expiry(job: Job) -> float:
    return math.inf if job.deadline is None else job.deadline


def _key(block: Block) -> tuple[int, str, int, int]:
    return block.unit, block.table, block.address, block.count
