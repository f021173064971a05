"""May this go to this drive, from this client? One answer for every way of writing. Pure.

Asked when a request arrives, and again when each of its frames is about to go: a role may have sunk, a lease
may be lost, somebody may have begun to work on the drive. A stop needs the right to stop and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable

from gateway.bridge.messages import RunCommand, WriteTag
from gateway.core.clients import Clients
from gateway.core.drive import Drive
from gateway.core.guard import Consent, Ended, check_rights, refuse, starts_motor
from gateway.core.lease import same
from gateway.core.leases import Leases
from gateway.core.maintenance import Maintenance
from gateway.core.procedure import Ask
from gateway.mapping.profile import Command, Kind, Point
from gateway.tag import Cause, Instant, Origin, Role

SETPOINT_SECONDS = 60.0
"""Age up to which a setpoint counts for a run that brings none (H6)."""


class Permits:
    """Rights, maintenance, leases and setpoints of all drives."""

    def __init__(self, clients: Clients, leases: Leases, maintenance: Maintenance) -> None:
        self._clients = clients
        self._leases = leases
        self._maintenance = maintenance
        self.objects: Callable[[Drive], str] = lambda drive: ""
        """What else speaks against writing to a drive, in words; set by the core."""

    def arriving(
        self,
        drive: Drive,
        request: WriteTag | RunCommand,
        session: int,
        needed: Role | None,
        urgent: bool = False,
    ) -> Consent:
        """What a request that arrives has going for it, before its value is looked at.

        Raises:
            Ended: if it may not go.
        """
        origin = request.origin
        role = check_rights(needed, origin, self._clients.ceiling(session))
        if not urgent:
            self._check_drive(drive)
            self._leases.check(drive, origin)
        return Consent(role, request.confirm, origin.together)

    def accepted(self, ask: Ask, now: Instant) -> None:
        """A request passed all checks: it acquires or renews the lease."""
        for drive in ask.drives:
            if ask.urgent:
                self._leases.stopping(drive, ask.origin, now)
            else:
                self._leases.use(drive, ask.origin, ask.session, ask.moves, now)

    def still(self, ask: Ask) -> Ended | None:
        """Why a frame of this request may not go any more; None if it may."""
        if ask.urgent or ask.own:
            return None
        try:
            if self._clients.get(ask.session) is None:
                raise refuse(Cause.NO_RIGHTS, "whoever asked was gone before it could be sent")
            check_rights(ask.needed, ask.origin, self._clients.ceiling(ask.session))
            for drive in ask.drives:
                self._check_still(drive, ask.origin)
        except Ended as ended:
            return ended
        return None

    def _check_still(self, drive: Drive, origin: Origin) -> None:
        self._check_drive(drive)
        self._leases.check(drive, origin)
        if not self._leases.holds(drive, origin):
            raise refuse(Cause.LEASE, f"the lease of {drive.name} was lost before it could be sent")

    def _check_drive(self, drive: Drive) -> None:
        self._maintenance.check(drive)
        if reason := self.objects(drive):
            raise refuse(Cause.PRECONDITION, reason)

    # -- H6: no run without a setpoint

    def check_setpoint(self, drive: Drive, command: Command, origin: Origin, now: float) -> None:
        """A run must bring its setpoint, or follow one that this client wrote and saw read back.

        Raises:
            Ended: if it does not.
        """
        setpoints = [p for p in drive.profile.points.values() if is_speed(p)]
        if not starts_motor(command) or not setpoints or setpoints_of(drive, command):
            return
        written = drive.setpoint
        if written is None or not same(written[0], origin) or now - written[1] > SETPOINT_SECONDS:
            names = " or ".join(point.name for point in setpoints)
            raise refuse(
                Cause.PRECONDITION,
                f"write {names} first: no setpoint was written by you and read back "
                f"in the last {SETPOINT_SECONDS:g} s",
            )


def setpoints_of(drive: Drive, command: Command) -> set[str]:
    """The setpoints that a command writes itself."""
    written = (name for step in command.steps for name in step.write)
    return {name for name in written if is_speed(drive.profile.points[name])}


def is_speed(point: Point) -> bool:
    """True for the setpoints that a motor runs at."""
    return point.kind is Kind.SETPOINT and point.access.writable
