"""The checks of how fast a point may be changed, in profiles and site files alike."""

from __future__ import annotations

from collections.abc import Callable

from gateway.mapping.finding import Report
from gateway.mapping.node import Path
from gateway.mapping.profile import Kind, Pace, Point
from gateway.mapping.values import in_words
from gateway.tag import ValueType

Place = Callable[[str], Path]
"""Where a key is written."""


def check_pace(point: Point, pace: Pace, place: Place, report: Report) -> None:
    """Complain about bounds that this point cannot have."""
    for key, bound in (("step", pace.step), ("slew", pace.slew)):
        if bound is None:
            continue
        if not _is_number(point):
            message = f"`{point.name}` is no number, so it has no `{key}`"
            report.error(place(key), message, "leave it out", key=True)
        elif bound <= 0:
            report.error(place(key), f"the {key} of `{point.name}` is not above zero", "correct it")
    if pace.slew is not None and point.kind is not Kind.SETPOINT:
        message = f"`{point.name}` is no setpoint, so nothing takes it along at a `slew`"
        report.error(place("slew"), message, "use `step`, or give it kind setpoint", key=True)
    elif pace.slew is not None and point.wear is not None:
        report.error(
            place("slew"), f"`{point.name}` wears, and a ramp writes it often", "use `step`", key=True
        )
    count = point.encoding.scale
    fixed = point.encoding.times is None and not point.cases
    if pace.step is not None and 0 < pace.step < count and fixed and _is_number(point):
        message = f"a step of {in_words(pace.step)} is less than one count of `{point.name}`"
        report.error(place("step"), message, f"write {in_words(count)} or more")


def check_slower(point: Point, pace: Pace, place: Place, report: Report) -> None:
    """A site can only narrow what the profile allows."""
    allowed = point.pace.within(pace)
    for key, bound in (("step", point.pace.step), ("slew", point.pace.slew)):
        if bound is not None and getattr(pace, key) not in (None, getattr(allowed, key)):
            message = f"the profile allows a {key} of at most {in_words(bound)}"
            report.error(place(key), message, "a site can only narrow it")
    if pace.interval and pace.interval < point.pace.interval:
        message = f"the profile wants at least {point.pace.interval:g} s between two writes"
        report.error(place("interval"), message, "a site can only make it longer")


def _is_number(point: Point) -> bool:
    encoding = point.encoding
    named = encoding.values or encoding.patterns
    return not named and encoding.value_type in (ValueType.NUMBER, ValueType.INTEGER)
