"""From a request to the ask that is carried out for it: the guard on arrival. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from gateway.bridge.api import DEFAULT_TTL, TOO_LATE
from gateway.bridge.messages import RunCommand, WriteTag
from gateway.core.broadcasting import command_all, everybody_of, why_off
from gateway.core.drive import Drive
from gateway.core.guard import (
    NO_CONSENT,
    Ended,
    check_arguments,
    check_command,
    check_point,
    check_value,
    is_setpoint,
    refuse,
    starts_motor,
)
from gateway.core.permits import Permits, setpoints_of
from gateway.core.procedure import Ask, Procedure
from gateway.core.starts import Starts
from gateway.core.store import Store
from gateway.core.writing import run_command, write_point
from gateway.mapping.profile import Kind
from gateway.mapping.site import SETPOINT, Site
from gateway.tag import Cause, Instant, Origin, Role, Verdict, own_name, split_tag

Facts = Mapping[str, Any]
Prepared = tuple[Ask, Procedure]


class Asks:
    """Makes asks out of requests.

    Args:
        up: whether a drive answers; None while that is not known.
    """

    def __init__(
        self,
        site: Site,
        drives: Sequence[Drive],
        store: Store,
        permits: Permits,
        up: Callable[[Drive], bool | None],
    ) -> None:
        self._enabled = site.writes_enabled
        self._drives = {drive.name: drive for drive in drives}
        self._store = store
        self._permits = permits
        self._up = up
        self.starts = Starts(site.starts)
        self._off = {own_name(line.name): why_off(line) for line in site.lines}
        self._lines = {all_.name: (all_, members) for all_, members in everybody_of(site, drives)}

    def urgent(self, request: RunCommand) -> bool:
        """True for a stop of a drive or of a line."""
        drive = self._drives.get(request.drive)
        if request.drive in self._lines:
            drive = self._lines[request.drive][0]
        command = drive.profile.commands.get(request.name) if drive is not None else None
        return command is not None and command.urgent

    def prepare(
        self, number: int, session: int, request: WriteTag | RunCommand, about: Facts, now: Instant
    ) -> Prepared:
        """The ask for a request, and how it is carried out.

        Raises:
            Ended: if anything speaks against it that can be known without a look at the drive.
        """
        if not self._enabled:
            reason = "writing is off at this site (writes.enabled in the site file)"
            raise refuse(Cause.WRITES_DISABLED, reason)
        make = self._write if isinstance(request, WriteTag) else self._command
        return make(number, session, request, about, now)  # type: ignore[arg-type]

    def _write(self, number: int, session: int, request: WriteTag, about: Facts, now: Instant) -> Prepared:
        drive_name, point_name = split_tag(request.target)
        drive = self._drive(drive_name, Cause.UNKNOWN_TAG)
        point = check_point(drive, point_name)
        consent = self._permits.arriving(drive, request, session, point.role)
        value = check_value(drive, self._store, point, request.value, point_name, consent)
        self._check_there(drive, request)
        setpoint = request.target if is_setpoint(point) else None
        if setpoint and drive.local and point_name not in drive.expected.sources:
            raise refuse(Cause.PRECONDITION, drive.local)
        ask = Ask(
            number,
            drive,
            request.target,
            request.origin,
            now,
            now.mono + request.ttl,
            setpoint=setpoint,
            then=point.then,
            to_zero=point.name == SETPOINT and value == 0 and not point.encoding.values,
            wanted=request.value,
            about=about,
            session=session,
            needed=point.role,
            consent=consent,
            moves=point.kind is not Kind.PARAMETER,
            sets=frozenset([request.target] if setpoint else ()),
        )
        return ask, write_point(ask, self._store, point, value)

    def _command(
        self, number: int, session: int, request: RunCommand, about: Facts, now: Instant
    ) -> Prepared:
        if request.drive in self._lines:
            return self._command_all(number, session, request, about, now)
        drive = self._drive(request.drive, Cause.UNKNOWN_COMMAND)
        command = check_command(drive, request.name)
        consent = self._permits.arriving(drive, request, session, command.role, urgent=command.urgent)
        args = check_arguments(drive, self._store, command, request.args, consent)
        self._permits.check_setpoint(drive, command, request.origin, now.mono)
        if not command.urgent:
            self._check_there(drive, request)
        sets = frozenset(drive.tag(name) for name in setpoints_of(drive, command))
        ask = Ask(
            number,
            drive,
            drive.tag(command.name),
            request.origin,
            now,
            None if command.urgent else now.mono + request.ttl,
            urgent=command.urgent,
            wanted=dict(request.args),
            about=about,
            session=session,
            needed=command.role,
            consent=consent,
            starts=starts_motor(command),
            moves=bool(sets) or starts_motor(command),
            sets=sets,
        )
        return ask, run_command(ask, self._store, command, args, self.starts)

    def _command_all(
        self, number: int, session: int, request: RunCommand, about: Facts, now: Instant
    ) -> Prepared:
        """A command to all drives of a line (H18): whatever speaks against one of them speaks against it."""
        all_, members = self._lines[request.drive]
        command = check_command(all_, request.name)
        starts = starts_motor(command)
        consent = NO_CONSENT
        for member in members:
            consent = self._permits.arriving(member, request, session, command.role, urgent=command.urgent)
            if starts and self.starts.concern(member, command):
                raise refuse(Cause.PRECONDITION, f"{member.name} may not start at the same time as others")
        args = check_arguments(all_, self._store, command, request.args, consent)
        for member in () if command.urgent else members:
            self._check_there(member, request)
        ask = Ask(
            number,
            all_,
            all_.tag(command.name),
            request.origin,
            now,
            None if command.urgent else now.mono + request.ttl,
            urgent=command.urgent,
            wanted=dict(request.args),
            about=about,
            session=session,
            needed=command.role,
            consent=consent,
            starts=starts,
            moves=True,
            members=members,
        )
        return ask, command_all(ask, self._store, command, args)

    # -- what the core asks for reasons of its own

    def own_stop(self, number: int, drive: Drive, by: Origin, about: Facts, now: Instant) -> Prepared:
        """A stop, as insistent as anybody's."""
        command = drive.profile.commands["stop"]
        ask = Ask(number, drive, drive.tag(command.name), by, now, None, urgent=True, about=about)
        return ask, run_command(ask, self._store, command, {}, self.starts)

    def own_setpoint(
        self, number: int, drive: Drive, value: Fraction, by: Origin, about: Facts, now: Instant
    ) -> Prepared:
        """A write of the drive's setpoint."""
        point = drive.profile.points[SETPOINT]
        tag = drive.tag(point.name)
        ask = Ask(
            number,
            drive,
            tag,
            by,
            now,
            now.mono + DEFAULT_TTL,
            setpoint=tag,
            to_zero=value == 0,
            wanted=float(value),
            about=about,
            sets=frozenset([tag]),
        )
        return ask, write_point(ask, self._store, point, value)

    # -- checks

    def _drive(self, name: str, cause: Cause) -> Drive:
        drive = self._drives.get(name)
        line = name if name in self._off else own_name(name)
        if drive is None and line in self._lines:
            names = ", ".join(self._lines[line][0].profile.commands)
            raise refuse(cause, f"all drives of a line are commanded, not written to: {names}")
        if drive is None and line in self._off:
            raise refuse(cause, self._off[line])
        if drive is None:
            raise refuse(cause, f"there is no drive {name} (there are {', '.join(self._drives)})")
        return drive

    def _check_there(self, drive: Drive, request: WriteTag | RunCommand) -> None:
        if request.ttl <= 0:
            raise Ended(Verdict.EXPIRED, Cause.EXPIRED, TOO_LATE)
        if self._up(drive) is False:
            raise Ended(Verdict.FAILED, Cause.NO_ANSWER, f"{drive.name} does not answer")


def by_itself(why: str) -> Origin:
    """The core as somebody who asks; ``why`` stands where others have their name."""
    return Origin(through="core", who=why, role=Role.ADMIN)
