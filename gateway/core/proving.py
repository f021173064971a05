"""What proves a write: the written registers read back, or the step's own condition. Pure.

Each function is a part of a procedure.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Any

from gateway.core import motion
from gateway.core.conditions import holds, proved, shown_as
from gateway.core.drive import Drive
from gateway.core.procedure import (
    Ask,
    Effect,
    Pause,
    Prove,
    exchange,
)
from gateway.core.saying import explain
from gateway.core.sending import Sent
from gateway.core.store import Store
from gateway.line.interface import Answered, Priority, Read, Silent
from gateway.mapping.profile import Condition, Point, Step, Term
from gateway.modbus.encoding import extract
from gateway.tag import Cause, Outcome, Quality, Value, Verdict

READ_BACK_SECONDS = 1.0
"""Time that a drive has to show a written value where the profile states no other."""

LOST_REPLY_SECONDS = 3.0
"""Time within which a read-back has to tell what became of a write whose reply was lost."""

SHOW_EVERY = 0.5
"""Seconds after which what is to prove a stop is read again, where planned reads did not bring it."""

LAST_LOOK_SECONDS = 1.0
"""Time that the last read before a proof counts as missing has to get onto the wire."""

READ_BACK_PAUSE = 0.05
LATEST_READ_SECONDS = 5.0


def read_back(
    ask: Ask, store: Store, sent: Sent, points: Sequence[Point], within: float
) -> Generator[Effect, Any, Outcome]:
    """Read the written registers until they show what was written, at most ``within`` seconds."""
    if not all(point.access.readable for point in points):
        return _by_reply(sent, points)
    request = _registers_of(ask.drive, points)
    until = sent.at + (within if sent.answered else max(within, LOST_REPLY_SECONDS))
    priority = Priority.PROOF if ask.urgent else Priority.COMMAND
    while True:
        finished = yield from exchange(request, priority, until + LATEST_READ_SECONDS)
        match finished.result:
            case Answered():
                wrong = _differing(request.address, sent, points, finished.result.words)
                if wrong is None:
                    return _confirmed(ask, store, sent, points)
                if finished.at >= until:
                    return _not_shown(ask, store, sent, wrong)
            case Silent() if finished.at < until:
                pass
            case _:
                reason = f"sent, but the read-back failed: {explain(ask.drive, finished)}"
                return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason=reason)
        yield Pause(READ_BACK_PAUSE)
        priority = Priority.COMMAND


def _registers_of(drive: Drive, points: Sequence[Point]) -> Read:
    """The registers of these points only: beside them the frame may have written what cannot be read."""
    first = min(point.address for point in points)
    return Read(drive.unit, first, max(point.address + point.words for point in points) - first)


def _differing(first: int, sent: Sent, points: Sequence[Point], words: Sequence[int]) -> Point | None:
    for point in points:
        start = point.address - first
        if extract(point.encoding, words[start : start + point.words]) != sent.raws[point.name]:
            return point
    return None


def _by_reply(sent: Sent, points: Sequence[Point]) -> Outcome:
    if any(point.silent for point in points):
        reason = "sent; this drive answers no such write, and what it wrote cannot be read back"
        return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason=reason)
    if sent.answered:
        return Outcome(verdict=Verdict.CONFIRMED, reason="write-only: the drive's reply is the proof")
    return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason=sent.lost)


def _confirmed(ask: Ask, store: Store, sent: Sent, points: Sequence[Point]) -> Outcome:
    for point in points:
        held = store.get(ask.drive.tag(point.name))
        if held is not None and held.sample.quality is Quality.GOOD:
            ask.drive.expected.seen(point.name, held.sample.value)
    reason = "" if sent.answered else "the reply was lost; read back"
    return Outcome(verdict=Verdict.CONFIRMED, reason=reason, value=value_shown(ask, store, points))


def value_shown(ask: Ask, store: Store, points: Sequence[Point]) -> Value:
    held = store.get(ask.drive.tag(points[0].name)) if len(points) == 1 else None
    return held.sample.value if held else None


def _not_shown(ask: Ask, store: Store, sent: Sent, point: Point) -> Outcome:
    held = store.get(ask.drive.tag(point.name))
    shows = shown_as(held.sample) if held else "another value"
    said = sent.lost or "the drive answered"
    return Outcome(
        verdict=Verdict.FAILED,
        cause=Cause.NOT_PROVED if sent.answered else Cause.NO_ANSWER,
        reason=f"{said}, and {point.name} shows {shows}: it was not done",
        value=held.sample.value if held else None,
    )


def wait_for(
    ask: Ask, store: Store, condition: Condition, since: float, until: float
) -> Generator[Effect, Any, bool]:
    """Wait until all drives of an ask show a condition in what was read after ``since``; False when they do
    not until then. On a full line planned reads come late: what proves a stop is read next on the line, and
    every `SHOW_EVERY`; and nobody hears that a drive does not show it before that was read at the end."""
    reads = [read for drive in ask.drives for read in _registers_behind(drive, condition)]
    if not ask.urgent or not reads:
        shown: bool = yield Prove(condition, since, until)
        if shown or not reads:
            return shown
    priority = Priority.PROOF if ask.urgent else Priority.COMMAND
    while True:
        now = since
        for read in reads:
            now = (yield from exchange(read, priority, until + LAST_LOOK_SECONDS)).at
        if all(proved(drive, store, condition, since) for drive in ask.drives):
            return True
        if now >= until:
            return False
        if (yield Prove(condition, since, min(now + SHOW_EVERY, until))):
            return True
        priority = Priority.COMMAND


def _registers_behind(drive: Drive, condition: Condition) -> list[Read]:
    """The reads that bring what a condition leans on."""
    points = [drive.profile.points[term.name] for term in condition if not term.setting]
    readable = [point for point in points if point.access.readable and not point.select]
    return list(dict.fromkeys(Read(drive.unit, point.address, point.words) for point in readable))


def prove(
    ask: Ask, store: Store, step: Step, sent: Sent, outcome: Outcome, begun: float = 0.0
) -> Generator[Effect, Any, Outcome]:
    """Watch for the step's own proof, from when it was sent or ``begun`` on. A command whose reply was lost
    may still be proved by it."""
    shown = yield from wait_for(ask, store, step.until, sent.at, max(sent.at, begun) + step.within)
    if shown:
        ask.drive.expected.obeyed(sent.raws)
        motion.note_shown(ask.drive, sent.raws)
        return outcome
    missing = [term for term in step.until if not _shows(ask, store, term, sent.at)]
    seen = [_seen(ask, store, term, sent.at) for term in missing]
    if None in seen or not sent.answered:
        lost = f" ({sent.lost})" if sent.lost else ""
        reason = f"sent{lost}, but the drive did not show {missing[0].text} within {step.within:g} s"
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
