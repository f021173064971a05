"""The checks of a single point: size, scale, limits, and what it lacks or says in vain."""

from __future__ import annotations

from gateway.mapping.encodings import raw_span, value_span
from gateway.mapping.finding import Report
from gateway.mapping.inherit import Inherited
from gateway.mapping.layout import Layout
from gateway.mapping.pacecheck import check_pace
from gateway.mapping.profile import Encoding, Kind, Limits, Point, Profile, Setting
from gateway.mapping.resolve import Resolved
from gateway.mapping.values import in_words
from gateway.tag import ValueType

_FINEST = 2**32
"""Counts that what is added may be worth: with as many counts again, clients' numbers still tell each."""
_COARSEST = 50
"""A range that uses less than one in so many of the raw counts has probably lost its scale."""


_OF_WRITING = ("range", "counts", "only_when", "wear", "danger", "then")
"""Keys that mean nothing on a point that is never written."""


def check_point(point: Point, layout: Layout, resolved: Resolved, report: Report) -> None:
    """Complain about everything in a point that does not fit; also in one of the broadcast layout. In a
    point that has errors already, only the names of others are looked up."""
    keys = layout.keys[point.name]
    _check_times(point, keys, resolved, report)
    bounds = (point.limits.low, point.limits.high) if point.limits else ()
    targets = {bound: _bound(bound, keys, resolved) for bound in bounds if isinstance(bound, str)}
    if point.name in layout.doubtful:
        return
    for bound, target in targets.items():
        _check_bound(bound, target, point, keys, report)
    _check_size(point, keys, resolved.profile, report)
    _check_offset(point, keys, report)
    check_pace(point, point.pace, keys.place, report)
    if point.limits is not None:
        _check_limits(point, point.limits, keys, report)
    _check_writing(point, keys, report)


def _check_writing(point: Point, keys: Inherited, report: Report) -> None:
    """What is written needs bounds and a price; what is not needs none of that."""
    if not point.access.writable:
        for key in _OF_WRITING:
            if keys.where.get(key) == (*keys.path, key):
                message = f"`{key}` stands on `{point.name}`, which is never written"
                report.warn(keys.where[key], message, "leave it out, or choose another kind", key=True)
        return
    if point.encoding.patterns:
        message = f"`{point.name}` is written, but patterns are for reading only"
        report.error(keys.place("values"), message, "name each raw value by itself")
    if point.kind is Kind.SETPOINT and point.limits is None and not point.encoding.values:
        report.warn(keys.path, f"the setpoint `{point.name}` has no `range`", "add one", key=True)
    if point.kind is Kind.PARAMETER and keys.traits.wear is None:
        message = f"the parameter `{point.name}` does not tell its `wear`"
        report.warn(
            keys.path, message, "add the number of writes that it lasts, or unknown, or none", key=True
        )


def _check_size(point: Point, keys: Inherited, profile: Profile, report: Report) -> None:
    modbus = profile.modbus
    for limit, needed in (
        (modbus.read_max, point.access.readable),
        (modbus.write_max, point.access.writable),
    ):
        if needed and point.words > limit:
            report.error(
                keys.place("type"),
                f"`{point.name}` has {point.words} registers, a request at most {limit}",
                "correct the type or the limit",
            )
            return


def _check_times(point: Point, keys: Inherited, resolved: Resolved, report: Report) -> None:
    """What multiplies must be a number."""
    if point.encoding.times is None:
        return
    place = keys.place("times")
    factor = resolved.conditions.target(point.encoding.times, place, key=False)
    if isinstance(factor, Point) and not _is_number(factor.encoding):
        report.error(place, f"`{factor.name}` is no number", "name a setting or point that is")


def _check_offset(point: Point, keys: Inherited, report: Report) -> None:
    """Beside what is added, a single count must still make a difference to the number that clients get."""
    if abs(point.encoding.offset) > point.encoding.scale * _FINEST:
        message = f"a count of `{point.name}` is lost beside its `offset`"
        report.error(keys.place("offset"), message, "correct the offset or the unit")


def _is_number(encoding: Encoding) -> bool:
    named = encoding.values or encoding.patterns
    return raw_span(encoding) is not None and not named and encoding.value_type is not ValueType.BOOLEAN


def _check_limits(point: Point, limits: Limits, keys: Inherited, report: Report) -> None:
    place = keys.place("range")
    low, high = limits.low, limits.high
    span = value_span(point.encoding)
    if span is None or isinstance(low, str) or isinstance(high, str):
        return
    if low < span[0] or high > span[1]:
        report.warn(
            place,
            f"the range of `{point.name}` goes beyond {in_words(span[0])} to {in_words(span[1])}, "
            "which its counts reach",
            "correct the range or the unit",
        )
    elif point.encoding.symbol is not None and (high - low) * _COARSEST < span[1] - span[0]:
        report.warn(
            place,
            f"the range of `{point.name}` uses less than 1/{_COARSEST} of its counts",
            "see whether the unit is right",
        )


def _bound(name: str, keys: Inherited, resolved: Resolved) -> Point | Setting | None:
    """The setting or point that is a limit; None, with a finding, when there is none."""
    return resolved.conditions.target(name, keys.place("range"), key=False)


def _check_bound(
    bound: str, target: Point | Setting | None, point: Point, keys: Inherited, report: Report
) -> None:
    """A limit that is the value of a setting or point must have the same unit."""
    if target is None:
        return
    theirs = target.encoding.symbol if isinstance(target, Point) else target.symbol
    ours = point.encoding.symbol
    if theirs != ours:
        message = f"`{bound}` is in {theirs or 'counts'}, `{point.name}` in {ours or 'counts'}"
        report.error(keys.place("range"), message, "give both the same unit")
