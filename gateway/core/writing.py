"""The procedures: one point written, one command carried out. Pure.

Each frame of a write is composed, noted in the journal and flushed, sent once, and read back. What was
sent and not answered is never sent again blindly; only a stop is repeated, since stopping twice is
stopping (H5, H20 of ``docs/safety.md``).
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from gateway.core.conditions import contradicted, holds, shown_as, words_against
from gateway.core.drive import Drive
from gateway.core.guard import Ended, refuse, step_values
from gateway.core.procedure import Ask, Effect, Finished, Lane, Leave, Pause, Procedure, Prove, exchange, note
from gateway.core.store import Store
from gateway.line.interface import Answered, Priority, Read, Refused, Silent, Unsent, Write
from gateway.mapping.profile import Command, Condition, Kind, Point, Step, Term
from gateway.modbus.encoding import extract
from gateway.tag import Cause, Outcome, Quality, Sample, Value, Verdict

FRESH_SECONDS = 1.0
"""Age up to which a sample may decide a precondition; parameters are always read first."""

STEP_SECONDS = 5.0
"""Time that each frame after the first one has to get onto the wire."""

READ_BACK_SECONDS = 1.0
"""Time that a drive has to show a written value where the profile states no other."""

LOST_REPLY_SECONDS = 3.0
"""Time within which a read-back has to tell what became of a write whose reply was lost."""

READ_BACK_PAUSE = 0.05
STOP_ATTEMPTS = 20


@dataclass(frozen=True, slots=True)
class Sent:
    """A frame that went out: its raw values, when it was answered, and whether it was."""

    raws: Mapping[str, int]
    address: int
    count: int
    at: float
    answered: bool


def write_point(ask: Ask, store: Store, point: Point, raw: int) -> Procedure:
    """Write one point and read it back."""
    now = yield Lane()
    yield from establish(ask.drive, store, point.only_when, now)
    sent = yield from transmit(ask, {point.name: raw}, ask.deadline, point.only_when)
    if point.pulse:
        yield from end_pulse(ask, sent, [point])
        return Outcome(verdict=Verdict.CONFIRMED, reason="pulse given and taken back")
    return (yield from read_back(ask, store, sent, [point], READ_BACK_SECONDS))


def run_command(ask: Ask, store: Store, command: Command, args: Mapping[str, Fraction]) -> Procedure:
    """Carry out the steps of a command, each proved before the next."""
    now = 0.0
    if not ask.urgent:
        now = yield Lane()
        yield from establish(ask.drive, store, command.only_when, now)
    outcome = Outcome(verdict=Verdict.CONFIRMED, reason="nothing to do: every step is already reached")
    deadline = ask.deadline
    for index, step in enumerate(command.steps):
        if contradicted(ask.drive, store, step.when):
            continue
        raws = step_values(ask.drive, step.write, args)
        last = index == len(command.steps) - 1
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
    sent = yield from transmit(ask, raws, deadline, condition)
    points = [ask.drive.profile.points[name] for name in raws]
    pulses = [point for point in points if point.pulse]
    if pulses:
        yield from end_pulse(ask, sent, pulses)
    kept = [p for p in points if not p.pulse and (p.kind is Kind.SETPOINT or not step.until)]
    outcome = Outcome(verdict=Verdict.CONFIRMED)
    if kept:
        outcome = yield from read_back(
            ask, store, sent, kept, READ_BACK_SECONDS if step.until else step.within
        )
    if step.until and outcome.verdict is Verdict.CONFIRMED:
        if last and not ask.urgent:
            yield Leave()
        outcome = yield from prove(ask, store, step, sent, outcome)
    if outcome.verdict is not Verdict.CONFIRMED and not last:
        raise Ended(outcome.verdict, outcome.cause, outcome.reason)
    return outcome, sent.at


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
        sample = yield from fresh_sample(drive, store, term, now)
        if not holds(term, sample.value):
            raise refuse(Cause.PRECONDITION, words_against(term, sample))


def fresh_sample(drive: Drive, store: Store, term: Term, now: float) -> Generator[Effect, Any, Sample]:
    """A good sample of a term's point, read now if the one at hand is too old."""
    point = drive.profile.points[term.name]
    held = store.get(drive.tag(point.name))
    oldest = now if point.kind is Kind.PARAMETER else now - FRESH_SECONDS
    if held is None or held.sample.quality is not Quality.GOOD or held.at < oldest:
        request = Read(drive.unit, point.address, point.words)
        finished = yield from exchange(request, Priority.COMMAND, now + STEP_SECONDS)
        held = store.get(drive.tag(point.name))
        if not isinstance(finished.result, Answered) or held is None:
            reason = f"needs {term.text}, which could not be read: {explain(drive, finished)}"
            raise refuse(Cause.PRECONDITION, reason)
    return held.sample


def transmit(
    ask: Ask, raws: Mapping[str, int], deadline: float | None, condition: Condition = ()
) -> Generator[Effect, Any, Sent]:
    """Compose one frame, note it, send it once (a stop: until it is answered).

    Raises:
        Ended: if it was not sent, or the drive refused it.
    """
    drive = ask.drive
    fresh = yield from _read_words(ask, [drive.profile.points[name] for name in raws], deadline)
    address, words = drive.compose(raws, fresh)
    problem = yield from note(intent(ask, address, words), wait=not ask.urgent)
    if problem and not ask.urgent:
        raise refuse(Cause.JOURNAL, f"nothing is written while the journal cannot be: {problem}")
    request = Write(drive.unit, address, words)
    priority = Priority.STOP if ask.urgent else Priority.COMMAND
    before = drive.commanding(address, words)
    finished = yield from exchange(request, priority, deadline, condition)
    for _ in range(STOP_ATTEMPTS if ask.urgent else 0):
        if not isinstance(finished.result, Silent):
            break
        finished = yield from exchange(request, priority, deadline)
    if isinstance(finished.result, (Refused, Unsent)):
        drive.refused(address, len(words), before)
        raise ended(drive, finished)
    answered = isinstance(finished.result, Answered)
    if answered:
        drive.answered(address, len(words))
    return Sent(raws, address, len(words), finished.at, answered)


def _read_words(
    ask: Ask, points: Sequence[Point], deadline: float | None
) -> Generator[Effect, Any, dict[int, int]]:
    """The words whose other bits must stay as they are. A stop waits for none of them."""
    fresh: dict[int, int] = {}
    if ask.urgent:
        return fresh
    for address in ask.drive.unknown_words(points):
        finished = yield from exchange(Read(ask.drive.unit, address, 1), Priority.COMMAND, deadline)
        if not isinstance(finished.result, Answered):
            raise ended(ask.drive, finished, f"register {address:04X}H could not be read first: ")
        fresh[address] = finished.result.words[0]
    return fresh


def end_pulse(ask: Ask, sent: Sent, pulses: Sequence[Point]) -> Generator[Effect, Any, None]:
    """Hold the pulse for its time, then write the word without it.

    Raises:
        Ended: if the pulse could not be taken back.
    """
    yield Pause(max(point.pulse for point in pulses))
    for attempt in range(STOP_ATTEMPTS):
        over = yield from transmit(ask, {point.name: 0 for point in pulses}, sent.at + STEP_SECONDS + attempt)
        if over.answered:
            break
    if not sent.answered:
        raise Ended(
            Verdict.UNKNOWN, Cause.NO_ANSWER, "the drive did not answer the pulse; it is not repeated"
        )


def read_back(
    ask: Ask, store: Store, sent: Sent, points: Sequence[Point], within: float
) -> Generator[Effect, Any, Outcome]:
    """Read the written registers until they show what was written, at most ``within`` seconds."""
    if not all(point.access.readable for point in points):
        return _by_reply(sent)
    request = Read(ask.drive.unit, sent.address, sent.count)
    until = sent.at + (within if sent.answered else max(within, LOST_REPLY_SECONDS))
    while True:
        finished = yield from exchange(request, Priority.COMMAND, until + STEP_SECONDS)
        match finished.result:
            case Answered():
                wrong = _differing(ask.drive, sent, points, finished.result.words)
                if wrong is None:
                    return _confirmed(ask, store, sent, points)
                if finished.at >= until:
                    return _not_shown(ask, store, wrong)
            case Silent() if finished.at < until:
                pass
            case _:
                reason = f"sent, but the read-back failed: {explain(ask.drive, finished)}"
                return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason=reason)
        yield Pause(READ_BACK_PAUSE)


def _differing(drive: Drive, sent: Sent, points: Sequence[Point], words: Sequence[int]) -> Point | None:
    for point in points:
        start = point.address - sent.address
        if extract(point.encoding, words[start : start + point.words]) != sent.raws[point.name]:
            return point
    return None


def _by_reply(sent: Sent) -> Outcome:
    if sent.answered:
        return Outcome(verdict=Verdict.CONFIRMED, reason="write-only: the drive's reply is the proof")
    return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason="the drive did not answer")


def _confirmed(ask: Ask, store: Store, sent: Sent, points: Sequence[Point]) -> Outcome:
    reason = "" if sent.answered else "the reply was lost; read back"
    return Outcome(verdict=Verdict.CONFIRMED, reason=reason, value=_value(ask, store, points))


def _value(ask: Ask, store: Store, points: Sequence[Point]) -> Value:
    held = store.get(ask.drive.tag(points[0].name)) if len(points) == 1 else None
    return held.sample.value if held else None


def _not_shown(ask: Ask, store: Store, point: Point) -> Outcome:
    held = store.get(ask.drive.tag(point.name))
    shows = shown_as(held.sample) if held else "another value"
    return Outcome(
        verdict=Verdict.FAILED,
        cause=Cause.NOT_PROVED,
        reason=f"the drive answered, but {point.name} shows {shows}",
        value=held.sample.value if held else None,
    )


def prove(
    ask: Ask, store: Store, step: Step, sent: Sent, outcome: Outcome
) -> Generator[Effect, Any, Outcome]:
    """Watch for the step's own proof. A command whose reply was lost may still be proved by it."""
    proved = yield Prove(step.until, sent.at, sent.at + step.within)
    if proved:
        return outcome
    missing = [term for term in step.until if not _shows(ask, store, term, sent.at)]
    seen = [_seen(ask, store, term, sent.at) for term in missing]
    if None in seen or not sent.answered:
        reason = f"sent, but the drive did not show {missing[0].text} within {step.within:g} s"
        return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason=reason)
    reason = f"after {step.within:g} s the drive still shows {'; '.join(str(text) for text in seen)}"
    return Outcome(verdict=Verdict.FAILED, cause=Cause.NOT_PROVED, reason=reason)


def _shows(ask: Ask, store: Store, term: Term, since: float) -> bool:
    held = store.get(ask.drive.tag(term.name))
    return held is not None and held.at > since and holds(term, held.sample.value)


def _seen(ask: Ask, store: Store, term: Term, since: float) -> str | None:
    held = store.get(ask.drive.tag(term.name))
    if held is None or held.at <= since or held.sample.quality is not Quality.GOOD:
        return None
    return f"{term.name}: {shown_as(held.sample)}"


def intent(ask: Ask, address: int, words: Sequence[int]) -> dict[str, Any]:
    """The journal's record of a frame that is about to be sent."""
    return {
        "kind": "intent",
        "ask": ask.number,
        "what": ask.what,
        "wanted": ask.wanted,
        "by": ask.origin,
        "unit": ask.drive.unit,
        "address": f"{address:04X}H",
        "words": [f"{word:04X}H" for word in words],
    }


def ended(drive: Drive, finished: Finished, before: str = "") -> Ended:
    """The end of a write whose frame was not sent, not answered or refused."""
    reason = before + explain(drive, finished)
    match finished.result:
        case Unsent("expired"):
            return Ended(Verdict.EXPIRED, Cause.EXPIRED, reason)
        case Unsent("not_admitted"):
            return Ended(Verdict.REFUSED, Cause.PRECONDITION, reason)
        case Unsent():
            return Ended(Verdict.FAILED, Cause.LINE_DOWN, reason)
        case Refused(code):
            meaning = drive.profile.errors.get(code)
            return Ended(
                Verdict.REFUSED, Cause.DRIVE_REFUSED, reason, code, meaning.name if meaning else None
            )
        case _:
            return Ended(Verdict.FAILED, Cause.NO_ANSWER, reason)


def explain(drive: Drive, finished: Finished) -> str:
    """A result in words, the drive's own included."""
    match finished.result:
        case Unsent(why):
            return UNSENT[why]
        case Refused(code):
            return in_words(drive, code)
        case Silent(damaged):
            return "the drive's answer was damaged" if damaged else "the drive did not answer"
        case Answered():
            return "the drive answered"


UNSENT = {
    "expired": "its time to live ended before it could be sent",
    "not_admitted": "the drive's state changed before it could be sent",
    "line_down": "the line is down",
}


def in_words(drive: Drive, code: int) -> str:
    """``the drive answered 22H locked: Sn and Cn while running``."""
    meaning = drive.profile.errors.get(code)
    if meaning is None:
        return f"the drive answered error {code:02X}H, which its document does not list"
    return f"the drive answered {code:02X}H {meaning.name}" + (f": {meaning.help}" if meaning.help else "")
