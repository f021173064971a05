"""Do the cases of a point cover what its modes can be, and is each of them ever reached?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import product
from math import prod

from gateway.mapping.encodings import value_span
from gateway.mapping.finding import Report
from gateway.mapping.inherit import Inherited
from gateway.mapping.profile import Condition, Point, Profile, Term
from gateway.mapping.values import Target, in_words
from gateway.tag import ValueType

_MOST_STATES = 4096
"""Combinations of modes that are tried; beyond that nothing is said."""

State = Mapping[str, Fraction]


def check_cases(point: Point, keys: Inherited, profile: Profile, report: Report) -> None:
    """Warn of cases that an earlier one always forestalls, and of a state that none is for."""
    place = keys.place("cases")
    for index, case in enumerate(point.cases):
        earlier = (other for other in point.cases[:index] if other.when)
        if any(_implies(case.when, other.when) for other in earlier):
            message = f"this case of `{point.name}` is never reached: an earlier one holds whenever it does"
            report.warn((*place, index), message, "put it first, or leave it out", key=True)
    state = _uncovered(point, profile)
    if state:
        shown = ", ".join(f"{name}: {_shown(value, _target(name, profile))}" for name, value in state.items())
        message = f"no case of `{point.name}` holds while {shown}"
        report.warn(place, message, "add one, or a last one without `when`", key=True)


def _implies(narrow: Condition, wide: Condition) -> bool:
    """True when ``wide`` surely holds whenever ``narrow`` does."""
    return all(any(_within(ours, theirs) for ours in narrow if ours.name == theirs.name) for theirs in wide)


def _within(narrow: Term, wide: Term) -> bool:
    return all(any(low <= a and b <= high for low, high in wide.ranges) for a, b in narrow.ranges)


def _uncovered(point: Point, profile: Profile) -> State | None:
    """A state of the modes in which the point is there and no case holds."""
    terms: dict[str, list[Term]] = {}
    for case in point.cases:
        for term in case.when:
            terms.setdefault(term.name, []).append(term)
    domains = [sorted(set(_domain(_target(name, profile), found))) for name, found in terms.items()]
    if not terms or prod(len(domain) for domain in domains) > _MOST_STATES:
        return None
    for values in product(*domains):
        state = dict(zip(terms, values, strict=True))
        if _holds(point.when, state) and not any(_holds(case.when, state) for case in point.cases):
            return state
    return None


def _target(name: str, profile: Profile) -> Target:
    return profile.points.get(name) or profile.settings[name]


def _holds(condition: Condition, state: State) -> bool:
    """True when nothing in the state speaks against the condition."""
    return all(_fits(term, state[term.name]) for term in condition if term.name in state)


def _fits(term: Term, value: Fraction) -> bool:
    return any(low <= value <= high for low, high in term.ranges)


def _domain(target: Target, terms: list[Term]) -> Iterator[Fraction]:
    """The values that a mode can have: those with names, else one for each stretch between the terms."""
    encoding = target.encoding if isinstance(target, Point) else None
    named = target.encoding.values if isinstance(target, Point) else target.values
    patterns = encoding.patterns if encoding else ()
    if named or patterns:
        yield from map(Fraction, [*named, *(bits for _, bits, _ in patterns)])
    elif encoding and encoding.value_type is ValueType.BOOLEAN:
        yield from (Fraction(0), Fraction(1))
    else:
        yield from _stretches(target, terms)


def _stretches(target: Target, terms: list[Term]) -> Iterator[Fraction]:
    step = target.encoding.scale if isinstance(target, Point) else Fraction(1)
    span = _span(target)
    edges = [
        edge for term in terms for low, high in term.ranges for edge in (low - step, low, high, high + step)
    ]
    for edge in [*edges, *(span or ())]:
        if span is None or span[0] <= edge <= span[1]:
            yield edge


def _span(target: Target) -> tuple[Fraction, Fraction] | None:
    if isinstance(target, Point):
        return value_span(target.encoding)
    return None if target.low is None or target.high is None else (target.low, target.high)


def _shown(value: Fraction, target: Target) -> str:
    """A value as authors write it."""
    named = target.encoding.values if isinstance(target, Point) else target.values
    if isinstance(target, Point):
        if target.encoding.value_type is ValueType.BOOLEAN:
            return str(bool(value)).lower()
        fitting = (name for mask, bits, name in target.encoding.patterns if int(value) & mask == bits)
        named = {**{int(value): name for name in fitting}, **named}
    return named.get(int(value), in_words(value))
