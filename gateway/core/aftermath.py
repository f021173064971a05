"""What follows from what lines did. Pure.

To make samples of registers and tell everybody takes longer than to say what a line does next. So lines go
first: what planned reads brought waits until no line is due, and is looked at one read at a time, or all of
a line's at once where something else happened there that has to find it done.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from gateway.core.drive import Drive
from gateway.core.events import Action, Close, Open, Transmit
from gateway.core.gaps import GapWatch
from gateway.core.lines import Lines
from gateway.core.oversight import Oversight
from gateway.core.polling import Polling
from gateway.core.rarely import MANY_READS, Rarely, never
from gateway.core.reads import Reads
from gateway.core.requests import Writes
from gateway.core.watch import Watchkeeper
from gateway.line import interface as line_does
from gateway.tag import Instant

MANY = 64
"""Reads that may wait; with more, one is looked at although a line is due."""

UnitAction = line_does.BlockFailed | line_does.UnitUp | line_does.UnitDown


@dataclass(slots=True, kw_only=True)
class Aftermath:
    """Passes on what lines did to the parts that it concerns. ``act`` takes actions for the shell."""

    lines: Lines
    polling: Polling
    writes: Writes
    reads: Reads
    gaps: GapWatch
    watchkeeper: Watchkeeper
    oversight: Oversight
    act: Callable[[Action], None]
    rarely: Rarely = never
    _waiting: deque[tuple[str, line_does.BlockRead]] = field(default_factory=deque)

    @property
    def waits(self) -> bool:
        """True while a read waits to be looked at."""
        return bool(self._waiting)

    @property
    def presses(self) -> bool:
        """True when so many wait that even a line that is due has to."""
        return len(self._waiting) > MANY or (self.waits and self.rarely(MANY_READS))

    def settle(self, now: Instant) -> None:
        """Deal with what the lines did, and with what that made them do, until nothing is left but reads."""
        while (did := self.lines.next_action()) is not None:
            self._line_did(*did, now)

    def look(self, now: Instant) -> None:
        """Look at the read that has waited longest, if there is one."""
        if self._waiting:
            self._look_at([self._waiting.popleft()], now)

    def look_where_asked(self, now: Instant) -> None:
        """Look at all reads of lines on which a job waits: whether it may go out can depend on them."""
        if self._waiting:
            self._look_at_all(self.lines.asked(), now)

    def _line_did(self, line: str, action: line_does.Action, now: Instant) -> None:
        match action:
            case line_does.Transmit(data):
                self.act(Transmit(line, data))
            case line_does.OpenPort():
                self.act(Open(line))
            case line_does.ClosePort():
                self.act(Close(line))
            case line_does.JobSent(id, at):
                self.writes.job_sent(id, at)
            case line_does.BlockRead():
                self._waiting.append((line, action))
            case _:
                self._look_at_all([line], now)
                self._line_told(line, action, now)

    def _look_at_all(self, lines: list[str], now: Instant) -> None:
        """Look at what was read on these lines."""
        found = [read for read in self._waiting if read[0] in lines]
        if found:
            self._waiting = deque(read for read in self._waiting if read[0] not in lines)
            self._look_at(found, now)

    def _look_at(self, reads: Iterable[tuple[str, line_does.BlockRead]], now: Instant) -> None:
        for line, read in reads:
            drive = self.lines.drive(line, read.unit)
            self._observed(drive, read, now)
            self.gaps.read(drive, read, now)

    def _line_told(
        self, line: str, action: line_does.JobDone | line_does.PlanChanged | UnitAction, now: Instant
    ) -> None:
        match action:
            case line_does.JobDone(id, result, at):
                self._job_done(line, id, result, at, now)
            case line_does.PlanChanged():
                self.watchkeeper.plan_changed(line, self.lines.plan(line), now)
                self.oversight.plan_changed(line, self.lines.plan(line), now)
            case _:
                self._unit_did(self.lines.drive(line, action.unit), action, now)

    def _unit_did(self, drive: Drive, action: UnitAction, now: Instant) -> None:
        match action:
            case line_does.BlockFailed():
                if not self.gaps.failed(drive, action, now):
                    self.polling.failed(drive, action, now)
            case line_does.UnitUp():
                self.watchkeeper.drive_up(drive, now)
                self.oversight.drive_up(drive, now)
                self.gaps.returned(drive)
            case line_does.UnitDown():
                self.watchkeeper.drive_down(drive, action.reason, now)
                self.oversight.drive_down(drive)

    def _job_done(self, line: str, job: int, result: line_does.Result, at: float, now: Instant) -> None:
        request = self.lines.done(job)
        if isinstance(request, line_does.Read) and isinstance(result, line_does.Answered):
            block = line_does.BlockRead(request.unit, request.address, result.words, at)
            self._observed(self.lines.drive(line, request.unit), block, now)
        if self.writes.owns(job):
            self.writes.job_done(job, result, at, now)
        elif self.gaps.owns(job):
            self.gaps.job_done(job, result, now)
        else:
            self.reads.job_done(job, result, at, now)

    def _observed(self, drive: Drive, block: line_does.BlockRead, now: Instant) -> None:
        self.polling.read(drive, block, now)
        self.writes.observe(drive.name, now)
