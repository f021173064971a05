"""The checks of a single point: size, scale, limits, and whether the drive can be asked for it."""

from __future__ import annotations

from gateway.mapping.encodings import raw_span, value_span
from gateway.mapping.facts import READ_HOLDING, READ_INPUT, WRITE_MANY, WRITE_ONE
from gateway.mapping.finding import Report
from gateway.mapping.inherit import Inherited
from gateway.mapping.pacecheck import check_pace
from gateway.mapping.profile import Encoding, Kind, Limits, Point, Profile, Table
from gateway.mapping.resolve import Resolved
from gateway.mapping.values import in_words
from gateway.tag import ValueType

_FINEST = 2**32
"""Counts that what is added may be worth: with as many counts again, clients' numbers still tell each."""
_COARSEST = 50
"""A range that uses less than one in so many of the raw counts has probably lost its scale."""


def check_point(point: Point, keys: Inherited, resolved: Resolved, report: Report) -> None:
    """Complain about everything in a point that does not fit; also in one of the broadcast layout."""
    _check_size(point, keys, resolved.profile, report)
    _check_times(point, keys, resolved, report)
    _check_offset(point, keys, report)
    _check_functions(point, keys, resolved.profile, report)
    if point.access.writable and point.encoding.patterns:
        message = f"`{point.name}` is written, but patterns are for reading only"
        report.error(keys.place("values"), message, "name each raw value by itself")
    check_pace(point, point.pace, keys.place, report)
    if point.limits is not None:
        _check_limits(point, point.limits, keys, resolved, report)
    if (
        point.kind is Kind.SETPOINT
        and point.access.writable
        and point.limits is None
        and not point.encoding.values
    ):
        report.warn(keys.path, f"the setpoint `{point.name}` has no `range`", "add one", key=True)
    if point.kind is Kind.PARAMETER and point.access.writable and point.wear is None:
        report.warn(
            keys.path,
            f"the parameter `{point.name}` does not tell its `wear`",
            "add the number of writes that it lasts, or unknown",
            key=True,
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
    for low, high in modbus.holes:
        if point.address <= high and point.address + point.words > low:
            report.error(
                (*keys.path, "at"),
                f"`{point.name}` lies in the hole {low:04X}H to {high:04X}H",
                "correct one of them",
            )


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


def _check_functions(point: Point, keys: Inherited, profile: Profile, report: Report) -> None:
    """The drive must speak the functions that its points need."""
    if point.table in (Table.COIL, Table.DISCRETE):
        message = f"`{point.name}` lies in the table `{point.table}`, which the line cannot poll yet"
        report.error((*keys.path, "at"), message, "leave it out; its notation may stay")
        return
    functions = profile.modbus.functions
    needed = READ_INPUT if point.table is Table.INPUT else READ_HOLDING
    if point.access.readable and needed not in functions:
        report.error(
            (*keys.path, "at"),
            f"`{point.name}` cannot be read without function {needed:02X}H",
            "add it to `functions`",
        )
    if not point.access.writable:
        return
    if point.table is Table.INPUT:
        report.error(
            (*keys.path, "at"),
            f"`{point.name}` is an input register and cannot be written",
            "give it a kind that is only read",
        )
    elif not {WRITE_ONE, WRITE_MANY} & set(functions) or (point.words > 1 and WRITE_MANY not in functions):
        report.error(
            (*keys.path, "at"), f"no function of the drive can write `{point.name}`", "add 10H to `functions`"
        )


def _check_limits(point: Point, limits: Limits, keys: Inherited, resolved: Resolved, report: Report) -> None:
    place = keys.place("range")
    for bound in (limits.low, limits.high):
        if isinstance(bound, str):
            _check_bound(bound, point, keys, resolved, report)
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


def _check_bound(bound: str, point: Point, keys: Inherited, resolved: Resolved, report: Report) -> None:
    """A limit that is the value of a setting or point must have the same unit."""
    place = keys.place("range")
    target = resolved.conditions.target(bound, place, key=False)
    if target is None:
        return
    symbol = target.encoding.symbol if isinstance(target, Point) else target.symbol
    if symbol != point.encoding.symbol:
        report.error(
            place,
            f"`{bound}` is in {symbol or 'counts'}, `{point.name}` in {point.encoding.symbol or 'counts'}",
            "give both the same unit",
        )
