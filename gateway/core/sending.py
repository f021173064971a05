"""One frame of a write: composed, put on record and flushed, sent once. Pure.

What was sent and not answered is never sent again blindly; only a stop is repeated, since stopping twice
is stopping (safety.md H5, H20). Each function is a part of a procedure.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from gateway.core import motion
from gateway.core.drive import Drive
from gateway.core.guard import Ended, check_danger, refuse
from gateway.core.procedure import (
    Ask,
    Effect,
    Finished,
    Intend,
    Owing,
    Pause,
    Prove,
    Report,
    Withdrawn,
    exchange,
    read,
)
from gateway.core.saying import ended, explain, intent
from gateway.core.store import Store
from gateway.line.interface import Answered, Priority, Read, Refused, Silent, Unsent, Write
from gateway.mapping.profile import Condition, Point
from gateway.modbus.encoding import encode, extract
from gateway.tag import Cause, Outcome, Verdict

STEP_SECONDS = 5.0
"""Time that each frame after the first one has to get onto the wire."""

RECORD_PATIENCE = 5.0
"""Seconds that a frame waits for its record to be on disk; then it is not sent."""

ZERO_PATIENCE = 0.5
"""Seconds that what is harmless waits for it; then it is sent all the same."""

UNRECORDED = "nothing is written while the journal cannot be: {}"

PULSE_ATTEMPTS, PULSE_PAUSE = 8, 0.05
"""Times that the end of a pulse is sent until it is known to have come, and seconds before it is sent again;
the pause doubles. Together that is longer than an answer may be taken for a late one."""

STOP_PATIENCE = 20.0
"""Seconds after which whoever asked for a stop hears that it is not answered."""

POINTLESS = (0x01, 0x02)
"""Error codes that repeating does not change: no such function, no such register."""

STOP_PAUSE, STOP_PAUSE_MOST = 0.05, 5.0
"""Seconds between the repetitions of a stop that is not answered; the pause doubles."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A write that is to be sent, and what its record tells."""

    request: Write
    facts: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Sent:
    """A frame that went out: its raw values, when it was answered, and what came instead of an answer, in
    words (empty: it was answered)."""

    raws: Mapping[str, int]
    address: int
    count: int
    at: float
    lost: str

    @property
    def answered(self) -> bool:
        """The drive took it, by its answer."""
        return not self.lost


def transmit(
    ask: Ask,
    store: Store,
    raws: Mapping[str, int],
    deadline: float | None,
    condition: Condition = (),
    beside: motion.Beside | None = None,
) -> Generator[Effect, Any, Sent]:
    """Compose one frame, note it, send it once (a stop: until it is answered). ``beside``: what it says of
    the motor, where that is known already.

    Raises:
        Ended: if it was not sent, or the drive refused it.
    """
    drive = ask.drive
    if not ask.urgent:
        for name, raw in raws.items():
            check_danger(drive.profile.points[name], raw, name, ask.consent)
    if not ask.harmless and (worn := drive.worn(raws)):
        raise refuse(Cause.WEAR, worn)
    fresh = yield from _read_words(ask, raws, deadline)
    if beside is None and not ask.urgent:
        beside = yield from motion.beside(ask, store, raws, fresh)
    rest = beside or motion.AS_IT_IS
    address, words = drive.compose({**raws, **rest.raws}, fresh)
    request = frame_of(drive, address, words, [drive.profile.points[name] for name in raws])
    frame = Frame(request, intent(drive, store, request, raws))
    drive.expected.sending(raws)
    if any(raw and drive.profile.points[name].pulse for name, raw in raws.items()):
        yield Owing(True, once_sent=True)
    finished = yield from send(ask, frame, deadline, (*condition, *rest.condition))
    if not isinstance(finished.result, Unsent):
        drive.written.update(dict.fromkeys(raws, finished.at))
    if isinstance(finished.result, (Refused, Unsent)):
        raise ended(drive, finished)
    motion.note(drive, rest.raws or raws, shown=bool(rest.condition))
    lost = "" if isinstance(finished.result, Answered) else explain(drive, finished)
    return Sent(raws, address, len(words), finished.at, lost)


def put(
    ask: Ask, frame: Frame, priority: Priority, deadline: float | None, condition: Condition = ()
) -> Generator[Effect, Any, Finished]:
    """R1: put one frame on record, then on the wire. A stop does not wait for the record, and a setpoint of
    zero and the end of a pulse not longer than `ZERO_PATIENCE` (R2).

    Raises:
        Ended: if it could not be put on record.
    """
    patience = None if ask.urgent else ZERO_PATIENCE if ask.harmless else RECORD_PATIENCE
    problem = yield Intend(frame.facts, patience, keep=ask.harmless)
    if problem and not ask.harmless:
        raise refuse(Cause.JOURNAL, UNRECORDED.format(problem))
    drive, request = ask.drive, frame.request
    before = drive.commanding(request.address, request.words)
    try:
        finished = yield from exchange(request, priority, deadline, condition)
    except Withdrawn:
        drive.refused(request.address, len(request.words), before)
        raise
    if isinstance(finished.result, (Refused, Unsent)):
        drive.refused(request.address, len(request.words), before)
    return finished


def frame_of(drive: Drive, address: int, words: tuple[int, ...], points: Sequence[Point]) -> Write:
    """The write of these words, with the silence that its points need afterwards."""
    silent = any(point.silent for point in points)
    return Write(drive.unit, address, words, silent, max(point.pause for point in points))


def send(
    ask: Ask, frame: Frame, deadline: float | None, condition: Condition
) -> Generator[Effect, Any, Finished]:
    """Send a frame once. A refusal that is temporary is asked again while the deadline lasts, since it
    changed nothing; a stop is repeated until it is answered."""
    if ask.urgent:
        return (yield from insist(ask, frame))
    while True:
        finished = yield from put(ask, frame, Priority.COMMAND, deadline, condition)
        if deadline is None or not (yield from may_repeat(ask.drive, finished, deadline)):
            return finished


def insist(ask: Ask, frame: Frame) -> Generator[Effect, Any, Finished]:
    """Send a stop until it is answered, however long that takes: a drive that comes back running after a
    stop was asked for has to be stopped. The asker hears at once that the line is down, and after
    `STOP_PATIENCE` that nothing is known. A drive that goes on refusing is left alone after that time."""
    pause, told = STOP_PAUSE, False
    while True:
        finished = yield from put(ask, frame, Priority.STOP, None)
        patient = finished.at - ask.asked.mono < STOP_PATIENCE
        match finished.result:
            case Answered():
                return finished
            case Refused(code) if code in POINTLESS or not patient:
                return finished
            case Silent() | Unsent() if not told and (isinstance(finished.result, Unsent) or not patient):
                told = True
                yield Report(_undelivered(ask, finished))
        yield Pause(pause)
        pause = min(2 * pause, STOP_PAUSE_MOST)


def _undelivered(ask: Ask, finished: Finished) -> Outcome:
    """What whoever asked for a stop hears that could not be delivered yet."""
    reason = f"{explain(ask.drive, finished)}; the stop is sent until the drive answers, or this gateway ends"
    if isinstance(finished.result, Unsent):
        return Outcome(verdict=Verdict.FAILED, cause=Cause.LINE_DOWN, reason=reason)
    return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason=reason)


def may_repeat(drive: Drive, finished: Finished, deadline: float) -> Generator[Effect, Any, bool]:
    """After a refusal: wait as the profile's error table says, if it calls the error temporary."""
    meaning = drive.profile.errors.get(finished.result.code) if isinstance(finished.result, Refused) else None
    if meaning is None:
        return False
    if meaning.retry is not None and finished.at + meaning.retry < deadline:
        yield Pause(meaning.retry)
        return True
    if meaning.retry_when and finished.at < deadline:
        held: bool = yield Prove(meaning.retry_when, finished.at, deadline)
        return held
    return False


def _read_words(
    ask: Ask, raws: Mapping[str, int], deadline: float | None
) -> Generator[Effect, Any, dict[int, int]]:
    """The words whose other bits must stay as they are. A stop waits for none of them."""
    fresh: dict[int, int] = {}
    if ask.urgent:
        return fresh
    for address in ask.drive.words_to_read(raws):
        finished = yield from read(Read(ask.drive.unit, address, 1), Priority.COMMAND, deadline)
        if not isinstance(finished.result, Answered):
            raise ended(ask.drive, finished, f"register {address:04X}H could not be read first: ")
        fresh[address] = finished.result.words[0]
    return fresh


def end_pulse(ask: Ask, store: Store, sent: Sent, pulses: Sequence[Point]) -> Generator[Effect, Any, float]:
    """Hold the pulse for its time, then write the word without it, until that is answered or the drive shows
    it. Nothing but the drive keeps it from being sent. Returns when it was over (monotonic).

    Raises:
        Ended: if nobody knows whether the pulse was taken back.
    """
    ask = replace(ask, takes_back=True)
    yield Owing(True)
    now: float = yield Pause(max(point.pulse for point in pulses))
    deadline, pause, lost = sent.at + STEP_SECONDS, PULSE_PAUSE, ""
    for _ in range(PULSE_ATTEMPTS):
        try:
            lost = (yield from _take_back(ask, store, pulses, deadline)).lost
        except Ended as told:
            lost = told.outcome.reason
        if not lost or (yield from _is_over(ask, pulses, deadline)):
            yield Owing(False)
            return now
        now = yield Pause(pause)
        deadline, pause = now + STEP_SECONDS, 2 * pause
    reason = f"the pulse was given, and it is not known whether it was taken back: {lost}"
    raise Ended(Verdict.UNKNOWN, Cause.NO_ANSWER, reason)


def lost_pulse(sent: Sent) -> Ended:
    """H5: a pulse that was not answered, and that nothing else proves."""
    return Ended(Verdict.UNKNOWN, Cause.NO_ANSWER, f"{sent.lost}; the pulse is over, and is not repeated")


def _take_back(
    ask: Ask, store: Store, pulses: Sequence[Point], deadline: float
) -> Generator[Effect, Any, Sent]:
    """Send the end of a pulse once. What the drive shows of its motor is looked at once more; where nothing
    follows from that, or for all drives at once, the word ends as it began."""
    zeros = {point.name: 0 for point in pulses}
    beside = motion.AS_IT_IS if ask.members else None
    try:
        return (yield from transmit(ask, store, zeros, deadline, (), beside))
    except Ended as told:
        if beside is not None or told.outcome.cause is not Cause.PRECONDITION:
            raise
        return (yield from transmit(ask, store, zeros, deadline, (), motion.AS_IT_IS))


def _is_over(ask: Ask, pulses: Sequence[Point], deadline: float) -> Generator[Effect, Any, bool]:
    """Whether the drive shows that the pulses were taken back, as far as it shows them at all."""
    for point in pulses:
        if not point.access.readable:
            return False
        finished = yield from read(
            Read(ask.drive.unit, point.address, point.words), Priority.COMMAND, deadline
        )
        if not isinstance(finished.result, Answered) or extract(point.encoding, finished.result.words):
            return False
    return True


def select(ask: Ask, store: Store, point: Point) -> Generator[Effect, Any, None]:
    """Write the selectors of an indexed point, in the order of the profile, unless they stand so already.

    Raises:
        Ended: if a selector could not be written.
    """
    drive = ask.drive
    for name, value in point.select.items():
        selector = drive.profile.points[name]
        raw = encode(selector.encoding, value.value)
        if drive.selection.get(name) == raw:
            continue
        address, words = drive.compose({name: raw}, {})
        drive.selection.pop(name, None)
        request = Write(drive.unit, address, words)
        frame = Frame(request, intent(drive, store, request, {name: raw}))
        finished = yield from put(ask, frame, Priority.COMMAND, ask.deadline)
        if not isinstance(finished.result, Answered):
            raise ended(drive, finished, f"{name} could not be selected: ")
        drive.selection[name] = raw
