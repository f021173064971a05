"""What has to be known of a drive before something is written to it. Pure.

Each function is a part of a procedure: it yields what it needs (`gateway.core.procedure.Effect`).
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from fractions import Fraction
from typing import Any

from gateway.core.conditions import holds, words_against
from gateway.core.drive import Drive, depends_on
from gateway.core.guard import Ended, raw_value, refuse
from gateway.core.meaning import Meaning, Meaningless, meaning_of
from gateway.core.procedure import (
    Ask,
    Effect,
    read,
)
from gateway.core.saying import explain
from gateway.core.store import Store
from gateway.line.interface import Answered, Priority, Read
from gateway.mapping.profile import Argument, Condition, Constant, Kind, Point, Step
from gateway.modbus.encoding import encode, extract
from gateway.tag import Cause, Quality, Sample

FRESH_SECONDS = 1.0
"""Age up to which a sample may decide a precondition; parameters are always read first."""

READ_SECONDS = 5.0
"""Time that each of these reads has to get onto the wire."""

UNREADABLE = "which could not be read"


def establish(drive: Drive, store: Store, condition: Condition, now: float) -> Generator[Effect, Any, None]:
    """Make sure that a precondition holds, reading what is not known freshly enough.

    Raises:
        Ended: if it does not hold, or cannot be established.
    """
    for term in condition:
        if term.setting:
            if not holds(term, float(drive.config.settings[term.name])):
                raise refuse(Cause.PRECONDITION, f"needs {term.text}")
            continue
        point = drive.profile.points[term.name]
        sample = yield from fresh_sample(drive, store, point, now, f"needs {term.text}")
        if not holds(term, sample.value):
            raise refuse(Cause.PRECONDITION, words_against(drive, term, sample))


def holds_now(drive: Drive, store: Store, condition: Condition, now: float) -> Generator[Effect, Any, bool]:
    """Whether a step's condition holds, by values as fresh as those of a precondition."""
    try:
        yield from establish(drive, store, condition, now)
    except Ended as ended:
        if UNREADABLE in ended.outcome.reason:
            raise
        return False
    return True


def fresh_sample(
    drive: Drive, store: Store, point: Point, now: float, why: str, oldest: float | None = None
) -> Generator[Effect, Any, Sample]:
    """A good sample of a point, read now if the one at hand is from before ``oldest`` (monotonic; None: as
    for a precondition).

    Raises:
        Ended: if it could not be read; ``why`` begins the reason.
    """
    held = store.get(drive.tag(point.name))
    if oldest is None:
        oldest = now if point.kind is Kind.PARAMETER else now - FRESH_SECONDS
    if held is None or held.sample.quality is not Quality.GOOD or held.at < oldest:
        request = Read(drive.unit, point.address, point.words)
        finished = yield from read(request, Priority.COMMAND, now + READ_SECONDS)
        held = store.get(drive.tag(point.name))
        if not isinstance(finished.result, Answered) or held is None:
            raise refuse(Cause.PRECONDITION, f"{why}, {UNREADABLE}: {explain(drive, finished)}")
    return held.sample


def raw_now(
    drive: Drive, store: Store, point: Point, number: Fraction, name: str, now: float, negated: bool = False
) -> Generator[Effect, Any, int]:
    """The raw value of a number by what the point means now.

    Raises:
        Ended: if it does not fit, or the point has no meaning now.
    """
    meaning = yield from meaning_now(drive, store, point, name, now)
    return raw_value(drive, point, meaning, number, name, negated)


def meaning_now(
    drive: Drive, store: Store, point: Point, name: str, now: float
) -> Generator[Effect, Any, Meaning]:
    """What the point means now, the deciding points read afresh.

    Raises:
        Ended: if it has no meaning now.
    """
    for decider in depends_on(point):
        if decider not in drive.config.settings:
            yield from fresh_sample(drive, store, drive.profile.points[decider], now, f"needs {decider}")
    meaning = meaning_of(drive, store, point)
    if isinstance(meaning, Meaningless):
        raise refuse(Cause.PRECONDITION, f"{name} cannot be written: {meaning.reason}")
    return meaning


def step_values(
    ask: Ask, store: Store, step: Step, args: Mapping[str, Fraction], now: float
) -> Generator[Effect, Any, dict[str, int]]:
    """Raw value of every point that a step writes.

    Raises:
        Ended: if a value does not fit its point.
    """
    raws = {}
    for name, value in step.write.items():
        point = ask.drive.profile.points[name]
        match value:
            case Constant(number):
                raws[name] = encode(point.encoding, number)
            case Argument(argument, negate):
                number = -args[argument] if negate else args[argument]
                raws[name] = yield from raw_now(ask.drive, store, point, number, argument, now, negate)
    return raws


def lasts(point: Point) -> bool:
    """H14: what is written to it stays, and may wear it."""
    return point.kind is Kind.PARAMETER or point.wear is not None


def is_spared(
    ask: Ask, store: Store, step: Step, raws: Mapping[str, int], now: float
) -> Generator[Effect, Any, bool]:
    """H14: whether a step would only write what stands there already, into memory that wears."""
    points = [ask.drive.profile.points[name] for name in raws]
    if step.until or not all(lasts(point) for point in points):
        return False
    for point in points:
        if not (yield from is_already(ask, store, point, raws[point.name], now)):
            return False
    return True


def is_already(ask: Ask, store: Store, point: Point, raw: int, now: float) -> Generator[Effect, Any, bool]:
    """H14: whether a parameter holds the value already; then it is not written, which may wear it."""
    if not point.access.readable or point.select:
        return False
    request = Read(ask.drive.unit, point.address, point.words)
    finished = yield from read(request, Priority.COMMAND, now + READ_SECONDS)
    return isinstance(finished.result, Answered) and extract(point.encoding, finished.result.words) == raw
