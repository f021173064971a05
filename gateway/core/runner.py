"""Serves the procedures that are under way. Pure.

One procedure at a time writes to a drive (its *lane*); the others wait their turn. A newer write to the
same setpoint takes the place of a waiting one, and a stop that of everything but other stops.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Protocol

from gateway.core.conditions import contradicted, proved
from gateway.core.drive import Drive
from gateway.core.guard import Ended
from gateway.core.lanes import Lanes
from gateway.core.procedure import (
    Ask,
    Effect,
    Exchange,
    Finished,
    Intend,
    IsLast,
    IsOutrun,
    Lane,
    Leave,
    Owing,
    Pause,
    Procedure,
    Prove,
    Ramping,
    Report,
    StopEach,
    Withdrawn,
)
from gateway.core.running import Running, faulty, name_of, names_of, tags_of
from gateway.core.store import Store
from gateway.line.interface import Job, Refused, Result, Unsent, Write
from gateway.tag import Cause, Outcome, Verdict

PROOF_PERIOD = 0.1
"""Seconds between the reads of the points that a proof watches."""


class Services(Protocol):
    """What procedures need from the rest of the core."""

    def new_job(self) -> int:
        """A number for a job that is about to be asked."""

    def ask_line(self, line: str, job: Job) -> None:
        """Give a job to a line; its end is told by `Runner.job_done`."""

    def withdraw(self, job: int) -> bool:
        """Take a waiting job back; False when it is on the wire or done."""

    def record(self, entry: Mapping[str, Any], keep: bool = True) -> int:
        """Append to the journal; the number of the entry, whose end is told by `Runner.recorded`."""

    def watch_for(self, name: str, tags: dict[str, float | None]) -> None:
        """Change the demands of one of the core's own watchers."""

    def objection(self, ask: Ask) -> Outcome | None:
        """Why no frame of this ask may go any more; asked just before one goes."""

    def frame_left(self, ask: Ask, at: float, first: bool) -> None:
        """A frame that can change the drive left (monotonic), the ``first`` one of this ask or not."""

    def stop_by_itself(self, drive: Drive, why: str, done: Callable[[Outcome], None]) -> None:
        """Stop a drive for a reason of the core's own; ``done`` hears what became of it."""

    def now(self) -> float:
        """The present moment (monotonic)."""

    def ramping(self, ask: Ask, point: str, target: float | None) -> None:
        """A setpoint is on its way to a value, or no longer (None)."""

    def finish(self, ask: Ask, outcome: Outcome, sent: float | None) -> None:
        """Tell the final outcome to whoever asked; ``sent`` is when the first frame left (monotonic)."""

    def late(self, ask: Ask, outcome: Outcome) -> None:
        """Note the outcome of an ask whose asker has been told another one."""


class Runner:
    """All procedures of the core."""

    def __init__(self, services: Services, store: Store) -> None:
        self._services = services
        self._store = store
        self._running: dict[int, Running] = {}
        self._jobs: dict[int, int] = {}
        self._notes: dict[int, tuple[int, int, bool]] = {}
        """Of the intents that are not on disk yet: ask, frame, and whether they get there in any case."""
        self._lanes = Lanes()

    def start(self, ask: Ask, procedure: Procedure, now: float) -> None:
        """Begin a procedure; an urgent one first puts an end to what others have under way."""
        if ask.urgent:
            self._abandon(ask, lambda other: not other.ask.urgent or other.told, "a stop")
        if ask.setpoint is not None:
            self._abandon(
                ask, lambda other: other.ask.setpoint == ask.setpoint and other.sent is None, "a newer value"
            )
        for older in self._running.values():
            of_all = bool(ask.members) and not set(ask.members).isdisjoint(older.ask.drives)
            older.outrun = older.outrun or of_all or bool(older.ask.sets & ask.sets)
        self._running[ask.number] = Running(ask, procedure)
        self._advance(self._running[ask.number], None, now)

    def insists(self, drive: Drive) -> bool:
        """True while a stop of this drive is not answered although its asker has given up waiting."""
        return any(running.told and drive in running.ask.drives for running in self._running.values())

    def job_sent(self, job: int, at: float) -> None:
        """The request of a job leaves at ``at``."""
        running = self._running.get(self._jobs.get(job, -1))
        if running is None or not isinstance(running.effect, Exchange):
            return
        if isinstance(running.effect.request, Write):
            running.recorded = None
            first = running.sent is None
            running.sent = at if running.sent is None else running.sent
            running.owing = running.owing or running.will_owe
            self._services.frame_left(running.ask, at, first)

    def job_done(self, job: int, result: Result, at: float, now: float) -> None:
        """What became of a job."""
        running = self._running.get(self._jobs.pop(job, -1))
        if running is not None and running.job == job:
            running.job = None
            self._unsent(running)
            if isinstance(result, Refused | Unsent):
                self._spared(running)
            self._advance(running, Finished(result, at, running.objection), now)

    def recorded(self, note: int, problem: str, now: float) -> None:
        """A journal entry is on disk, or could not be written."""
        ask, frame, kept = self._notes.pop(note, (-1, 0, False))
        running = self._running.get(ask)
        if running is not None and running.note == note:
            self._noted(running, problem, now)
        elif ask >= 0 and (kept or not problem):
            self._services.record({"kind": "unsent", "ask": ask, "frame": frame})

    def admits(self, job: int) -> bool:
        """False when what a write needs no longer holds; asked just before its frame goes out."""
        running = self._running.get(self._jobs.get(job, -1))
        if running is None or not isinstance(running.effect, Exchange):
            return False
        if isinstance(running.effect.request, Write) and not running.owing:
            running.objection = running.objection or self._services.objection(running.ask)
            if running.objection is not None:
                return False
        condition = running.effect.condition
        return all(contradicted(drive, self._store, condition) is None for drive in running.ask.drives)

    def drop(self, which: Callable[[Ask], bool], objection: Outcome, now: float) -> None:
        """Asks that may not go on: what was not sent ends at once, and of the others no more frames go."""
        for running in [r for r in self._running.values() if not r.ask.urgent and which(r.ask)]:
            running.objection = objection
            if running.sent is None and running.ask.number in self._running:
                self._withdraw(running)
                self._end(running, objection, now)

    def observe(self, drive: str, now: float) -> None:
        """New samples of a drive are in the store: look whether a proof is complete."""
        for running in list(self._running.values()):
            effect = running.effect
            drives = running.ask.drives
            if not isinstance(effect, Prove) or not any(each.name == drive for each in drives):
                continue
            if all(proved(each, self._store, effect.condition, effect.since) for each in drives):
                self._advance(running, True, now)

    def tick(self, now: float) -> None:
        """Wake the procedures whose time has come."""
        for running in list(self._running.values()):
            if running.wake is None or running.wake > now:
                continue
            if isinstance(running.effect, Intend):
                self._noted(running, "the disk does not answer", now)
            else:
                self._advance(running, now if isinstance(running.effect, Pause) else False, now)

    def wake(self) -> float | None:
        """When `tick` is next needed."""
        return min((r.wake for r in self._running.values() if r.wake is not None), default=None)

    @property
    def owes(self) -> bool:
        """True while something that was begun has to be ended (a pulse)."""
        return any(running.owing for running in self._running.values())

    def end_all(self, cause: Cause, reason: str, now: float, owing: bool = False) -> None:
        """End everything; what was sent is unknown, what was not is refused. Unless ``owing``, what has to
        end something first (`owes`) does so, without delay."""
        for running in list(self._running.values()):
            if running.owing and not owing:
                running.wake = now if isinstance(running.effect, Pause) else running.wake
                continue
            verdict = Verdict.REFUSED if running.sent is None else Verdict.UNKNOWN
            self._end(running, Outcome(verdict=verdict, cause=cause, reason=reason), now)

    def _advance(self, running: Running, answer: Any, now: float) -> None:
        """Give the procedure its answer and serve what it yields next, until it has to wait."""
        self._leave_proof(running)
        running.effect = running.wake = None
        while True:
            try:
                running.effect = running.procedure.send(answer)
                waits, answer = self._serve(running, running.effect, now)
            except StopIteration as stop:
                return self._end(running, stop.value, now)
            except Ended as ended:
                return self._end(running, ended.outcome, now)
            except Exception as error:  # a fault of ours must leave neither the asker nor the drive waiting
                return self._end(running, faulty(running, error), now)
            if waits:
                return None

    def _serve(self, running: Running, effect: Effect, now: float) -> tuple[bool, Any]:
        """Begin an effect: whether the procedure has to wait for it, and its answer if not."""
        match effect:
            case Lane():
                return not self._lanes.enter(running.ask.number, names_of(running)), now
            case Exchange():
                self._exchange(running, effect)
            case Intend():
                self._intend(running, effect, now)
                return effect.patience is not None, ""
            case Pause():
                running.wake = now + effect.seconds
            case Prove():
                running.wake = effect.until
                self._services.watch_for(
                    name_of(running), dict.fromkeys(tags_of(running, effect.condition), PROOF_PERIOD)
                )
            case StopEach():
                self._stop_each(running, effect)
            case _:
                return False, self._answer(running, effect, now)
        return True, None

    def _answer(self, running: Running, effect: Effect, now: float) -> bool | None:
        """The answer of an effect that waits for nothing."""
        match effect:
            case Leave():
                self._leave(running, now)
            case Report(outcome):
                running.told = True
                self._services.finish(running.ask, outcome, running.sent)
            case IsLast():
                return self._is_last(running)
            case IsOutrun():
                return running.outrun
            case Ramping(point, target):
                running.ramp = point
                self._services.ramping(running.ask, point, target)
            case Owing(on, once_sent):
                running.owing, running.will_owe = on and not once_sent, on and once_sent
        return None

    def _is_last(self, running: Running) -> bool:
        others = (self._running[number].ask for number in self._lanes.beside(running.ask.number))
        return not any(other.then == running.ask.then for other in others)

    def _intend(self, running: Running, effect: Intend, now: float) -> None:
        running.frames += 1
        running.recorded = running.frames
        running.wears = effect.facts.get("wears", ())
        entry = {"kind": "intent", **running.ask.about, "frame": running.frames, **effect.facts}
        if running.told:
            entry["outcome"] = "told"
        number = self._services.record(entry, effect.keep)
        if effect.patience is not None:
            running.note, running.wake = number, now + effect.patience
            self._notes[number] = (running.ask.number, running.frames, effect.keep)

    def _noted(self, running: Running, problem: str, now: float) -> None:
        """An intent is on disk, or the problem says why it is not, or not yet."""
        assert isinstance(running.effect, Intend)
        if running.effect.keep:
            self._notes.pop(running.note or 0, None)
        elif problem:
            running.recorded = None
        running.note = None
        self._advance(running, problem, now)

    def _unsent(self, running: Running) -> None:
        """Put on record that the frame whose intent is on record did not go out."""
        if running.recorded is not None and running.note is None:
            entry = {"kind": "unsent", "ask": running.ask.number, "frame": running.recorded}
            self._services.record(entry)
            running.recorded = None

    def _spared(self, running: Running) -> None:
        """H14: put on record that the frame wore nothing, since it was not carried out."""
        if (
            isinstance(running.effect, Exchange)
            and isinstance(running.effect.request, Write)
            and running.wears
        ):
            facts = {"ask": running.ask.number, "frame": running.frames, "drive": running.ask.drive.name}
            self._services.record({"kind": "spared", **facts, "wears": running.wears})

    def _exchange(self, running: Running, effect: Exchange) -> None:
        if isinstance(effect.request, Write) and running.recorded is None:
            raise RuntimeError("a frame that is not on record")  # R1: whatever a procedure forgets
        running.job = self._services.new_job()
        self._jobs[running.job] = running.ask.number
        job = Job(running.job, effect.request, effect.priority, effect.deadline)
        self._services.ask_line(running.ask.drive.line, job)

    def _stop_each(self, running: Running, effect: StopEach) -> None:
        """Begin a stop of each drive; the procedure goes on when all of them have an outcome."""
        outcomes: dict[str, Outcome] = {}

        def done(drive: Drive, outcome: Outcome) -> None:
            outcomes.setdefault(drive.name, outcome)
            if len(outcomes) == len(effect.drives) and running.effect is effect:
                answer = [outcomes[each.name] for each in effect.drives]
                self._advance(running, answer, self._services.now())

        for drive in effect.drives:
            self._services.stop_by_itself(drive, effect.why, partial(done, drive))

    def _leave(self, running: Running, now: float) -> None:
        """Take a procedure out of its lane and let the next one in."""
        for number in self._lanes.leave(running.ask.number):
            if number in self._running:
                self._advance(self._running[number], now, now)

    def _leave_proof(self, running: Running) -> None:
        if isinstance(running.effect, Prove):
            tags = tags_of(running, running.effect.condition)
            self._services.watch_for(name_of(running), dict.fromkeys(tags))

    def _abandon(self, by: Ask, which: Callable[[Running], bool], what: str) -> None:
        """End other procedures on the same drive, as superseded."""
        for running in list(self._running.values()):
            meets = not set(by.drives).isdisjoint(running.ask.drives)
            if meets and running.ask.number in self._running and which(running):
                late = "" if running.sent is None else " after it was sent and before it was proved"
                reason = f"{what} took its place{late}"
                outcome = Outcome(verdict=Verdict.SUPERSEDED, cause=Cause.SUPERSEDED, reason=reason)
                self._withdraw(running)
                self._end(running, outcome, by.asked.mono)

    def _withdraw(self, running: Running) -> None:
        if running.job is not None and self._services.withdraw(running.job):
            self._jobs.pop(running.job, None)

    def _end(self, running: Running, outcome: Outcome, now: float) -> None:
        self._leave_proof(running)
        if running.recorded is not None:
            with contextlib.suppress(Withdrawn):
                running.procedure.throw(Withdrawn())
        self._unsent(running)
        if running.ramp is not None:
            self._services.ramping(running.ask, running.ramp, None)
        running.effect = None
        del self._running[running.ask.number]
        running.procedure.close()
        if running.told:
            self._services.late(running.ask, outcome)
        else:
            self._services.finish(running.ask, outcome, running.sent)
        self._leave(running, now)
