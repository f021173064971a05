"""One line as a pure machine: events in, actions out, time as an argument.

It owns the wire: it decides what goes out next, recognises what comes back, knows which units answer, and
tells the outcome of every job exactly once. `gateway.core.shell` runs it on a port.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from gateway.line.connection import Connection
from gateway.line.consulting import asked, tell_answered
from gateway.line.doctor.doctor import Doctor
from gateway.line.doctor.finding import Finding
from gateway.line.interface import (
    Action,
    Answered,
    Counters,
    Job,
    JobDone,
    JobSent,
    LineSettings,
    Plan,
    PlanChanged,
    Refused,
    Silent,
    Transmit,
    UnitDown,
    UnitFacts,
    UnitUp,
    Unsent,
    Want,
)
from gateway.line.overhearing import MANY, Overhearing
from gateway.line.pauses import Pauses
from gateway.line.planning import Planning
from gateway.line.reachability import Unit
from gateway.line.record import Record
from gateway.line.requests import check_want, request_of
from gateway.line.schedule import Choice, Due, Probe, Schedule, Waiting, postpone
from gateway.line.telling import description, failed_blocks, purpose, told
from gateway.line.trace import Trace
from gateway.line.transaction import Question, Transaction, Wire
from gateway.line.units import Units
from gateway.modbus.framing import framing_of
from gateway.modbus.pdu import Reply
from gateway.modbus.timing import timing_of

STRAY_HOLD = 0.1
"""Bytes that nobody asked for hold a request back by so many seconds at most: a babbler stops nothing."""


class Line:
    """The machine. All methods take ``now`` in seconds of the monotonic clock; it never goes back.

    ``admit`` is asked with a job's id just before its request goes out; False drops the job unsent.
    """

    def __init__(
        self,
        settings: LineSettings,
        units: Sequence[UnitFacts],
        admit: Callable[[int], bool] = lambda _: True,
    ) -> None:
        self.settings = settings
        self.counters = Counters()
        self._admit = admit
        self._units = Units(units)
        timing = timing_of(settings.framing, settings.baud, settings.format, settings.gap)
        framing = framing_of(settings.framing)
        self._wire = Wire(framing, timing, settings.echo)
        self.trace = Trace(timing.character, timing.gap, framing.intact)
        self._connection = Connection()
        self._schedule = Schedule()
        self._record = Record()
        self._planning = Planning(self._units, self._wire, self._schedule)
        self._current: Transaction | None = None
        self._free_at = -math.inf
        self._pauses = Pauses()
        self._held = 0.0
        self._sent_at = -math.inf
        self._overhearing = Overhearing(settings.framing)
        self.doctor = Doctor(self._units.longest(), settings.framing, timing, settings.echo, self._units.late)

    # What can be asked about it

    @property
    def plan(self) -> Plan:
        """The present plan."""
        return self._planning.plan

    @property
    def gap(self) -> float:
        """The silence in seconds that is kept between frames."""
        return self._wire.timing.gap

    @property
    def is_open(self) -> bool:
        """True while the port is open."""
        return self._connection.is_open

    @property
    def asked(self) -> bool:
        """True while a job waits."""
        return self._schedule.asked

    @property
    def down_reason(self) -> str:
        """Why the port is not open; empty when it is."""
        return self._connection.reason

    def up(self, unit: int) -> bool | None:
        """Does the unit answer? None while that is not known."""
        return self._units[unit].up

    def utilisation(self, now: float) -> float:
        """Share of the last ten seconds in which the wire was in use, mandatory silences included."""
        return self._record.utilisation(now)

    def examine(self, now: float) -> list[Finding]:
        """What is wrong with the line."""
        down = [unit.facts.unit for unit in self._units if unit.up is False]
        return self.doctor.examine(down, self.is_open, now)

    def wake(self) -> float | None:
        """When `tick` is next needed; None: not before something else happens."""
        if not self.is_open:
            at = self._connection.open_at
        elif self._current is not None:
            at = min(self._current.until, self._pauses.awaited())
        else:
            probe = self._units.probe()
            probe_at = math.inf if probe is None else max(probe.at, self._pauses.until())
            due = self._schedule.wake(self._free_at, self._ready_at, self._pauses.until_for_stop)
            look_at = self._free_at if self._overhearing.waiting else math.inf
            at = min(due, look_at, max(self._free_at, probe_at), self._pauses.awaited())
        return None if at == math.inf else at

    # What happens to the port

    def start(self, now: float) -> list[Action]:
        """Open the port."""
        return self._connection.start()

    def stop(self, now: float) -> list[Action]:
        """End what is going on and close the port. Every job is told."""
        return [*self._abandon(now), *self._connection.stop()]

    def port_opened(self, now: float) -> list[Action]:
        """The port is ready for use."""
        self._connection.opened()
        self._record.start(now)
        self.doctor.opened(now)
        self._free_at = now + self.gap
        return self._advance(now)

    def port_lost(self, reason: str, now: float) -> list[Action]:
        """The port could not be opened, or vanished. It is opened again after a pause."""
        self._connection.lost(reason, now)
        for unit in self._units:
            unit.forget()
        return self._abandon(now)

    def received(self, data: bytes, now: float) -> list[Action]:
        """Bytes came in."""
        if self._current is None:
            return self._stray(data, now)
        self._free_at = now + self.gap
        self.trace.received(data, now)
        self._current.feed(data, now)
        return self.tick(now) if now >= self._current.until else []

    def tick(self, now: float) -> list[Action]:
        """Time has passed."""
        if not self.is_open:
            return self._connection.tick(now)
        actions: list[Action] = []
        done = self._current
        if done is not None and now >= done.until:
            actions = self._timed_out(done, now) if done.reply is None else self._replied(done, now)
        return [*actions, *self._advance(now)]

    def leaves(self, at: float) -> None:
        """The request that was sent last goes out at this instant, a little after it was decided on."""
        self.trace.leaves(at)
        late, self._sent_at = max(0.0, at - self._sent_at), at
        if self._current is not None:
            self._current.delay(late)
        else:  # nobody answers it
            self._free_at += late

    def look_ahead(self, at: float) -> bytes:
        """The planned read that `tick` will send at an instant if nothing happens before; empty for anything
        else, and on a network, where nobody counts milliseconds and each request takes a number."""
        if not self.is_open or self._current is not None or at < self._free_at or self._wire.framing.numbered:
            return b""
        if self._pauses.awaited() <= at or self._overhearing.waiting:
            return b""
        choice = self._choice(at)
        request = self._units.foretold(choice, at) if isinstance(choice, Due) else None
        return self._wire.framing.encode(choice.unit, request.pdu) if choice and request else b""

    # What is wanted and asked

    def demand(self, wants: Sequence[Want], now: float) -> list[Action]:
        """Replace all that is wanted, for the next `tick`. Raises `ValueError` when it can never be met."""
        for want in wants:
            check_want(self._units.facts(want.unit), want)
        self._planning.want(wants, now)
        down = [unit for unit in self._units if unit.up is False]
        return [PlanChanged(), *failed_blocks(self.plan, down, now)]

    def forbid(self, unit: int, gaps: tuple[tuple[int, int], ...], now: float) -> list[Action]:
        """Let no planned read of a unit pass over these addresses. What is asked once may."""
        self._planning.forbid(unit, gaps, now)
        return [PlanChanged(), *self._advance(now)]

    def ask(self, job: Job, now: float) -> list[Action]:
        """Let a job wait for its turn. Raises `ValueError` when its unit cannot take such a request."""
        request_of(self._units.facts(job.request.unit), job.request)
        if not self.is_open:
            return [JobDone(job.id, Unsent("line_down"), now)]
        self._schedule.ask(job, now)
        return self._advance(now)

    def withdraw(self, job_id: int, now: float) -> bool:
        """Forget a job; True when it was still waiting, and then nothing more is told of it."""
        return self._schedule.withdraw(job_id)

    # Deciding

    def _advance(self, now: float) -> list[Action]:
        """Drop what expired, and begin the next transaction when the wire is free."""
        actions: list[Action] = [JobDone(job, Answered(), now) for job in self._pauses.over(now)]
        actions += [JobDone(job.id, Unsent("expired"), now) for job in self._schedule.expired(now)]
        if self._is_free(now):
            self._overhear(b"", now)
        while self._is_free(now) and (choice := self._choice(now)) is not None:
            actions += self._take_up(choice, now)
        return actions

    def _is_free(self, now: float) -> bool:
        return self.is_open and self._current is None and now >= self._free_at

    def _choice(self, now: float) -> Choice | None:
        probe = self._units.probe() if now >= self._pauses.until() else None
        return self._schedule.choose(now, self._ready_at, probe, self._pauses.until_for_stop)

    def _ready_at(self, unit: int) -> float:
        """The instant from which a unit may be asked, by all that is known of it and of the line."""
        return max(self._units.ready_at(unit), self._pauses.until())

    def _take_up(self, choice: Choice, now: float) -> list[Action]:
        """Turn a decision into a request on the wire, or into the reason why there is none."""
        question = self._units.question(choice, self._wire.echo.there, now)
        if question is None:
            assert isinstance(choice, Due), "only a planned read can wait for its turn"
            postpone(choice, self._units.postponed(choice.unit, now))
            return []
        if isinstance(choice, Waiting) and not question.aside:
            return self._send_job(question, choice.job, now)
        if isinstance(choice, Probe):
            self._units[choice.unit].probed(now)
        return self._send(question, now)[0]

    def _send_job(self, question: Question, job: Job, now: float) -> list[Action]:
        """Ask for admission, then send."""
        self._schedule.withdraw(job.id)
        if not self._admit(job.id):
            return [JobDone(job.id, Unsent("not_admitted"), now)]
        actions, sent = self._send(question, now)
        actions.append(JobSent(job.id, sent.ends))
        if not question.answered:
            self.trace.unanswered()
            self._over(sent, sent.ends, now, job.id)
        return actions

    def _send(self, question: Question, now: float) -> tuple[list[Action], Transaction]:
        sent = self._wire.begin(question, self._units.patience(question), now)
        self._current = sent
        self._sent_at = now
        self._held = 0.0
        if question.write is not None:
            self._units.wrote(question, sent.ends)
        self.counters.requests += 1
        self.doctor.sent(question.unit, len(sent.data), isinstance(question.choice, Probe), now)
        self.trace.sent(sent.data, purpose(question), now)
        return [Transmit(sent.data)], sent

    # What became of a transaction

    def _replied(self, done: Transaction, now: float) -> list[Action]:
        reply, request, unit = done.reply, done.question.request, self._units[done.question.unit]
        assert reply is not None, "it ended with a reply"
        self._overhear(done.surplus, now)
        news = self._heard(unit, done.heard_at)
        if older := unit.punctual.impossible(self._wire.too_early(done)):
            unit.overheard(request, False, True, done.heard_at, now)
        since = None if older else self._units.weigh(done, reply, self.settings.framing)
        if older or (since is None and reply.exception is not None):
            done.doubt(reply.exception)
            return [*news, *self._timed_out(done, now)] if now >= done.deadline else news
        self._over(done, done.heard_at, now)
        if since is not None:
            unit.turnaround.answered(self._wire.turnaround(done))
        if unit.doubling.answered(now):
            self._pauses.listen(done.heard_at, unit.turnaround.probe_limit)
        if not unit.doubling.believed and request.reads:
            since = None
        self.trace.answered(description(reply, doubtful=since is None), done.seeker.length)
        tell_answered(self.doctor, self._wire, done, since is not None, now)
        if since is None:
            self.counters.damaged += 1
            return [*news, *told(done, Silent(damaged=True, doubted=True), now, now)]
        new_plan = [PlanChanged()] if self._planning.follow_drift(unit, now) else []
        return [*news, *told(done, self._counted(reply), since, now), *new_plan]

    def _heard(self, unit: Unit, now: float) -> list[Action]:
        if not unit.heard():
            return []
        self._planning.pace(now)
        return [UnitUp(unit.facts.unit, now)]

    def _counted(self, reply: Reply) -> Answered | Refused:
        if reply.exception is None:
            self.counters.answered += 1
            return Answered(reply.words)
        self.counters.refused += 1
        return Refused(reply.exception)

    def _timed_out(self, done: Transaction, now: float) -> list[Action]:
        unit = self._units[done.question.unit]
        self._over(done, max(done.ends, self._free_at - self.gap), now)
        self.trace.unanswered("time-out")
        if done.heard:
            self.counters.damaged += 1
        else:
            self.counters.timeouts += 1
        self.doctor.missed(asked(self._wire, done), done.seeker.heard, now)
        unit.turnaround.missed()
        unit.unanswered(done, self.settings.framing)
        self._overhear(done.surplus, now)  # which may be the reply, with something behind it
        if done.question.aside:  # what was chosen is still due: let the other units go first
            unit.blocked_until = 2 * now - done.began
        actions = told(done, Silent(done.heard, done.doubted, done.code), now, now, again=unit.is_new)
        if done.doubted or not unit.silent(done.began, now):
            return actions
        self._planning.pace(now)
        self.doctor.down(done.question.unit, now)
        reason = "damaged replies only" if done.heard else "no answer"
        down = UnitDown(done.question.unit, now, reason)
        return [*actions, down, *failed_blocks(self.plan, [unit], now)]

    def _over(self, done: Transaction, silent_since: float, now: float, job: int | None = None) -> None:
        """The transaction is off the wire, which is silent since an instant. ``job`` is done when the
        silence after it is over too: nobody answers it."""
        self._current, silent_since = None, max(silent_since, done.ends)  # late answers come before its end
        self._free_at = max(now, silent_since + self.gap)
        pause_ends = silent_since + self._units.pause(done.question)
        if job is not None or pause_ends > self._free_at:
            self._pauses.keep(done.question.unit, max(pause_ends, self._free_at), job)
        self._wire.echo.learn(done)
        self._account(done, max(pause_ends, self._free_at))

    def _account(self, done: Transaction, free_at: float) -> None:
        """Note what the transaction took of the line, until the next could begin."""
        self._record.used(done.began, free_at)
        self._schedule.spent(done.question.choice, free_at - done.began)
        if isinstance(done.question.choice, Probe):
            self._units.probing.spent(done.began, free_at - done.began)

    def _abandon(self, now: float) -> list[Action]:
        """End the transaction on the wire and all that wait."""
        actions: list[Action] = []
        if self._current is not None:
            done, self._current = self._current, None
            self.trace.unanswered("line lost")
            self._units[done.question.unit].unanswered(done, self.settings.framing)
            choice = done.question.choice
            if isinstance(choice, Waiting) and not done.question.aside:
                actions.append(JobDone(choice.job.id, Silent(damaged=done.heard), now))
        actions += [JobDone(job, Silent(), now) for job in self._pauses.drop()]
        return actions + [JobDone(job.id, Unsent("line_down"), now) for job in self._schedule.drain()]

    def _stray(self, data: bytes, now: float) -> list[Action]:
        """Bytes that nobody asked for: keep the silence after them, within reason."""
        self.trace.received(data, now)
        self._overhear(data, now, least=MANY)
        self.doctor.stray(data, now)
        wait = now + self.gap - max(now, self._free_at)  # in a silence nothing is held back
        held = wait + (self._held if now <= self._free_at else 0.0)
        if wait > 0 and held <= STRAY_HOLD:
            self._held, self._free_at = held, now + self.gap
        return []

    def _overhear(self, data: bytes, now: float, least: int = 0) -> None:
        asking = self._current.question.unit if self._current else None
        for news in self._overhearing.news(data, now, least):
            self._units.overheard(news, news.unit == asking, now)
