"""How fast a point is changed: step, slew and interval (T3). Pure.

A setpoint with a slew is taken to its new value in small steps: each frame differs from the one before it by
no more than the rate allows for the time between them. The newest target wins, a stop ends it, and it counts
as done when the drive shows the last value. Between its frames others may write to the drive.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from msgspec import structs

from gateway.core.drive import Drive
from gateway.core.establishing import FRESH_SECONDS, fresh_sample, meaning_now
from gateway.core.guard import RUNNING, Ended, raw_value, refuse
from gateway.core.meaning import Meaning
from gateway.core.procedure import Ask, Effect, IsOutrun, Lane, Leave, Pause, Procedure, Ramping
from gateway.core.proving import READ_BACK_SECONDS, read_back
from gateway.core.sending import STEP_SECONDS, select, transmit
from gateway.core.store import Store
from gateway.mapping.profile import FREELY, Argument, Command, Kind, Pace, Point
from gateway.tag import Cause, Outcome, Verdict

RAMP_PERIOD = 0.5
"""Seconds between the frames of a ramp, where neither interval nor the size of a count asks for more."""


def in_turn(ask: Ask, points: Sequence[Point]) -> Generator[Effect, Any, float]:
    """Wait until these points may be written again, then for the lane; the time (monotonic).

    Setpoints wait, and a newer one takes their place; other points are refused. The core's own write, which
    follows the end of a lease, waits for nobody.

    Raises:
        Ended: if it is too soon.
    """
    now = ask.asked.mono
    while True:
        left = max((_left(ask.drive, point, now) for point in points), default=0.0)
        if left > 0 and not ask.own:
            _check_soon(ask, points, now, left)
            now = yield Pause(left)
        now = float((yield Lane()))
        if ask.own or not any(_left(ask.drive, point, now) > 0 for point in points):
            return now
        yield Leave()


def _left(drive: Drive, point: Point, now: float) -> float:
    """Seconds until a point may be written again."""
    written, pace = drive.written.get(point.name), drive.pace(point)
    apart = pace.interval if pace.slew is None else max(pace.interval, RAMP_PERIOD)
    return 0.0 if written is None else written + apart - now


def _check_soon(ask: Ask, points: Sequence[Point], now: float, left: float) -> None:
    names = ", ".join(point.name for point in points)
    waits = all(point.kind is Kind.SETPOINT for point in points)
    if not waits or (ask.deadline is not None and now + left > ask.deadline):
        raise refuse(Cause.TOO_SOON, f"{names} was written a moment ago; ask again in {left:.1f} s")


def present(drive: Drive, store: Store, point: Point, now: float) -> Generator[Effect, Any, Fraction]:
    """The value that the drive shows now.

    Raises:
        Ended: if it shows none.
    """
    why = f"the present {point.name} must be known first"
    oldest = now if point.kind is Kind.PARAMETER else now - FRESH_SECONDS
    written = drive.written.get(point.name, oldest)
    sample = yield from fresh_sample(drive, store, point, now, why, max(oldest, written))
    if isinstance(sample.value, bool) or not isinstance(sample.value, (int, float)):
        raise refuse(Cause.PRECONDITION, f"the present {point.name} is no number: {sample.value}")
    return Fraction(str(sample.value))


def check_step(point: Point, pace: Pace, base: Fraction, target: Fraction) -> None:
    """Raises Ended if the change is bigger than one write may make it."""
    if pace.step is not None and abs(target - base) > pace.step:
        unit = point.encoding.symbol or ""
        raise refuse(
            Cause.STEP,
            f"{point.name} = {float(target):g} is {float(abs(target - base)):g} {unit} from the present "
            f"{float(base):g}; one write may change it by {float(pace.step):g} {unit}".rstrip(),
        )


def towards(base: Fraction, target: Fraction, most: Fraction, count: Fraction) -> Fraction:
    """The value nearest to ``target`` that is not further than ``most`` from ``base``, by whole counts."""
    reach = math.floor(most / count) * count
    if abs(target - base) <= reach:
        return target
    return base + reach if target > base else base - reach


def count_of(meaning: Meaning) -> Fraction:
    """What one raw count is worth."""
    return abs(meaning.encoding.scale * meaning.times)


def period_of(pace: Pace, count: Fraction) -> float:
    """Seconds between the frames of a ramp: at least one count must come due in each."""
    assert pace.slew is not None
    return max(RAMP_PERIOD, pace.interval, float(count / pace.slew))


def ramp(
    ask: Ask,
    store: Store,
    point: Point,
    base: Fraction,
    target: Fraction,
    now: float,
    deadline: float | None,
) -> Procedure:
    """Take a setpoint from ``base`` to ``target`` at its slew, and read back the last value.

    Begins and ends in the lane. Once a frame was sent, whatever ends it early is a failure and no refusal:
    the drive stands somewhere between.
    """
    yield Ramping(point.name, float(target))
    begun = False
    try:
        while True:
            if (yield IsOutrun()):
                raise Ended(Verdict.SUPERSEDED, Cause.SUPERSEDED, "a newer value took its place")
            meaning, value, due = yield from _next_value(ask, store, point, base, target, now)
            if due > now:
                yield Leave()
                yield Pause(due - now)
                now = yield Lane()
                continue
            raw = raw_value(ask.drive, point, meaning, value, point.name)
            yield from select(ask, store, point)
            sent = yield from transmit(
                ask, store, {point.name: raw}, now + STEP_SECONDS if begun else deadline, point.only_when
            )
            begun, base, now = True, value, sent.at
            if point.then is not None:
                ask.drive.owed.add(point.then)
            if value == target or not sent.answered:
                shown = yield from read_back(ask, store, sent, [point], READ_BACK_SECONDS)
                if value == target or shown.verdict is not Verdict.CONFIRMED:
                    return shown
    except Ended as ended:
        if begun:
            ended.outcome = _short_of(ended.outcome, point, base, target)
        raise


def _next_value(
    ask: Ask, store: Store, point: Point, base: Fraction, target: Fraction, now: float
) -> Generator[Effect, Any, tuple[Meaning, Fraction, float]]:
    """What the point means now, the next value of its ramp, and when it may be sent (monotonic)."""
    pace = ask.drive.pace(point)
    assert pace.slew is not None
    meaning = yield from meaning_now(ask.drive, store, point, point.name, now)
    count = count_of(meaning)
    period = period_of(pace, count)
    value = towards(base, target, pace.slew * Fraction(period), count)
    written = ask.drive.written.get(point.name)
    return meaning, value, now if written is None else written + period


def _short_of(outcome: Outcome, point: Point, base: Fraction, target: Fraction) -> Outcome:
    reason = f"{outcome.reason}; {point.name} got as far as {float(base):g} on its way to {float(target):g}"
    verdict = outcome.verdict if outcome.verdict is Verdict.SUPERSEDED else Verdict.FAILED
    return structs.replace(outcome, verdict=verdict, reason=reason, value=float(base))


@dataclass(frozen=True, slots=True)
class Written:
    """A number that a command writes: its argument and whether its sign is turned, the point, the target."""

    argument: str
    negated: bool
    point: Point
    target: Fraction


def written_by(drive: Drive, command: Command, args: Mapping[str, Fraction]) -> list[Written]:
    """The arguments of a command, as they are written, where their points may be changed only so fast."""
    found = []
    for step in command.steps:
        for name, value in step.write.items():
            point = drive.profile.points[name]
            if isinstance(value, Argument) and drive.pace(point) != FREELY:
                target = -args[value.name] if value.negate else args[value.name]
                found.append(Written(value.name, value.negate, point, target))
    return found


def begin_near(
    ask: Ask, store: Store, written: Sequence[Written], now: float
) -> Generator[Effect, Any, tuple[dict[str, Fraction], dict[str, Fraction]]]:
    """Where a command has to begin: the arguments to begin with, and by point the values to begin with. A
    motor that stands still begins at zero.

    Raises:
        Ended: if a step is too big.
    """
    first, begun = {}, {}
    standing = not (yield from is_running(ask.drive, store, now))
    for one in written:
        point, pace = one.point, ask.drive.pace(one.point)
        if pace.step is None and pace.slew is None:
            continue
        meaning = yield from meaning_now(ask.drive, store, point, point.name, now)
        base = yield from _base(ask.drive, store, point, meaning, standing, now)
        check_step(point, pace, base, one.target)
        if pace.slew is not None:
            value = towards(base, one.target, pace.slew * Fraction(RAMP_PERIOD), count_of(meaning))
            first[one.argument] = -value if one.negated else value
            begun[point.name] = value
    return first, begun


def _base(
    drive: Drive, store: Store, point: Point, meaning: Meaning, standing: bool, now: float
) -> Generator[Effect, Any, Fraction]:
    if not standing:
        return (yield from present(drive, store, point, now))
    limits = drive.limits(point, meaning.limits)
    return Fraction(0) if limits is None else min(max(Fraction(0), limits[0]), limits[1])


def go_on(ask: Ask, store: Store, one: Written, begun: Fraction) -> Procedure:
    """Take the setpoint of a command that is done from where it began to its target."""
    yield Leave()
    now = yield Lane()
    return (yield from ramp(ask, store, one.point, begun, one.target, now, now + STEP_SECONDS))


def is_running(drive: Drive, store: Store, now: float) -> Generator[Effect, Any, bool]:
    """Whether the drive shows that its motor runs; False where it shows nothing of the kind."""
    point = drive.profile.points.get(RUNNING)
    if point is None or not point.access.readable:
        return False
    sample = yield from fresh_sample(drive, store, point, now, "whether the motor runs must be known first")
    return bool(sample.value)
