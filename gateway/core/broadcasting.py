"""Commands to all drives of a line at once (H18). Pure.

A broadcast has a layout and units of its own, and nobody answers it: what became of it is seen by reading
each drive, and the outcome names those that did not follow. To the rest of the core the line is one more
drive, at unit 0, whose points and commands are those of the layout; the drives themselves are its members.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from gateway.core.conditions import holds, proved, shown_as
from gateway.core.drive import Commanded, Drive
from gateway.core.establishing import establish, step_values
from gateway.core.fit import fit
from gateway.core.guard import Ended, check_range, refuse
from gateway.core.motion import ALL, STOP, commanded, constants, lacking
from gateway.core.procedure import Ask, Effect, Lane, Leave, Procedure, StopEach
from gateway.core.proving import wait_for
from gateway.core.sending import STEP_SECONDS, Sent, end_pulse, transmit
from gateway.core.store import Store
from gateway.mapping.broadcastcheck import PERCENT, same_layout
from gateway.mapping.profile import Argument, Command, Point, Step
from gateway.mapping.site import DriveConfig, LineConfig, Site
from gateway.tag import Cause, Outcome, Quality, Role, Verdict, own_name

RUN = "run_"
EVERYBODY = 0
"""The unit address that means all."""

FOLLOW_SECONDS = 1.0
"""Seconds after which each drive that a stop to all has not stopped gets one of its own."""

Raws = Mapping[str, int]


def everybody_of(site: Site, drives: Sequence[Drive]) -> Iterator[tuple[Drive, tuple[Drive, ...]]]:
    """Each line that may be commanded as a whole, with its members."""
    for line in site.lines:
        members = tuple(drive for drive in drives if drive.line == line.name)
        all_ = everybody(line, members)
        if all_ is not None:
            yield all_, members


def everybody(line: LineConfig, members: Sequence[Drive]) -> Drive | None:
    """The line as one drive; None where nothing may be sent to all, or not all understand the same by it."""
    layouts = [member.profile.broadcast for member in members]
    first = layouts[0] if layouts else None
    if line.broadcast is None or first is None:
        return None
    if not all(layout is not None and same_layout(first, layout) for layout in layouts):
        return None
    commands = {name: _allowed(command, line.broadcast) for name, command in first.commands.items()}
    profile = replace(
        members[0].profile, points=first.points, words=first.words, commands=commands, broadcast=None
    )
    return Drive(DriveConfig(name=own_name(line.name), line=line.name, profile=profile, unit=EVERYBODY))


def why_off(line: LineConfig) -> str:
    """Why nothing is sent to all drives of a line, where that is so."""
    if line.broadcast is None:
        return f"nothing is sent to all drives of {line.name} (broadcast in the site file says who may)"
    return f"the drives of {line.name} do not all understand the same by what is sent to all of them"


def _allowed(command: Command, role: Role) -> Command:
    """A command to all takes the right that the site names; a stop is a stop."""
    if command.name == STOP + ALL:
        return replace(command, urgent=True)
    return replace(command, role=role if role.covers(command.role) else command.role)


# -- carrying out


def command_all(ask: Ask, store: Store, command: Command, args: Mapping[str, Fraction]) -> Procedure:
    """Carry out a command to all members of `Ask.members`, and look what each of them does."""
    if ask.urgent:
        return (yield from _stop_all(ask, store, command))
    now = yield Lane()
    for member in ask.members:
        yield from _check_member(ask, store, member, command, args, now)
    outcome = Outcome(verdict=Verdict.CONFIRMED)
    deadline = ask.deadline
    for step in command.steps:
        raws = yield from step_values(ask, store, step, args, now)
        raws = raws | (yield from _motion(ask, store, raws))
        sent = yield from transmit(ask, store, raws, deadline)
        _follow(ask, command)
        pulses = [p for name in raws if (p := ask.drive.profile.points[name]).pulse]
        if pulses:
            yield from end_pulse(ask, store, sent, pulses)
        if step is command.steps[-1]:
            yield Leave()
        outcome = yield from _prove(ask, store, step, sent, step.within)
        if outcome.verdict is not Verdict.CONFIRMED:
            break
        deadline = sent.at + STEP_SECONDS
    return outcome


def _stop_all(ask: Ask, store: Store, command: Command) -> Procedure:
    """One frame that stops all of them; who does not show it after `FOLLOW_SECONDS` gets a stop of his own,
    which is sent until he shows it (H20)."""
    [step] = command.steps
    raws = yield from step_values(ask, store, step, {}, ask.asked.mono)
    sent = yield from transmit(ask, store, raws, None)
    _follow(ask, command)
    outcome = yield from _prove(ask, store, step, sent, FOLLOW_SECONDS)
    left = tuple(m for m in ask.members if not proved(m, store, step.until, sent.at))
    if outcome.verdict is Verdict.CONFIRMED or not left:
        return outcome
    each: Sequence[Outcome] = yield StopEach(left, f"{command.name} of {ask.origin.who}")
    failed = [
        (member.name, told)
        for member, told in zip(left, each, strict=True)
        if told.verdict is not Verdict.CONFIRMED
    ]
    if not failed:
        return Outcome(verdict=Verdict.CONFIRMED)
    reason = "; ".join(f"{name}: {told.reason or told.verdict}" for name, told in failed)
    return replace_reason(failed[0][1], reason)


def replace_reason(outcome: Outcome, reason: str) -> Outcome:
    """The same, for other reasons."""
    return Outcome(verdict=outcome.verdict, cause=outcome.cause, reason=reason, code=outcome.code)


def _prove(ask: Ask, store: Store, step: Step, sent: Sent, within: float) -> Generator[Effect, Any, Outcome]:
    """Read each drive until it shows what the step is to bring about."""
    if not step.until:
        reason = "sent to all; nobody answers that, and nothing tells whether it was done"
        return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason=reason)
    if (yield from wait_for(ask, store, step.until, sent.at, sent.at + within)):
        for member in ask.members:
            if member.commanded is not None and member.commanded.to_all:
                member.commanded.shown = True
        return Outcome(verdict=Verdict.CONFIRMED)
    told = [text for member in ask.members if (text := _missing(member, store, step, sent.at))]
    seen = any(known for known, _ in told)
    return Outcome(
        verdict=Verdict.FAILED if seen else Verdict.UNKNOWN,
        cause=Cause.NOT_PROVED if seen else Cause.NO_ANSWER,
        reason=f"after {within:g} s " + "; ".join(text for _, text in told),
    )


def _missing(member: Drive, store: Store, step: Step, since: float) -> tuple[bool, str] | None:
    """What a drive does not show: whether it shows otherwise, and that in words; None if it shows all."""
    for term in step.until:
        held = store.get(member.tag(term.name))
        if held is None or held.at <= since or held.sample.quality is not Quality.GOOD:
            return False, f"{member.name} has not shown {term.text}"
        if not holds(term, held.sample.value):
            return True, f"{member.name} still shows {term.name}: {shown_as(held.sample)}"
    return None


# -- before it is sent


def _check_member(
    ask: Ask, store: Store, member: Drive, command: Command, args: Mapping[str, Fraction], now: float
) -> Generator[Effect, Any, None]:
    """Everything that would speak against the same command to this one drive speaks against it here.

    Raises:
        Ended: if anything does.
    """
    try:
        yield from fit(member, store, now)
        yield from establish(member, store, command.only_when, now)
        alone = _alone(member, command)
        if alone is not None:
            yield from establish(member, store, alone.only_when, now)
        for point, number in _arguments(ask.drive, command, args):
            _check_share(member, point, number)
    except Ended as ended:
        raise refuse(ended.outcome.cause, f"{member.name}: {ended.outcome.reason}") from None


def _alone(member: Drive, command: Command) -> Command | None:
    """The command that does the same to one drive."""
    return member.profile.commands.get(command.name.removesuffix(ALL))


def _arguments(
    all_: Drive, command: Command, args: Mapping[str, Fraction]
) -> Iterator[tuple[Point, Fraction]]:
    for step in command.steps:
        for name, value in step.write.items():
            if isinstance(value, Argument):
                number = args[value.name]
                yield all_.profile.points[name], -number if value.negate else number


def _check_share(member: Drive, point: Point, number: Fraction) -> None:
    """T2, T3: what the site allows for a drive holds for what is sent to all as well.

    Raises:
        Ended: if it does not fit, or that cannot be told.
    """
    target = member.profile.points.get(point.sets or "")
    if target is None:
        return
    pace = member.pace(target)
    if pace.slew is not None or pace.step is not None:
        raise refuse(
            Cause.PRECONDITION, f"{target.name} has a step or slew, which a command to all cannot keep"
        )
    whole = _whole(member, target) if point.encoding.symbol == PERCENT else Fraction(100)
    if whole is not None:
        check_range(member, target, target.limits, number * whole / 100, target.name)
    elif target.name in member.config.ranges:
        raise refuse(Cause.PRECONDITION, f"nobody knows what 100 % of {target.name} is")


def _whole(member: Drive, target: Point) -> Fraction | None:
    """What 100 % of a point is: the upper limit that the profile gives it."""
    high = target.limits.high if target.limits else None
    return member.config.settings.get(high) if isinstance(high, str) else high


def _motion(ask: Ask, store: Store, raws: Raws) -> Generator[Effect, Any, dict[str, int]]:
    """What else the frame has to say so that no drive stops or starts by it: the run bits of a word that is
    written for the sake of another bit. All drives must have the same command, and show it.

    Raises:
        Ended: if they have not.
    """
    all_ = ask.drive
    fields = lacking(all_, raws)
    if not fields:
        return {}
    names = {}
    for member in ask.members:
        names[member.name] = yield from commanded(ask, store, member)
    if len(set(names.values())) > 1:
        shown = ", ".join(f"{drive}: {name}" for drive, name in names.items())
        reason = f"the drives have different commands, and this would give all of them one ({shown})"
        raise refuse(Cause.PRECONDITION, f"{reason}; stop all of them first")
    common = constants(all_, all_.profile.commands.get(next(iter(names.values())) + ALL))
    if set(fields) - common.keys():
        raise refuse(Cause.PRECONDITION, "what the drives do cannot be said to all; stop all of them first")
    return {name: common[name] for name in fields}


# -- after it was sent


def _follow(ask: Ask, command: Command) -> None:
    """Let the picture of each drive's words follow what was sent to all of them."""
    runs = command.name.startswith(RUN)
    for member in ask.members:
        member.expected.sending(_targets(ask.drive, member, command))
        if not runs and not ask.urgent:
            continue
        member.expected.runs = True if runs else None
        for name, raw in constants(member, _alone(member, command)).items():
            member.commanding(*member.compose({name: raw}, {}))
        member.commanded = Commanded(command.name.removesuffix(ALL), to_all=True)


def _targets(all_: Drive, member: Drive, command: Command) -> set[str]:
    """The points of a drive whose value a command to all may change."""
    written = [all_.profile.points[name] for step in command.steps for name in step.write]
    sets = {point.sets for point in written if point.sets}
    return (sets | set(constants(member, _alone(member, command)))) & member.profile.points.keys()
