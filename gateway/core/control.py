"""Who may command the drives: leases, maintenance, rights, and what clients are told of them. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Any, Protocol

from msgspec import structs

from gateway.bridge.api import ControlState, Happened, LeaseAct
from gateway.bridge.messages import ClientGone, DoLease, Done, Maintain
from gateway.core.agreed import Agreed
from gateway.core.clients import Clients
from gateway.core.drive import Drive
from gateway.core.guard import Ended, check_rights, refuse
from gateway.core.lease import Lease, Phase
from gateway.core.leases import Leases
from gateway.core.maintenance import MAINTAINER, Maintenance
from gateway.core.own import OwnTags, Tell
from gateway.core.permits import Permits
from gateway.core.procedure import Ask
from gateway.mapping.own import OF_CONTROL
from gateway.tag import Cause, Event, Instant, Origin, Outcome, Role, Verdict


class Record(Protocol):
    """Appends to the journal: the number of the entry, whose end is told by `Control.recorded`."""

    def __call__(self, entry: Mapping[str, Any], keep: bool = True) -> int: ...


class Writing(Protocol):
    """What it needs of the writes under way."""

    def drop(self, drive: Drive, whose: Origin | None, objection: Outcome) -> None:
        """End what this client (None: anybody) has under way on a drive, stops excepted."""

    def stop_by_itself(self, drive: Drive, why: str, done: Callable[[Outcome], None]) -> None:
        """Stop a drive for a reason of the core's own."""

    def set_by_itself(self, drive: Drive, value: Fraction, why: str, done: Callable[[Outcome], None]) -> None:
        """Write the drive's setpoint for a reason of the core's own."""


class Control:
    """Leases and maintenance of all drives, and the one answer to who may command them.

    Args:
        record: appends to the journal.
    """

    def __init__(
        self,
        drives: Iterable[Drive],
        clients: Clients,
        own: OwnTags,
        record: Record,
    ) -> None:
        self._drives = {drive.name: drive for drive in drives}
        self._clients = clients
        self._record = record
        self._leases = Leases(self._drives.values(), self)
        self._maintenance = Maintenance(self._drives.values(), self)
        self._ramps: dict[str, dict[str, float]] = {name: {} for name in self._drives}
        self._now = Instant(0.0, 0)
        self.permits = Permits(clients, self._leases, self._maintenance)
        self.writing: Writing
        """Set by the writes themselves."""
        self._own = own
        for drive in self._drives.values():
            own.register(drive.name, OF_CONTROL, self._tells(drive))

    def _tells(self, drive: Drive) -> dict[str, Tell]:
        def lease() -> Lease:
            return self._leases.get(drive)

        def through() -> str:
            holder = lease().holder
            return ", ".join(filter(None, (holder.through, holder.session, holder.address))) if holder else ""

        def left(now: float) -> float:
            return 0.0 if lease().phase is Phase.FREE else max(0.0, round(1000 * (lease().expires - now)))

        return {
            "_locked": lambda now: lease().is_guarded,
            "_lease_holder": lambda now: holder.who if (holder := lease().holder) else "",
            "_lease_through": lambda now: through(),
            "_lease_left": left,
            "_maintenance": lambda now: self._maintenance.words(drive),
            "_ramp": lambda now: ", ".join(f"{n}: {to:g}" for n, to in self._ramps[drive.name].items()),
        }

    def moment(self, now: Instant) -> None:
        """The present moment."""
        self._now = now
        self._leases.moment(now)

    # -- requests

    def asked(self, session: int, request: DoLease | ClientGone | Maintain) -> None:
        """A client asks for something about who may command a drive."""
        self.tick()
        match request:
            case DoLease():
                self.lease(session, request)
            case ClientGone():
                self.gone(session, request)
            case Maintain():
                self.maintain(session, request)

    def lease(self, session: int, request: DoLease) -> None:
        """A client acquires, renews, releases or takes a lease."""

        def carry_out() -> Outcome:
            drive = self._drive(request.drive)
            needed = drive.config.control.takeover if request.act is LeaseAct.TAKE else Role.OPERATOR
            check_rights(needed, request.origin, self._clients.ceiling(session))
            if request.act in (LeaseAct.ACQUIRE, LeaseAct.TAKE):
                self._maintenance.check(drive)
            return self._leases.carry_out(
                request.act, drive, request.origin, session, request.whom, self._now
            )

        about = {"kind": "lease_asked", "what": f"{request.drive}.{request.act}", "by": request.origin}
        self._answer(session, request.id, carry_out, about)

    def maintain(self, session: int, request: Maintain) -> None:
        """A client switches maintenance on or off."""

        about = {"kind": "maintenance_asked", "what": request.drive, "on": request.on, "by": request.origin}

        def answer(outcome: Outcome) -> None:
            self._tell(session, request.id, outcome, about)

        try:
            drive = self._drive(request.drive)
            check_rights(MAINTAINER, request.origin, self._clients.ceiling(session))
            self._maintenance.switch(drive, request.on, request.origin, request.reason, self._now, answer)
            if request.on:
                reason = f"{drive.name} was switched into maintenance"
                self.writing.drop(drive, None, refuse(Cause.MAINTENANCE, reason).outcome)
        except Ended as ended:
            answer(ended.outcome)

    def gone(self, session: int, request: ClientGone) -> None:
        """An adapter tells that one of its clients is gone."""
        self._leases.gone(request.origin, request.may_return, self._now)
        self._clients.tell(session, Done(request.id, Outcome(verdict=Verdict.CONFIRMED)))

    def _answer(
        self, session: int, id: int, carry_out: Callable[[], Outcome], about: Mapping[str, Any]
    ) -> None:
        """Do it and tell the outcome."""
        try:
            outcome = carry_out()
        except Ended as ended:
            outcome = ended.outcome
        self._tell(session, id, outcome, about)

    def _tell(self, session: int, id: int, outcome: Outcome, about: Mapping[str, Any]) -> None:
        """Tell an outcome. What changes something is on record by itself, anything else here (R1)."""
        if outcome.verdict is not Verdict.CONFIRMED:
            self._record({**about, "outcome": outcome})
        stamped = structs.replace(outcome, asked=self._now.wall, done=self._now.wall)
        self._clients.tell(session, Done(id, stamped))

    def _drive(self, name: str) -> Drive:
        drive = self._drives.get(name)
        if drive is None:
            raise refuse(
                Cause.UNKNOWN_COMMAND, f"there is no drive {name} (there are {', '.join(self._drives)})"
            )
        return drive

    def states(self) -> list[ControlState]:
        """Who may command each drive now."""
        return [self._state(drive) for drive in self._drives.values()]

    # -- what the core passes on

    def restore(self, agreed: Agreed) -> None:
        """Take up what the journal remembers."""
        self._maintenance.restore(agreed.maintenance)
        self._leases.restore(agreed.leases, self._now)

    def left(self, session: int) -> None:
        """A bridge session is gone."""
        self._leases.left(session, self._now)

    def tick(self) -> None:
        """End what has expired: before any request is looked at, however late we are."""
        self._leases.tick(self._now)
        self._maintenance.tick(self._now)

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        wakes = (self._leases.wake(), self._maintenance.wake())
        return min((wake for wake in wakes if wake is not None), default=None)

    def recorded(self, number: int, problem: str) -> None:
        """An entry of the journal is on disk, or could not be written."""
        self._maintenance.recorded(number, problem)

    def void(self, drive: Drive, reason: str) -> None:
        """What was agreed with a drive is over: see `Leases.void`."""
        self._leases.void(drive, reason, self._now)

    def stop(self, drive: Drive, why: str) -> None:
        """Stop a drive for a reason of the core's own."""
        self.writing.stop_by_itself(drive, why, lambda outcome: None)

    def finished(self, ask: Ask, outcome: Outcome) -> None:
        """What became of a request: a stop leaves nothing to make good, a setpoint stands for a run."""
        if outcome.verdict is not Verdict.CONFIRMED:
            return
        if ask.urgent:
            for drive in ask.drives:
                drive.expected.runs = False
                self._leases.stopped(drive, ask.asked.mono)
        elif ask.sets:
            ask.drive.setpoint = (ask.origin, self._now.mono)

    def started(self, ask: Ask, at: float) -> None:
        """The first frame of a run command left at ``at`` (monotonic)."""
        for drive in ask.drives:
            self._leases.started(drive, ask.origin, at)

    def ramping(self, drive: Drive, point: str, target: float | None) -> None:
        """A setpoint is on its way to a value, or no longer (None)."""
        ramps = self._ramps[drive.name]
        if target is None:
            ramps.pop(point, None)
        else:
            ramps[point] = target
        self.control_changed(drive)

    # -- services to leases and maintenance

    def record(self, entry: Mapping[str, Any], keep: bool = True) -> int:
        """Append to the journal (`Services`)."""
        return self._record(entry, keep)

    def control_changed(self, drive: Drive) -> None:
        """Clients should hear who may command the drive (`Services`)."""
        self._clients.tell_all(self._state(drive))
        self._own.changed([drive.tag(name) for name in OF_CONTROL], self._now)

    def tell_event(self, drive: Drive, name: str, text: str) -> None:
        """Tell everybody that something happened (`Services`)."""
        event = Event(time=self._now.wall, drive=drive.name, name=name, text=text)
        self._clients.tell_all(Happened(event))

    def lost_lease(self, drive: Drive, former: Origin) -> None:
        """Nothing of this client goes to the drive any more (`Services`)."""
        drive.setpoint = None
        reason = f"the lease of {drive.name} was lost before it was done"
        self.writing.drop(drive, former, refuse(Cause.LEASE, reason).outcome)

    def act(self, drive: Drive, action: str, why: str) -> None:
        """Make good what a lease left behind (`Services`)."""

        def done(outcome: Outcome) -> None:
            self._leases.acted(drive, outcome)

        def set_or_stop(outcome: Outcome) -> None:
            """H10: a stop is insisted on, and nothing stands in its way; a setpoint is tried once."""
            done(outcome)
            if outcome.verdict not in (Verdict.CONFIRMED, Verdict.SUPERSEDED):
                self.writing.stop_by_itself(drive, f"{why}, and its setpoint is not confirmed", done)

        if action == "stop":
            self.writing.stop_by_itself(drive, why, done)
            return
        assert drive.config.control.setpoint is not None
        if self._maintenance.words(drive):
            set_or_stop(refuse(Cause.MAINTENANCE, f"{drive.name} is in maintenance").outcome)
        else:
            self.writing.set_by_itself(drive, drive.config.control.setpoint, why, set_or_stop)

    def _state(self, drive: Drive) -> ControlState:
        state = self._leases.state(drive, self._now)
        return structs.replace(
            state, maintenance=self._maintenance.words(drive), ramps=dict(self._ramps[drive.name])
        )
