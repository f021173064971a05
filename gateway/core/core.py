"""The core: `step(event, now) -> actions`. Pure.

Owns the lines, the samples, the demands, the guard and every write under way. It never waits, never
looks at a clock and never touches a port: the shell in `gateway.core.process` feeds it events and
carries out its actions, a simulation can do the same under a virtual clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping

from gateway.bridge.api import Happened
from gateway.bridge.messages import (
    Acknowledge,
    Act,
    AskControls,
    AskDemand,
    AskHealth,
    AskTrace,
    Call,
    Done,
    Promised,
    ReadTags,
    Response,
    RunCommand,
    Samples,
    TurnedAway,
    Watch,
    WriteTag,
)
from gateway.core.aftermath import Aftermath
from gateway.core.alarms import Alarms
from gateway.core.asks import Asks
from gateway.core.catalogue import catalogue_of
from gateway.core.clients import Clients
from gateway.core.control import Control
from gateway.core.diagnostics import register
from gateway.core.doctors import Doctors
from gateway.core.drive import Drive
from gateway.core.events import (
    Action,
    Asked,
    Event,
    Joined,
    Left,
    PortLost,
    PortOpened,
    Received,
    Recorded,
    Started,
    Stopping,
    Tell,
    Ticked,
    Transmit,
)
from gateway.core.gaps import GapWatch
from gateway.core.health import Wellbeing
from gateway.core.inquiries import Inquiries
from gateway.core.lines import Lines
from gateway.core.oversight import Oversight
from gateway.core.own import OwnTags
from gateway.core.polling import Polling
from gateway.core.procedure import Ask, Procedure
from gateway.core.rarely import Rarely, never
from gateway.core.reads import Reads
from gateway.core.requests import Writes
from gateway.core.selected import SelectedReads
from gateway.core.trail import Trail
from gateway.core.turned import TurnedAways
from gateway.core.watch import Watchkeeper
from gateway.core.wear import WearGuard
from gateway.line import interface as line_does
from gateway.mapping.site import Site
from gateway.tag import GATEWAY, Instant, Sample

RELEASE_SECONDS = 0.6
"""So long after it was told to stop the core goes on to take a pulse back, before it is killed."""


class Core:
    """The whole gateway but its shells.

    Args:
        site: the configuration in force.
        version: of the program, for the catalogue.
        rarely: which rare paths to take for no reason.
    """

    ended = False
    """It was told to stop (`Stopping`) and has: the ports may be closed."""
    _ends_at = math.inf

    def __init__(self, site: Site, version: str, rarely: Rarely = never) -> None:
        self.site = site
        self.drives = [Drive(config) for config in site.drives]
        self._now = Instant(0.0, 0)
        self._actions: list[Action] = []
        self.lines = Lines(site, self.drives, self._admits, rarely)
        self.polling = Polling(self.drives, dict(site.rates), self._publish)
        self.clients = Clients(self.polling.demands, self._tell)
        self.trail = Trail(self._act)
        self._turned_away = TurnedAways(self.trail)
        self.alarms = Alarms(lambda event: self.clients.tell_all(Happened(event)), self.trail.record)
        self.own = OwnTags(self.polling.demands, self.clients.publish)
        self.wear = WearGuard(site, self.drives, self.alarms, self.own, self.trail)
        self.control = Control(self.drives, self.clients, self.own, self.trail.record)
        self._writes = self._make_writes()
        self._writes.rarely = rarely
        self._selected = SelectedReads(self.polling, site.writes_enabled, self._start_quietly)
        self._reads = Reads(self.polling, self.own, self._is_down, self._read, self._selected.read)
        self._gaps = self._gap_watch()
        self._watchkeeper = Watchkeeper(self.drives, dict(site.rates), self.polling, self.clients)
        self._oversight = self._overseer()
        self._health = Wellbeing(
            site.lines, self.lines, self.clients, self._watchkeeper, self.alarms, self.trail
        )
        self._doctors = Doctors(site.lines, self.lines, self.alarms, self.own)
        self._inquiries = Inquiries(
            self._health, self._doctors, self._gaps, self.control, self.polling, self.lines, self.clients
        )
        register(self.own, self.drives, self.lines, self._health, self.trail)
        self._aftermath = Aftermath(
            lines=self.lines,
            polling=self.polling,
            writes=self._writes,
            reads=self._reads,
            gaps=self._gaps,
            watchkeeper=self._watchkeeper,
            oversight=self._oversight,
            act=self._act,
            rarely=rarely,
        )
        self.catalogue = catalogue_of(site, self.drives, self.own, version, generation=1)

    # -- the interface of the shell

    def step(self, event: Event, now: Instant) -> list[Action]:
        """Take in one event and return what is to be done, in order."""
        self._now = now
        self.trail.moment(now)
        self.control.moment(now)
        self._writes.moment(now)
        self._selected.moment(now)
        self._oversight.moment(now)
        self._handle(event)
        self._aftermath.settle(self._now)
        self._end_if_due()
        actions, self._actions = self._actions, []
        return actions

    def _end_if_due(self) -> None:
        """End, once a pulse that is under way is taken back, or cannot be in time."""
        if self.ended or self._ends_at == math.inf or (self._writes.owes and self._now.mono < self._ends_at):
            return
        self.ended = True
        self._writes.stop(self._now, owing=True)
        self.lines.stop(self._now.mono)
        self._aftermath.settle(self._now)
        self.trail.end()

    def transmitting(self, line: str, at: float) -> None:
        """The bytes of the last `Transmit` of a line go out at this instant, a little after the step that
        decided on them."""
        self.lines.transmitting(line, at)

    def urgent(self, request: Call) -> bool:
        """True for a stop, which overtakes everything else that is asked."""
        return isinstance(request, RunCommand) and self._writes.urgent(request)

    def wake(self) -> float | None:
        """When a `Ticked` is next needed (monotonic)."""
        if self._aftermath.waits:
            return self._now.mono
        times = [
            self.lines.wake(),
            self.control.wake(),
            self._writes.wake(),
            self._selected.wake(),
            self.polling.next_check(),
            self.own.wake(),
            self._doctors.wake(),
            self._oversight.wake(),
            self.trail.wake(),
            self._ends_at if self._ends_at < math.inf and not self.ended else None,
        ]
        return min((time for time in times if time is not None), default=None)

    def look_ahead(self, at: float) -> list[Transmit]:
        """What a `Ticked` at that instant (monotonic) or soon after will transmit if nothing happens before,
        as far as that can be told without deciding anything: planned reads only. Changes nothing."""
        return [Transmit(line, data) for line, data in self.lines.look_ahead(at)]

    # -- events

    def _handle(self, event: Event) -> None:
        match event:
            case Received(line, data, at):
                self.lines.received(line, data, min(at, self._now.mono))
            case Ticked():
                self._tick()
            case PortOpened() | PortLost():
                self._port(event)
            case Asked(session, request, came):
                self._asked(session, request, min(came, self._now.mono))
            case Recorded(number, problem):
                self.trail.recorded(number, problem)
                self._journal()
                self.control.recorded(number, problem)
                self._writes.recorded(number, problem, self._now)
            case Joined() | Left():
                self._client(event)
            case Started():
                self._start(event)
            case Stopping():
                self._writes.stop(self._now)
                self._ends_at = min(self._ends_at, self._now.mono + RELEASE_SECONDS)

    def _tick(self) -> None:
        """Lines first: what else is due has a tick of its own, at once, when none of them is."""
        foretold = self.lines.tick_foretold(self._now.mono)
        self._aftermath.look_where_asked(self._now)
        if (self.lines.tick(self._now.mono) or foretold) and not self._aftermath.presses:
            return
        self._aftermath.look(self._now)
        self.control.tick()
        self._writes.tick(self._now)
        self._selected.tick(self._now)
        self.polling.check_ages(self._now)
        self.own.tick(self._now)
        self._doctors.tick(self._now)
        self._oversight.tick(self._now)
        if self.trail.tick():
            self._journal()

    def _start(self, event: Started) -> None:
        """Take up what is remembered, and begin."""
        self._health.start(self._now)
        self.trail.start(event, self.catalogue)
        if event.broken:
            text = f"the journal was changed by somebody else: {event.broken}"
            self.alarms.raise_(GATEWAY, "journal_broken", text, self._now, once=True)
        self.wear.restore(event.memory.wear)
        self.alarms.restore(event.memory.standing.alarms.values(), self._now)
        self._writes.restore(event.memory, self._now)
        self.control.restore(event.memory.agreed)
        self._gaps.restore(event.memory.gaps)
        self._replan(self._watchkeeper.start())
        self.lines.start(self._now.mono)
        self._doctors.start(self._now.mono)

    def _journal(self) -> None:
        """R2: while the journal cannot be written, nothing but a stop is obeyed, and an alarm says so."""
        problem = self.trail.problem
        self.alarms.set(
            GATEWAY, "journal", problem and f"the journal cannot be written: {problem}", self._now
        )

    def _port(self, event: PortOpened | PortLost) -> None:
        if isinstance(event, PortOpened):
            self._health.line_up(event.line)
            self.lines.port_opened(event.line, self._now.mono)
        else:
            self._health.line_down(event.line, event.reason)
            self.lines.port_lost(event.line, event.reason, self._now.mono)
            self._watchkeeper.line_down(event.line, event.reason, self._now)
            self._oversight.line_down(event.line)

    def _client(self, event: Joined | Left) -> None:
        if isinstance(event, Joined):
            self.clients.join(event.session, event.name, event.ceiling)
            states: list[Response] = [*self._watchkeeper.states(), *self.control.states()]
            for state in states:
                self.clients.tell(event.session, state)
        else:
            self.clients.leave(event.session)
            self.control.left(event.session)
            self._replan(self.polling.demands.leave(event.session))

    def _asked(self, session: int, request: Call, came: float) -> None:
        match request:
            case Watch(id, wants):
                self._watch(session, id, wants)
            case ReadTags(id, tags, max_age):
                self._reads.start(
                    tags, max_age, lambda samples: self.clients.tell(session, Samples(id, samples)), self._now
                )
            case AskControls() | AskHealth() | AskDemand() | AskTrace():
                self.clients.tell(session, self._inquiries.answer(request, self._now))
            case _:
                self._asked_to_act(session, request, came)

    def _asked_to_act(self, session: int, request: Act, came: float) -> None:
        match request:
            case WriteTag() | RunCommand():
                self._writes.ask(session, request, came, self._now)
            case TurnedAway():
                self._turned_away.record(self.clients.name(session), request, self._now)
            case Acknowledge(id, alarm, origin):
                ceiling = self.clients.ceiling(session)
                outcome = self.alarms.acknowledge(alarm, origin, ceiling, self._now)
                self.clients.tell(session, Done(id, outcome))
            case _:
                self.control.asked(session, request)

    def _watch(self, session: int, id: int, wants: Mapping[str, float | None]) -> None:
        demands = self.polling.demands
        known = {tag: period for tag, period in wants.items() if period is None or self._readable(tag)}
        new = [tag for tag, period in known.items() if period is not None and tag not in demands.of(session)]
        self._replan(demands.change(session, known))
        self._aftermath.settle(self._now)
        periods = {tag: self._period(tag) for tag in known if tag in demands.of(session)}
        self.clients.tell(session, Promised(id, {tag: p for tag, p in periods.items() if p is not None}))
        self.clients.batch(session, [self._first_sample(tag) for tag in new])

    def _readable(self, tag: str) -> bool:
        return self.own.knows(tag) or self.polling.point(tag) is not None

    def _period(self, tag: str) -> float | None:
        return self.own.period(tag) or self.polling.period(tag)

    def _first_sample(self, tag: str) -> Sample:
        return self.own.sample(tag, self._now) or self.polling.first_sample(tag, self._now)

    # -- services to the parts

    def _make_writes(self) -> Writes:
        asks = Asks(self.site, self.drives, self.polling.store, self.control.permits, self.lines.up)
        parts = self.polling, self.clients, self.lines, self.trail, self.control
        return Writes(asks, *parts, self._replan)

    def _gap_watch(self) -> GapWatch:
        return GapWatch(
            self.drives,
            lambda drive, gaps: self.lines.forbid(drive, gaps, self._now.mono),
            self._read,
            self._reads.start,
            self._leave_out,
            self.trail.record,
            lambda event: self.clients.tell_all(Happened(event)),
        )

    def _leave_out(self, drive: Drive, reasons: Mapping[str, str]) -> None:
        """Read what a drive has not no more, and the rest."""
        self.polling.leave_out(drive, reasons, self._now)
        self.lines.demand(drive.line, self.polling.wants(drive.line), self._now.mono)

    def _overseer(self) -> Oversight:
        parts = self.drives, self.polling, self.alarms, self.own
        oversight = Oversight(*parts, self._reads.start, self._replan, self.control)
        self.control.permits.objects = oversight.objection
        return oversight

    def _replan(self, tags: Collection[str]) -> None:
        """The demands on these tags changed: tell their lines what is wanted now."""
        self._selected.changed(tags)
        self.own.demanded(tags, self._now.mono)
        self._oversight.demanded(tags, self._now)
        for line in self.polling.lines_of(tags):
            self.lines.demand(line, self.polling.wants(line), self._now.mono)

    def _act(self, action: Action) -> None:
        self._actions.append(action)

    def _tell(self, session: int, message: Response) -> None:
        self._actions.append(Tell(session, message))

    def _publish(self, samples: list[Sample]) -> None:
        self._watchkeeper.look(samples, self._now)
        self._oversight.look(samples)
        self.clients.publish(samples)

    def _read(self, line: str, request: line_does.Read, deadline: float) -> int:
        job = self.lines.new_job()
        self.lines.ask(line, line_does.Job(job, request, line_does.Priority.READ, deadline), self._now.mono)
        return job

    def _is_down(self, drive: Drive) -> bool:
        return self.lines.up(drive) is False

    def _start_quietly(self, drive: Drive, make: Callable[[Ask], Procedure], deadline: float) -> None:
        self._writes.start_quietly(drive, make, deadline, self._now)

    def _admits(self, job: int) -> bool:
        return self._writes.admits(job)
