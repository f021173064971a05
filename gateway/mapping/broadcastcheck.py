"""The checks of what is sent to all drives of a line at once: in a profile, and on the lines of a site."""

from __future__ import annotations

from collections.abc import Mapping

from gateway.mapping.finding import Report
from gateway.mapping.node import Path
from gateway.mapping.profile import Broadcast, Point
from gateway.mapping.resolve import Resolved
from gateway.mapping.shape import nearest
from gateway.mapping.site import LineConfig

PERCENT = "%"


def check_sets(resolved: Resolved, report: Report) -> None:
    """`sets` names a point of the drives that takes what is sent to all of them."""
    profile = resolved.profile
    for point in profile.points.values():
        if point.sets is not None:
            place = (*resolved.layout.keys[point.name].path, "sets")
            report.error(place, "`sets` belongs to a point of `broadcast`", "leave it out", key=True)
    for point in profile.broadcast.points.values() if profile.broadcast else ():
        keys = resolved.broadcast.keys[point.name]
        _check_fixed(point, keys.path, report)
        if keys.traits.kind is not None and point.role is None:
            message = f"kind `{point.kind}` is only read, and nobody answers what is sent to all"
            remedy = "choose setpoint, switch, command or parameter"
            report.error(keys.place("kind"), message, remedy)
        if point.sets is not None:
            place = (*resolved.broadcast.keys[point.name].path, "sets")
            _check_target(point, point.sets, profile.points, place, report)


def _check_fixed(point: Point, place: Path, report: Report) -> None:
    """What is sent to all means the same to all."""
    bounds = (point.limits.low, point.limits.high) if point.limits else ()
    names = [name for name in (point.encoding.times, point.shift, *bounds) if isinstance(name, str)]
    if point.cases or point.when or names:
        message = f"`{point.name}` is sent to all drives, and can depend on nothing of one of them"
        report.error(place, message, "write plain numbers", key=True)


def _check_target(point: Point, name: str, points: Mapping[str, Point], place: Path, report: Report) -> None:
    target = points.get(name)
    if target is None:
        report.unknown_name(place, name, f"`{name}` is no point", nearest(name, list(points)))
    elif not target.access.writable:
        report.error(place, f"`{name}` is never written", "name the point that takes the value")
    elif point.encoding.symbol == PERCENT != target.encoding.symbol:
        if target.limits is None:
            message = f"`{name}` has no `range`, so nobody knows what 100 % of it is"
            report.error(place, message, "give it one")
    elif point.encoding.symbol != target.encoding.symbol:
        message = f"`{point.name}` and `{name}` do not count in the same unit"
        report.error(place, message, "give both one unit, or let this one count in %")


def check_line(line: LineConfig, report: Report) -> None:
    """H18: nothing is sent to all drives of a line unless all of them understand the same by it."""
    if line.broadcast is None:
        return
    place: Path = ("lines", line.name, "broadcast")
    first = None
    for drive in line.drives:
        layout = drive.profile.broadcast
        if layout is None:
            message = f"`{drive.name}` ({drive.profile.name}) has no layout for what is sent to all drives"
            report.error(place, message, "leave `broadcast` out, or put the drive on another line", key=True)
        elif first is not None and not same_layout(first, layout):
            message = f"`{drive.name}` ({drive.profile.name}) means something else by what is sent to all"
            report.error(place, message, "leave `broadcast` out, or put the drive on another line", key=True)
        else:
            first = first or layout


def same_layout(one: Broadcast, other: Broadcast) -> bool:
    """True when two drives understand the same frames in the same way."""
    return _meaning(one) == _meaning(other)


def _meaning(layout: Broadcast) -> object:
    """What counts on the wire, without names for people and sources."""
    points = {name: (p.address, p.encoding, p.limits, p.pulse, p.pause) for name, p in layout.points.items()}
    commands = {
        name: (dict(c.args), [(dict(s.write), s.until, s.within) for s in c.steps])
        for name, c in layout.commands.items()
    }
    return points, dict(layout.words), commands
