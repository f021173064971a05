"""Writes and commands: from a client's request to its outcome. Pure.

Every way of writing comes through here: the guard's checks on arrival, at-most-once, the procedure,
and in the end the same outcome for the client, for its duplicates and for the journal.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import msgspec

from gateway.bridge.api import DEFAULT_TTL
from gateway.bridge.messages import Done, RunCommand, WriteTag
from gateway.core.asks import Asks, by_itself
from gateway.core.attempts import about, content
from gateway.core.clients import Clients
from gateway.core.control import Control
from gateway.core.drive import Drive
from gateway.core.guard import (
    Ended,
    refuse,
)
from gateway.core.lease import same
from gateway.core.lines import Lines
from gateway.core.memory import Memory
from gateway.core.once import KEEP, RESTARTED, Key, Once, Waiter
from gateway.core.polling import Polling, wall_of
from gateway.core.procedure import Ask, Procedure
from gateway.core.rarely import MANY_IDS, MANY_WRITES, Rarely, never
from gateway.core.runner import Runner
from gateway.core.sending import UNRECORDED
from gateway.core.trail import Trail
from gateway.line.interface import Job, Result
from gateway.mapping.site import SETPOINT
from gateway.tag import Cause, Instant, Origin, Outcome, Role, Verdict

MAX_UNDER_WAY = 1000
"""Writes under way at once; more are refused (D2 of ``docs/safety.md``). Stops always pass."""

USED_OTHERWISE = "this id was used a moment ago for something else (give each command its own)"

OWN = Origin(through="core", who="core", role=Role.ADMIN)
"""The core itself, reading what needs a selector."""


@dataclass(slots=True)
class Pending:
    """A request under way: who waits, under which id, and what each entry in the journal tells of it.
    What the core asks by itself has nobody who waits, but may have something to be ``done`` with the outcome.
    """

    waiter: Waiter | None
    key: Key | None
    about: Mapping[str, Any]
    done: Callable[[Outcome], None] | None = None


class Writes:
    """All writes and commands of the core.

    Args:
        asks: makes asks out of requests.
        trail: puts things on record.
        control: knows who may command which drive.
        replan: tells the lines that the demands on these tags changed.
    """

    def __init__(
        self,
        asks: Asks,
        polling: Polling,
        clients: Clients,
        lines: Lines,
        trail: Trail,
        control: Control,
        replan: Callable[[Collection[str]], None],
    ) -> None:
        self.rarely: Rarely = never
        """Set by the core."""
        self._asks = asks
        self._polling = polling
        self._clients = clients
        self._lines = lines
        self._trail = trail
        self._control = control
        control.writing = self
        self._replan = replan
        self._once = Once()
        self._runner = Runner(self, polling.store)
        self._pending: dict[int, Pending] = {}
        self._jobs: set[int] = set()
        self._stopped: dict[str, float] = {}
        """When the latest stop of each drive came (monotonic)."""
        self._last = 0
        self._now = Instant(0.0, 0)
        self._stopping = False

    def restore(self, memory: Memory, now: Instant) -> None:
        """Take up what the journal remembers. Whatever was on record without an outcome has one now."""
        self._now = now
        self._asks.starts.begin(now.mono)
        self._last = memory.attempts.last
        self._once.restore(memory.attempts, self._trail.lived)
        for facts in memory.attempts.open.values():
            self._trail.record({"kind": "outcome", **facts, "outcome": RESTARTED})

    def moment(self, now: Instant) -> None:
        """The present moment."""
        self._now = now

    # -- requests

    def start_quietly(
        self, drive: Drive, make: Callable[[Ask], Procedure], deadline: float, now: Instant
    ) -> None:
        """Run a procedure that nobody waits for and that is no command of anybody."""
        self._now = now
        self._last += 1
        facts = {"ask": self._last, "what": "", "by": OWN, "outcome": "none"}
        ask = Ask(self._last, drive, "", OWN, now, deadline, about=facts)
        self._runner.start(ask, make(ask), now.mono)

    def urgent(self, request: RunCommand) -> bool:
        """True for a stop."""
        return self._asks.urgent(request)

    def ask(self, session: int, request: WriteTag | RunCommand, came: float, now: Instant) -> None:
        """A client writes one value, or gives a command, that ``came`` at this instant (monotonic)."""
        self._now = now
        key = self._key(session, request)
        if key is not None:
            what = content(about(0, request, key))
            if self._once.used_otherwise(key, what, self._trail.lived):
                self._begin(session, request, came, None, refuse(Cause.DUPLICATE, USED_OTHERWISE))
                return
            if not self._once.first(key, what, (session, request.id)):
                outcome = self._once.outcome(key)
                if outcome is not None:
                    self._clients.tell(session, Done(request.id, outcome))
                return
        self._begin(session, request, came, key)

    def _begin(
        self,
        session: int,
        request: WriteTag | RunCommand,
        came: float,
        key: Key | None,
        objection: Ended | None = None,
    ) -> None:
        now = self._now
        self._control.tick()
        self._last += 1
        facts = about(self._last, request, key)
        self._pending[self._last] = Pending((session, request.id), key, facts)
        try:
            if objection is not None:
                raise objection
            if self._stopping:
                raise refuse(Cause.SHUTTING_DOWN, "the gateway is stopping")
            timely = msgspec.structs.replace(request, ttl=request.ttl - (now.mono - came))
            ask, procedure = self._asks.prepare(self._last, session, timely, facts, now)
            self._check_overtaken(ask, came)
            self._check_room(ask, key)
            self._control.permits.accepted(ask, now)
        except Ended as ended:
            refused = msgspec.structs.replace(ended.outcome, asked=now.wall, done=now.wall)
            self._finish(self._last, refused)
        else:
            self._start(ask, procedure, came)

    def _start(self, ask: Ask, procedure: Procedure, came: float) -> None:
        if ask.urgent:
            self._stopped.update({drive.name: came for drive in ask.drives})
        self._runner.start(ask, procedure, self._now.mono)

    def _check_overtaken(self, ask: Ask, came: float) -> None:
        """What came before a stop and has its turn after it is ended by it like all that was under way."""
        if not ask.urgent and any(self._stopped.get(drive.name, came) > came for drive in ask.drives):
            raise Ended(Verdict.SUPERSEDED, Cause.SUPERSEDED, "a stop took its place")

    def _key(self, session: int, request: WriteTag | RunCommand) -> Key | None:
        return (self._clients.name(session), request.key) if request.key else None

    def _check_room(self, ask: Ask, key: Key | None) -> None:
        if ask.urgent:
            return
        for drive in ask.drives:
            if self._runner.insists(drive):
                raise refuse(Cause.PRECONDITION, f"a stop of {drive.name} is not answered yet; it goes first")
        if len(self._pending) > MAX_UNDER_WAY or self.rarely(MANY_WRITES):
            raise refuse(Cause.OVERFLOW, f"{MAX_UNDER_WAY} writes are under way already")
        if key is not None and (not self._once.room(self._trail.lived) or self.rarely(MANY_IDS)):
            reason = f"{KEEP} ids have to be remembered already (give commands a shorter time to live)"
            raise refuse(Cause.OVERFLOW, reason)
        if self._trail.problem and not ask.harmless:
            raise refuse(Cause.JOURNAL, UNRECORDED.format(self._trail.problem))

    # -- ends

    def finish(self, ask: Ask, outcome: Outcome, sent: float | None) -> None:
        """A procedure ended (`Services`)."""
        if ask.number not in self._pending:
            return
        self._control.finished(ask, outcome)
        stamped = msgspec.structs.replace(
            outcome,
            asked=ask.asked.wall,
            sent=0 if sent is None else wall_of(sent, self._now),
            done=self._now.wall,
        )
        self._finish(ask.number, stamped)

    def late(self, ask: Ask, outcome: Outcome) -> None:
        """A procedure ended whose asker has his outcome already (`Services`)."""
        self._control.finished(ask, outcome)
        self._trail.record({"kind": "late outcome", "ask": ask.number, "outcome": outcome})

    def _finish(self, number: int, outcome: Outcome) -> None:
        pending = self._pending.pop(number)
        self._trail.record({"kind": "outcome", **pending.about, "outcome": outcome})
        if pending.done is not None:
            pending.done(outcome)
        waiters = [pending.waiter] if pending.waiter is not None else []
        if pending.key is not None:
            ttl = pending.about["ttl"]
            waiters += self._once.finish(pending.key, outcome, self._trail.lived, ttl)
        for session, request in waiters:
            self._clients.tell(session, Done(request, outcome))

    @property
    def owes(self) -> bool:
        """True while something that was begun has to be ended (a pulse)."""
        return self._runner.owes

    def stop(self, now: Instant, owing: bool = False) -> None:
        """Take nothing more and end what is under way, unless ``owing`` but for what `owes`."""
        self._now = now
        self._stopping = True
        self._runner.end_all(Cause.SHUTTING_DOWN, "the gateway is stopping", now.mono, owing)

    # -- what the core passes on

    def tick(self, now: Instant) -> None:
        """Wake what waits for a time."""
        self._now = now
        self._runner.tick(now.mono)

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        return self._runner.wake()

    def recorded(self, number: int, problem: str, now: Instant) -> None:
        """A journal entry is on disk, or could not be written."""
        self._now = now
        self._runner.recorded(number, problem, now.mono)

    def observe(self, drive: str, now: Instant) -> None:
        """New samples of a drive are in the store."""
        self._now = now
        self._runner.observe(drive, now.mono)

    def owns(self, job: int) -> bool:
        """True for the jobs of writes."""
        return job in self._jobs

    def admits(self, job: int) -> bool:
        """False when a write may no longer go out; reads always may."""
        return job not in self._jobs or self._runner.admits(job)

    def job_sent(self, job: int, at: float) -> None:
        """The request of a job leaves at ``at``."""
        self._runner.job_sent(job, at)

    def job_done(self, job: int, result: Result, at: float, now: Instant) -> None:
        """What became of a job."""
        self._now = now
        self._jobs.discard(job)
        self._runner.job_done(job, result, at, now.mono)

    # -- what the core does for reasons of its own

    def drop(self, drive: Drive, whose: Origin | None, objection: Outcome) -> None:
        """End what a client (None: anybody) has under way on a drive, stops excepted (`control.Writing`)."""

        def which(ask: Ask) -> bool:
            mine = ask.needed is not None and (whose is None or same(whose, ask.origin))
            return drive in ask.drives and mine

        self._runner.drop(which, objection, self._now.mono)

    def stop_by_itself(self, drive: Drive, why: str, done: Callable[[Outcome], None]) -> None:
        """Stop a drive, as insistently as if somebody had asked for it (`control.Writing`)."""
        facts = self._own_facts(drive.tag("stop"), {}, why, done)
        ask, procedure = self._asks.own_stop(self._last, drive, by_itself(why), facts, self._now)
        self._start(ask, procedure, self._now.mono)

    def set_by_itself(self, drive: Drive, value: Fraction, why: str, done: Callable[[Outcome], None]) -> None:
        """Write the drive's setpoint once (`control.Writing`)."""
        facts = self._own_facts(drive.tag(SETPOINT), float(value), why, done)
        ask, procedure = self._asks.own_setpoint(self._last, drive, value, by_itself(why), facts, self._now)
        self._runner.start(ask, procedure, self._now.mono)

    def _own_facts(self, what: str, wanted: Any, why: str, done: Callable[[Outcome], None]) -> dict[str, Any]:
        """A new number for an ask of the core itself. It is on record like any other; nobody waits for it."""
        self._last += 1
        facts = {"ask": self._last, "what": what, "wanted": wanted, "by": by_itself(why), "ttl": DEFAULT_TTL}
        self._pending[self._last] = Pending(None, None, facts, done)
        return facts

    # -- services of the runner

    def now(self) -> float:
        """The present moment (`Services`)."""
        return self._now.mono

    def objection(self, ask: Ask) -> Outcome | None:
        """Why no frame of an ask may go any more (`Services`)."""
        objection = self._control.permits.still(ask)
        return None if objection is None else objection.outcome

    def frame_left(self, ask: Ask, at: float, first: bool) -> None:
        """A frame that can change the drive left (`Services`)."""
        self._asks.starts.frame_left(ask.number, at)
        if first and ask.starts:
            self._control.started(ask, at)
        for drive in ask.drives:
            drive.expected.leaving(starts=ask.starts, stops=ask.urgent, may_start=ask.moves and not ask.sets)

    def ramping(self, ask: Ask, point: str, target: float | None) -> None:
        """A setpoint is on its way to a value, or no longer (`Services`)."""
        self._control.ramping(ask.drive, point, target)

    def new_job(self) -> int:
        """A number for a job of ours (`Services`)."""
        job = self._lines.new_job()
        self._jobs.add(job)
        return job

    def ask_line(self, line: str, job: Job) -> None:
        """Give a job to a line (`Services`)."""
        self._lines.ask(line, job, self._now.mono)

    def withdraw(self, job: int) -> bool:
        """Take a waiting job back (`Services`)."""
        taken = self._lines.withdraw(job, self._now.mono)
        if taken:
            self._jobs.discard(job)
        return taken

    def record(self, entry: Mapping[str, Any], keep: bool = True) -> int:
        """Append to the journal (`Services`); whoever waits is told by `recorded`."""
        return self._trail.record(entry, keep)

    def watch_for(self, name: str, tags: dict[str, float | None]) -> None:
        """Change the demands of one of the core's own watchers (`Services`)."""
        changed = self._polling.demands.change(name, tags)
        if changed:
            self._replan(changed)
