"""What a point means at present: its encoding, limits and factor may depend on the drive's state. Pure.

What depends on settings alone was decided when the profile was loaded (`gateway.mapping.specialise`);
here remain conditions and factors that lean on other points of the same drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from gateway.core.conditions import holds, shown_as
from gateway.core.drive import Drive, depends_on
from gateway.core.store import Store
from gateway.mapping.profile import Bound, Condition, Encoding, Limits, Point, Term
from gateway.tag import Quality, Sample, Severity


@dataclass(frozen=True, slots=True)
class Meaning:
    """How a point is to be read and written now."""

    encoding: Encoding
    limits: Limits | None
    times: Fraction = Fraction(1)


@dataclass(frozen=True, slots=True)
class Meaningless:
    """The point has no value at present; ``quality`` tells whether that may change with the next read."""

    quality: Quality
    reason: str


def is_fixed(drive: Drive, point: Point) -> bool:
    """True when the point means the same in every state of the drive."""
    return not point.cases and not any(name not in drive.config.settings for name in depends_on(point))


def meaning_of(drive: Drive, store: Store, point: Point) -> Meaning | Meaningless:
    """What the point means by what is known of the drive."""
    against = _first_against(drive, store, point.when)
    if against is not None:
        return against
    chosen = _case(drive, store, point)
    return chosen if isinstance(chosen, Meaningless) else _with_factor(drive, store, chosen)


def _case(drive: Drive, store: Store, point: Point) -> Meaning | Meaningless:
    """The first case that holds; a case that is not decided yet hides those behind it."""
    if not point.cases:
        return Meaning(point.encoding, point.limits)
    last: Meaningless | None = None
    for case in point.cases:
        last = _first_against(drive, store, case.when)
        if last is None:
            return Meaning(case.encoding, case.limits)
        if last.quality is Quality.WAITING:
            return last
    assert last is not None
    return Meaningless(Quality.NOT_APPLICABLE, f"{point.name} has no meaning while {last.reason}")


def _first_against(drive: Drive, store: Store, condition: Condition) -> Meaningless | None:
    """What speaks against a condition: a value, or that a value is not known."""
    for term in condition:
        if term.setting:
            if not holds(term, float(drive.config.settings[term.name])):
                return Meaningless(Quality.NOT_APPLICABLE, f"the setting {term.name} is not {term.text}")
            continue
        sample = usable(drive, store, term.name)
        if sample is None:
            return Meaningless(Quality.WAITING, f"{term.name}, which decides, is not known")
        if not holds(term, sample.value):
            return Meaningless(Quality.NOT_APPLICABLE, _is(term, sample))
    return None


def _with_factor(drive: Drive, store: Store, meaning: Meaning) -> Meaning | Meaningless:
    """Put in the numbers that settings and other points give: the factor and the limits."""
    times = _number(drive, store, meaning.encoding.times or Fraction(1))
    if isinstance(times, Meaningless):
        return times
    if meaning.limits is None:
        return Meaning(meaning.encoding, None, times)
    low = _number(drive, store, meaning.limits.low)
    high = _number(drive, store, meaning.limits.high)
    if isinstance(low, Meaningless):
        return low
    return high if isinstance(high, Meaningless) else Meaning(meaning.encoding, Limits(low, high), times)


def _number(drive: Drive, store: Store, bound: Bound) -> Fraction | Meaningless:
    """A number, or the present value of the setting or point of that name."""
    if not isinstance(bound, str):
        return bound
    if bound in drive.config.settings:
        return drive.config.settings[bound]
    sample = usable(drive, store, bound)
    if sample is None or not isinstance(sample.value, (int, float)):
        return Meaningless(Quality.WAITING, f"{bound}, which it takes a number from, is not known")
    return Fraction(str(float(sample.value)))


def usable(drive: Drive, store: Store, name: str) -> Sample | None:
    """The sample of a point that others may lean on; None when its value is not known."""
    held = store.get(drive.tag(name))
    return held.sample if held is not None and held.sample.quality.severity is not Severity.BAD else None


def _is(term: Term, sample: Sample) -> str:
    return f"{term.name} is {shown_as(sample)}"
