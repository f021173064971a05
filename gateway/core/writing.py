"""The procedures: one point written, one command carried out. Pure."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from fractions import Fraction
from typing import Any

from msgspec import structs

from gateway.core.establishing import (
    establish,
    holds_now,
    is_already,
    is_spared,
    lasts,
    raw_now,
    step_values,
)
from gateway.core.fit import fit
from gateway.core.guard import Ended, special_raw
from gateway.core.motion import note_shown
from gateway.core.pacing import (
    Written,
    begin_near,
    check_step,
    go_on,
    in_turn,
    present,
    ramp,
    written_by,
)
from gateway.core.procedure import (
    Ask,
    Effect,
    IsLast,
    Leave,
    Pause,
    Procedure,
    Report,
)
from gateway.core.proving import READ_BACK_SECONDS, prove, read_back, value_shown, wait_for
from gateway.core.sending import STEP_SECONDS, STOP_PATIENCE, end_pulse, lost_pulse, select, transmit
from gateway.core.starts import Starts
from gateway.core.store import Store
from gateway.mapping.profile import FREELY, Command, Condition, Kind, Point, Step
from gateway.tag import Outcome, Verdict

FOLLOW_SECONDS = 15.0
"""Time from the beginning of a write within which the command that follows it has to be sent."""

STOP_AGAIN = 1.0
"""Seconds after which a stop that the drive took and does not show is sent again."""


def write_point(ask: Ask, store: Store, point: Point, number: Fraction) -> Procedure:
    """Write one point and read it back; after the last write of a batch comes what has to follow it."""
    now = yield from in_turn(ask, [point])
    yield from fit(ask.drive, store, now, point.name)
    try:
        outcome = yield from change_point(ask, store, point, number, now)
    except Ended:
        yield from follow(ask, store, point, now + FOLLOW_SECONDS)
        raise
    problem = yield from follow(ask, store, point, now + FOLLOW_SECONDS)
    return outcome if problem is None else problem


def change_point(ask: Ask, store: Store, point: Point, number: Fraction, now: float) -> Procedure:
    """Write one point and read it back, unless it is so already."""
    drive = ask.drive
    yield from establish(drive, store, point.only_when, now)
    raw = special_raw(point, ask.wanted)
    pace = FREELY if raw is not None else drive.pace(point)
    if raw is None:
        raw = yield from raw_now(drive, store, point, number, point.name, now)
    if pace.step is not None or pace.slew is not None:
        base = yield from present(drive, store, point, now)
        if not ask.own:
            check_step(point, pace, base, number)
        if pace.slew is not None:
            return (yield from ramp(ask, store, point, base, number, now, ask.deadline))
    if lasts(point) and (yield from is_already(ask, store, point, raw, now)):
        value = value_shown(ask, store, [point])
        return Outcome(verdict=Verdict.CONFIRMED, reason="it was so already", value=value)
    yield from select(ask, store, point)
    sent = yield from transmit(ask, store, {point.name: raw}, ask.deadline, point.only_when)
    if point.then is not None:
        drive.owed.add(point.then)
    if point.pulse:
        yield from end_pulse(ask, store, sent, [point])
        if not sent.answered:
            raise lost_pulse(sent)
        return Outcome(verdict=Verdict.CONFIRMED, reason="pulse given and taken back")
    return (yield from read_back(ask, store, sent, [point], READ_BACK_SECONDS))


def follow(ask: Ask, store: Store, point: Point, deadline: float) -> Generator[Effect, Any, Outcome | None]:
    """Run the command that a batch of writes owes the drive, if this is the last of them. The outcome
    when that failed: the values are written and not active; it stays owed, and the next write tries again."""
    drive = ask.drive
    if point.then is None or point.then not in drive.owed or not (yield IsLast()):
        return None
    command = drive.profile.commands[point.then]
    try:
        outcome = yield from run_steps(ask, store, command, {}, deadline, keep=True)
    except Ended as ended:
        outcome = ended.outcome
    if outcome.verdict is Verdict.CONFIRMED:
        drive.owed.discard(point.then)
        return None
    reason = f"written, but {point.then} did not follow, so it may not be active: {outcome.reason}"
    return structs.replace(outcome, verdict=Verdict.FAILED, reason=reason)


def run_command(
    ask: Ask, store: Store, command: Command, args: Mapping[str, Fraction], starts: Starts
) -> Procedure:
    """Carry out a command. What sets a motor running waits for its turn among the starts; a setpoint
    that has a slew begins near the present one and goes on to its value when the command is proved."""
    if ask.urgent:
        return (yield from run_steps(ask, store, command, args, None))
    written = written_by(ask.drive, command, args)
    steps = begin_command(ask, store, command, args, written)
    if starts.concern(ask.drive, command):
        steps = starts.in_turn(ask, ask.asked.mono, steps)
    outcome, begun = yield from steps
    for one in written:
        if outcome.verdict is Verdict.CONFIRMED and begun.get(one.point.name, one.target) != one.target:
            outcome = yield from go_on(ask, store, one, begun[one.point.name])
    return outcome


def begin_command(
    ask: Ask, store: Store, command: Command, args: Mapping[str, Fraction], written: Sequence[Written]
) -> Generator[Effect, Any, tuple[Outcome, Mapping[str, Fraction]]]:
    """The steps of a command, in its turn and if its precondition holds; and where its setpoints begin."""
    now = yield from in_turn(ask, [one.point for one in written])
    yield from fit(ask.drive, store, now)
    yield from establish(ask.drive, store, command.only_when, now)
    first, begun = yield from begin_near(ask, store, written, now)
    outcome = yield from run_steps(ask, store, command, {**args, **first}, ask.deadline)
    return outcome, begun


def run_steps(
    ask: Ask,
    store: Store,
    command: Command,
    args: Mapping[str, Fraction],
    deadline: float | None,
    keep: bool = False,
) -> Generator[Effect, Any, Outcome]:
    """The steps of a command, each proved before the next. The last one's proof blocks nobody, unless
    ``keep`` says that the lane is still needed."""
    outcome = Outcome(verdict=Verdict.CONFIRMED, reason="nothing to do: every step is already reached")
    now = ask.asked.mono
    for index, step in enumerate(command.steps):
        if step.when and not (yield from holds_now(ask.drive, store, step.when, now)):
            continue
        raws = yield from step_values(ask, store, step, args, now)
        if not ask.urgent and (yield from is_spared(ask, store, step, raws, now)):
            continue
        last = index == len(command.steps) - 1 and not keep
        if ask.urgent:
            outcome, now = yield from stop_step(ask, store, step, raws)
        else:
            outcome, now = yield from carry_out(ask, store, step, raws, deadline, command.only_when, last)
        deadline = None if ask.urgent else now + STEP_SECONDS
    return outcome


def carry_out(
    ask: Ask,
    store: Store,
    step: Step,
    raws: Mapping[str, int],
    deadline: float | None,
    condition: Condition,
    last: bool,
) -> Generator[Effect, Any, tuple[Outcome, float]]:
    """One step: send, end its pulses, read back, prove. Returns the outcome and the time."""
    sent = yield from transmit(ask, store, raws, deadline, condition)
    points = [ask.drive.profile.points[name] for name in raws]
    pulses = [point for point in points if point.pulse]
    over = sent.at
    if pulses:
        over = yield from end_pulse(ask, store, sent, pulses)
        if not sent.answered and not step.until:
            raise lost_pulse(sent)
    kept = [p for p in points if not p.pulse and (p.kind is Kind.SETPOINT or not step.until)]
    lost = "" if sent.answered else "the reply was lost; the drive shows that it was done"
    outcome = Outcome(verdict=Verdict.CONFIRMED, reason=lost)
    if kept:
        outcome = yield from read_back(
            ask, store, sent, kept, READ_BACK_SECONDS if step.until else step.within
        )
    if step.until and outcome.verdict is Verdict.CONFIRMED:
        if last:
            yield Leave()
        outcome = yield from prove(ask, store, step, sent, outcome, over)
    if outcome.verdict is not Verdict.CONFIRMED and not last:
        raise Ended(outcome.verdict, outcome.cause, outcome.reason)
    return outcome, sent.at


def stop_step(
    ask: Ask, store: Store, step: Step, raws: Mapping[str, int]
) -> Generator[Effect, Any, tuple[Outcome, float]]:
    """A step of a stop: sent again until the drive shows it, or shows that it stands (H20). Whoever asked
    hears after `STOP_PATIENCE` that the drive does not obey; the sending goes on."""
    points = [ask.drive.profile.points[name] for name in raws]
    kept = [point for point in points if point.access.readable and not point.pulse]
    told = False
    while True:
        sent = yield from transmit(ask, store, raws, None)
        shown = Outcome(verdict=Verdict.CONFIRMED)
        if kept:
            shown = yield from read_back(ask, store, sent, kept, STOP_AGAIN / 2)
        if shown.verdict is Verdict.CONFIRMED:
            break
        if step.until and (yield from wait_for(ask, store, step.until, sent.at, sent.at + STOP_AGAIN)):
            note_shown(ask.drive, raws)
            return Outcome(verdict=Verdict.CONFIRMED), sent.at
        if not step.until:
            yield Pause(STOP_AGAIN)
        if sent.at - ask.asked.mono >= STOP_PATIENCE and not told:
            told = True
            yield Report(shown)
    outcome = Outcome(verdict=Verdict.CONFIRMED)
    if step.until:
        outcome = yield from prove(ask, store, step, sent, outcome)
    return outcome, sent.at
