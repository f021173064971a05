"""Points behind a selector (indexed access): read as one locked sequence, write the selector, read. Pure.

The planner cannot read them in its blocks. They are read here, one after another per drive, as often as
wanted but not more often than once in `SHORTEST` seconds, and only where the site lets anything be
written at all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from gateway.core.drive import Drive
from gateway.core.guard import Ended
from gateway.core.polling import Polling
from gateway.core.procedure import Ask, Lane, Procedure, Withdrawn, read
from gateway.core.sending import select
from gateway.line.interface import Answered, Priority, Read
from gateway.mapping.profile import Point
from gateway.tag import Instant, Outcome, Quality, Sample, Verdict

SHORTEST = 0.5
"""Least period of a selected point, in seconds."""

TURN_SECONDS = 2.0
"""Time that a sequence may take to get its turn on the drive."""

NO_WRITES = "a selector has to be written first, and writing is off at this site"

StartQuietly = Callable[[Drive, Callable[[Ask], Procedure], float], None]
"""Runs a procedure that nobody waits for: drive, what makes the procedure, deadline (monotonic)."""

Done = Callable[[Sample], None]


@dataclass(slots=True)
class Turn:
    """When a selected point is next to be read, and whether that is under way."""

    due: float = 0.0
    under_way: bool = False


class SelectedReads:
    """Reads of all selected points."""

    def __init__(self, polling: Polling, enabled: bool, start: StartQuietly) -> None:
        self._polling = polling
        self._enabled = enabled
        self._start = start
        self._turns: dict[str, Turn] = {}
        self._now = Instant(0.0, 0)

    def changed(self, tags: Iterable[str]) -> None:
        """The demands on these tags changed: take up new ones and drop old ones."""
        for tag in filter(self._selected, tags):
            period = self._polling.demands.period(tag)
            if period is None:
                self._turns.pop(tag, None)
            else:
                self._turns.setdefault(tag, Turn())
                held = max(period, SHORTEST)
                self._polling.promise(tag, held, 2 * held)

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        return min((turn.due for turn in self._turns.values() if not turn.under_way), default=None)

    def tick(self, now: Instant) -> None:
        """Begin what is due."""
        self._now = now
        for tag, turn in list(self._turns.items()):
            if turn.under_way or turn.due > now.mono:
                continue
            turn.due = now.mono + max(self._polling.demands.period(tag) or 0.0, SHORTEST)
            turn.under_way = True
            self.read(tag, now, lambda sample, turn=turn: self._ended(turn, sample))  # type: ignore[misc]

    def read(self, tag: str, now: Instant, done: Done) -> None:
        """Read one selected point now; ``done`` gets its sample."""
        self._now = now
        found = self._polling.point(tag)
        assert found is not None
        drive, point = found
        if not self._enabled:
            done(Sample(tag, None, Quality.NOT_APPLICABLE, now.wall, 0.0, None, NO_WRITES))
        else:
            deadline = now.mono + TURN_SECONDS
            self._start(drive, lambda ask: self._sequence(ask, point, done), deadline)

    def moment(self, now: Instant) -> None:
        """The core's present moment, for the time stamps of what comes in."""
        self._now = now

    def _sequence(self, ask: Ask, point: Point, done: Done) -> Procedure:
        drive = ask.drive
        tag = drive.tag(point.name)
        bad = Sample(
            tag, None, Quality.NO_COMMUNICATION, ask.asked.wall, 0.0, None, "the drive did not answer"
        )
        try:
            yield Lane()
            yield from select(ask, self._polling.store, point)
            request = Read(drive.unit, point.address, point.words)
            finished = yield from read(request, Priority.COMMAND, ask.deadline)
        except Ended as ended:
            done(Sample(tag, None, Quality.REFUSED, self._now.wall, 0.0, None, ended.outcome.reason))
            return ended.outcome
        except (GeneratorExit, Withdrawn):
            done(bad)
            raise
        if isinstance(finished.result, Answered):
            done(self._polling.take(drive, point, finished.result.words, finished.at, self._now))
        else:
            done(bad)
        return Outcome(verdict=Verdict.CONFIRMED)

    def _ended(self, turn: Turn, sample: Sample) -> None:
        turn.under_way = False
        if sample.quality is not Quality.GOOD:
            self._polling.tell(sample, self._now.mono)

    def _selected(self, tag: str) -> bool:
        found = self._polling.point(tag)
        return found is not None and bool(found[1].select)
