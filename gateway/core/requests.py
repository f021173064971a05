"""Writes and commands: from a client's request to its outcome. Pure.

Every way of writing comes through here: the guard's checks on arrival, at-most-once, the procedure,
and in the end the same outcome for the client, for its duplicates and for the journal.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from gateway.bridge.messages import Done, RunCommand, WriteTag
from gateway.core.attempts import about
from gateway.core.clients import Clients
from gateway.core.drive import Drive
from gateway.core.guard import (
    Ended,
    check_command,
    check_point,
    check_rights,
    check_value,
    is_setpoint,
    refuse,
)
from gateway.core.lines import Lines
from gateway.core.memory import Memory
from gateway.core.once import KEEP, RESTARTED, Key, Once, Waiter
from gateway.core.polling import Polling, wall_of
from gateway.core.procedure import Ask, Procedure
from gateway.core.runner import Runner
from gateway.core.sending import UNRECORDED
from gateway.core.trail import Trail
from gateway.core.writing import run_command, write_point
from gateway.line.interface import Job, Result
from gateway.tag import Cause, Instant, Origin, Outcome, Role, Verdict, split_tag

MAX_UNDER_WAY = 1000
"""Writes under way at once; more are refused (D2 of ``docs/safety.md``). Stops always pass."""

OWN = Origin(through="core", who="core", role=Role.ADMIN)
"""The core itself, reading what needs a selector."""


@dataclass(slots=True)
class Pending:
    """A request under way: who waits, under which id, and what each entry in the journal tells of it.
    ``lived`` is when it came (`Trail.lived`)."""

    waiter: Waiter
    key: Key | None
    about: Mapping[str, Any]
    lived: float


class Writes:
    """All writes and commands of the core.

    Args:
        enabled: the site's ``writes.enabled``; nothing is written without it.
        trail: puts things on record.
        replan: tells the lines that the demands on these tags changed.
    """

    def __init__(
        self,
        enabled: bool,
        drives: Sequence[Drive],
        polling: Polling,
        clients: Clients,
        lines: Lines,
        trail: Trail,
        replan: Callable[[Collection[str]], None],
    ) -> None:
        self._enabled = enabled
        self._drives = {drive.name: drive for drive in drives}
        self._polling = polling
        self._clients = clients
        self._lines = lines
        self._trail = trail
        self._replan = replan
        self._once = Once()
        self._runner = Runner(self, polling.store)
        self._pending: dict[int, Pending] = {}
        self._jobs: set[int] = set()
        self._last = 0
        self._now = Instant(0.0, 0)
        self._stopping = False

    def restore(self, memory: Memory) -> None:
        """Take up what the journal remembers. Whatever was on record without an outcome has one now."""
        self._last = memory.attempts.last
        self._once.restore(memory.attempts)
        for facts in memory.attempts.open.values():
            self._trail.record({"kind": "outcome", **facts, "outcome": RESTARTED})

    # -- requests

    def write(self, session: int, request: WriteTag, now: Instant) -> None:
        """A client writes one value."""
        drive_name, point_name = split_tag(request.target)

        def prepare() -> tuple[Ask, Procedure]:
            drive = self._drive(drive_name, Cause.UNKNOWN_TAG)
            point = check_point(drive, point_name)
            self._check_rights(session, point.role, request.origin)
            number = check_value(drive, self._polling.store, point, request.value, point_name)
            setpoint = request.target if is_setpoint(point) else None
            ask = self._ask(drive, request.target, request, now, setpoint=setpoint, wanted=request.value)
            to_zero = setpoint is not None and number == 0 and not point.encoding.values
            ask = dataclasses.replace(ask, then=point.then, to_zero=to_zero)
            return ask, write_point(ask, self._polling.store, point, number)

        self._begin(session, request, prepare, now)

    def command(self, session: int, request: RunCommand, now: Instant) -> None:
        """A client gives a command."""

        def prepare() -> tuple[Ask, Procedure]:
            drive = self._drive(request.drive, Cause.UNKNOWN_COMMAND)
            command, args = check_command(drive, self._polling.store, request.name, request.args)
            self._check_rights(session, command.role, request.origin)
            what = f"{drive.name}.{command.name}"
            ask = self._ask(drive, what, request, now, urgent=command.urgent, wanted=dict(request.args))
            return ask, run_command(ask, self._polling.store, command, args)

        self._begin(session, request, prepare, now)

    def start_quietly(
        self, drive: Drive, make: Callable[[Ask], Procedure], deadline: float, now: Instant
    ) -> None:
        """Run a procedure that nobody waits for and that is no command of anybody."""
        self._now = now
        self._last += 1
        facts = {"ask": self._last, "what": "", "by": OWN, "outcome": "none"}
        ask = Ask(self._last, drive, "", OWN, now, deadline, about=facts)
        self._runner.start(ask, make(ask), now.mono)

    def _begin(
        self,
        session: int,
        request: WriteTag | RunCommand,
        prepare: Callable[[], tuple[Ask, Procedure]],
        now: Instant,
    ) -> None:
        self._now = now
        waiter = (session, request.id)
        key = self._key(session, request)
        if key is not None and not self._once.first(key, waiter):
            outcome = self._once.outcome(key)
            if outcome is not None:
                self._clients.tell(session, Done(request.id, outcome))
            return
        self._last += 1
        facts = about(self._last, request, key)
        self._pending[self._last] = Pending(waiter, key, facts, self._trail.lived)
        try:
            self._check_enabled()
            ask, procedure = prepare()
            self._check_room(ask, key)
        except Ended as ended:
            refused = msgspec.structs.replace(ended.outcome, asked=now.wall, done=now.wall)
            self._finish(self._last, refused)
        else:
            self._runner.start(ask, procedure, now.mono)

    def _key(self, session: int, request: WriteTag | RunCommand) -> Key | None:
        return (self._clients.name(session), request.key) if request.key else None

    def _ask(
        self,
        drive: Drive,
        what: str,
        request: WriteTag | RunCommand,
        now: Instant,
        *,
        urgent: bool = False,
        setpoint: str | None = None,
        wanted: Any = None,
    ) -> Ask:
        if request.ttl <= 0 and not urgent:
            raise Ended(Verdict.EXPIRED, Cause.EXPIRED, "its time to live had ended when it arrived")
        if self._lines.up(drive) is False and not urgent:
            raise Ended(Verdict.FAILED, Cause.NO_ANSWER, f"{drive.name} does not answer")
        if self._runner.insists(drive) and not urgent:
            raise refuse(Cause.PRECONDITION, f"a stop of {drive.name} is not answered yet; it goes first")
        deadline = None if urgent else now.mono + request.ttl
        facts = self._pending[self._last].about
        return Ask(
            self._last, drive, what, request.origin, now, deadline, urgent, setpoint, wanted, about=facts
        )

    # -- checks that need more than the request

    def _check_enabled(self) -> None:
        if self._stopping:
            raise refuse(Cause.SHUTTING_DOWN, "the gateway is stopping")
        if not self._enabled:
            raise refuse(
                Cause.WRITES_DISABLED, "writing is off at this site (writes.enabled in the site file)"
            )

    def _check_room(self, ask: Ask, key: Key | None) -> None:
        if ask.urgent:
            return
        if len(self._pending) > MAX_UNDER_WAY:
            raise refuse(Cause.OVERFLOW, f"{MAX_UNDER_WAY} writes are under way already")
        if key is not None and not self._once.room(self._trail.lived):
            reason = f"{KEEP} ids have to be remembered already (give commands a shorter time to live)"
            raise refuse(Cause.OVERFLOW, reason)
        if self._trail.problem and not ask.harmless:
            raise refuse(Cause.JOURNAL, UNRECORDED.format(self._trail.problem))

    def _check_rights(self, session: int, needed: Role | None, origin: Origin) -> None:
        check_rights(needed, origin, self._clients.ceiling(session))

    def _drive(self, name: str, cause: Cause) -> Drive:
        drive = self._drives.get(name)
        if drive is None:
            raise refuse(cause, f"there is no drive {name} (there are {', '.join(self._drives)})")
        return drive

    # -- ends

    def finish(self, ask: Ask, outcome: Outcome, sent: float | None) -> None:
        """A procedure ended (`Services`)."""
        if ask.number not in self._pending:
            return
        stamped = msgspec.structs.replace(
            outcome,
            asked=ask.asked.wall,
            sent=0 if sent is None else wall_of(sent, self._now),
            done=self._now.wall,
        )
        self._finish(ask.number, stamped)

    def _finish(self, number: int, outcome: Outcome) -> None:
        pending = self._pending.pop(number)
        self._trail.record({"kind": "outcome", **pending.about, "outcome": outcome})
        waiters = [pending.waiter]
        if pending.key is not None:
            ttl = pending.about["ttl"]
            waiters += self._once.finish(pending.key, outcome, pending.lived, ttl)
        for session, request in waiters:
            self._clients.tell(session, Done(request, outcome))

    def stop(self, now: Instant) -> None:
        """Take nothing more and end what is under way."""
        self._now = now
        self._stopping = True
        self._runner.end_all(Cause.SHUTTING_DOWN, "the gateway is stopping", now.mono)

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

    # -- services of the runner

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
