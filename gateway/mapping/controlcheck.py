"""The checks of who may command a drive and how fast: leases, limits, staggered starts."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from gateway.mapping.encodings import value_span
from gateway.mapping.finding import Report
from gateway.mapping.node import Path
from gateway.mapping.pacecheck import check_pace, check_slower
from gateway.mapping.profile import Point
from gateway.mapping.shape import nearest
from gateway.mapping.site import SETPOINT, DriveConfig, Site, StartGroup
from gateway.mapping.sitefile import RawSite
from gateway.mapping.values import in_words

SHORTEST_LEASE = 0.5
"""Seconds: a lease that ends sooner cannot be renewed in time."""


def _place(drive: DriveConfig) -> Path:
    return ("lines", drive.line, "drives", drive.name)


def bounds_of(drive: DriveConfig, point: Point) -> tuple[Fraction | None, Fraction | None]:
    """The profile's limits as far as they are known without the drive."""
    if point.limits is None:
        return value_span(point.encoding) or (None, None)
    bounds = (point.limits.low, point.limits.high)
    low, high = (drive.settings.get(bound) if isinstance(bound, str) else bound for bound in bounds)
    return low, high


def check_limits(drive: DriveConfig, report: Report) -> None:
    """How fast points may be changed."""
    for name, pace in drive.limits.items():
        place: Path = (*_place(drive), "limits", name)
        point = drive.profile.points.get(name)
        if point is None:
            remedy = nearest(name, [p.name for p in drive.profile.points.values() if p.access.writable])
            message = f"`{drive.profile.name}` has no point `{name}`"
            report.unknown_name(place, name, message, remedy, key=True)
        elif not point.access.writable:
            report.error(place, f"`{name}` is never written, so it has no limits", "leave it out", key=True)
        else:
            check_pace(point, pace, _below(place), report)
            check_slower(point, pace, _below(place), report)


def _below(place: Path) -> Callable[[str], Path]:
    return lambda key: (*place, key)


def check_starts(site: Site, report: Report) -> None:
    """A drive starts in one group at most, and some time must lie between the starts."""
    groups: dict[str, str] = {}
    drives = {drive.name: drive for drive in site.drives}
    names = list(drives)
    for group in site.starts:
        if group.apart <= 0:
            report.error(
                ("starts", group.name, "apart"), "no time lies between the starts", "write it like 5s"
            )
        for index, drive in enumerate(group.drives):
            place: Path = ("starts", group.name, "drives", index)
            if drive not in names:
                report.unknown_name(place, drive, f"there is no drive `{drive}`", nearest(drive, names))
            elif drive in groups:
                message = f"`{drive}` starts in the group `{groups[drive]}` already"
                report.error(place, message, "leave one of them out")
            else:
                _check_turn(drives[drive], group, place, report)
            groups.setdefault(drive, group.name)


def _check_turn(drive: DriveConfig, group: StartGroup, place: Path, report: Report) -> None:
    """Waiting for its turn must not cost a run its lease."""
    control = drive.control
    if control.lease != "off" and control.ttl <= group.apart:
        report.warn(
            place,
            f"a run of `{drive.name}` may wait {group.apart:g} s for its turn, and is refused then unless "
            f"its lease of {control.ttl:g} s is renewed meanwhile",
            "make control.ttl longer than apart, or renew the lease",
        )


def check_control(drive: DriveConfig, raw: RawSite, report: Report) -> None:
    """With writes on, somebody must have chosen what happens when the commander goes away."""
    control = drive.control
    if control.lease == "off" or report.lost.inside((*_place(drive), "control")):
        return
    if raw.writes.enabled and control.on_expiry is None:
        report.error(
            _place(drive),
            f"writes are on, and nobody chose what `{drive.name}` does when its commander goes away",
            "add control: {on_expiry: stop} (or hold, or {setpoint: 20}), or control: {lease: off}",
            key=True,
        )
    if control.ttl < SHORTEST_LEASE:
        place = (*_place(drive), "control", "ttl")
        report.error(place, f"a lease of {control.ttl:g} s cannot be renewed in time", "write 500ms or more")
    _check_expiry(drive, report)


def _check_expiry(drive: DriveConfig, report: Report) -> None:
    """The action on expiry must be one that the drive has."""
    place = (*_place(drive), "control", "on_expiry")
    if drive.control.on_expiry == "stop" and "stop" not in drive.profile.commands:
        message = f"`{drive.profile.name}` has no command `stop`"
        report.unknown_name(place, "stop", message, "choose hold or {setpoint: 20}")
    value = drive.control.setpoint
    if value is None:
        return
    point = drive.profile.points.get(SETPOINT)
    if point is None or not point.access.writable:
        message = f"`{drive.profile.name}` has no setpoint `{SETPOINT}`"
        report.unknown_name(place, SETPOINT, message, "choose stop or hold")
        return
    low, high = drive.ranges.get(point.name) or bounds_of(drive, point)
    if (low is not None and value < low) or (high is not None and value > high):
        report.error(
            place, f"the setpoint {in_words(value)} is outside the range of `{point.name}`", "correct it"
        )
