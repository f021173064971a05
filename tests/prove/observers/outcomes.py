"""What must hold of every outcome that a client is told."""

from __future__ import annotations

import math
from typing import Any

from gateway.bridge.messages import Call, Done, Response, RunCommand, TurnedAway, WriteTag
from gateway.tag import Cause, Outcome, Verdict
from tests.prove.observers.base import Observer
from tests.prove.observers.values import Reading
from tests.prove.seen import Answer, Frame, Request

LATE = 0.001
ALREADY = "it was so already"
BY_REPLY = "write-only: the drive's reply is the proof"
PULSE = "pulse given and taken back"
NOTHING_TO_DO = "nothing to do: every step is already reached"


class Answering(Observer):
    """Base of those who look at outcomes: which request an answer belongs to."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._asked: dict[tuple[int, int], Request] = {}
        self._done: set[tuple[int, int]] = set()

    def asked(self, session: int, call: Any) -> None:
        if isinstance(call, WriteTag | RunCommand):
            self._asked[session, call.id] = self.seen.requests[call.key or f"#{call.id}"]

    def died(self) -> None:
        self._asked.clear()
        self._done.clear()


class ToldOnce(Answering):
    """Every outcome is told once, is final, and a second one under the same id is the first one's."""

    name, hazard = "an outcome is told once", "H3"

    def told(self, session: int, message: Response) -> None:
        if not isinstance(message, Done) or (session, message.id) not in self._asked:
            return
        self.looked += 1
        if (session, message.id) in self._done:
            self.fail(f"request {message.id} was told again: {message.outcome}")
        self._done.add((session, message.id))
        if not message.outcome.verdict.final:
            self.fail(f"{message.outcome} is not final")
        first = self._asked[session, message.id]
        if len(first.told) < 2 or not first.ask.key or _is_no_number(first):
            return
        if not _same(first.told[0][1], message.outcome):
            self.fail(f"{first.key!r} was told {first.told[0][1]} and then {message.outcome}")

    def ended(self) -> None:
        for request in self.box.clients.waiting:
            self.fail(f"{request.what} of {request.at:.3f} has no outcome")


def _is_no_number(request: Request) -> bool:
    """It asks for what is no number: refused in any case, and never known again, since it equals nothing."""
    value = request.ask.value if isinstance(request.ask, WriteTag) else None
    return isinstance(value, float) and not math.isfinite(value)


class Answered(Observer):
    """Whatever is asked is answered."""

    name, hazard = "all that is asked is answered", "D1"
    most = 30.0

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._open: dict[tuple[int, int], tuple[Call, float]] = {}

    def died(self) -> None:
        self._open.clear()

    def left(self, session: int) -> None:
        self._open = {key: what for key, what in self._open.items() if key[0] != session}

    def asked(self, session: int, call: Call) -> None:
        if not isinstance(call, WriteTag | RunCommand | TurnedAway):
            self._open[session, call.id] = call, self.now

    def told(self, session: int, message: Response) -> None:
        number = getattr(message, "id", None)
        if number is not None and self._open.pop((session, number), None) is not None:
            self.looked += 1

    def ended(self) -> None:
        for call, at in self._open.values():
            if self.now - at > self.most:
                self.fail(f"{call!r:.200} of {at:.3f} is not answered")


def _same(first: Outcome, second: Outcome) -> bool:
    """The same, or the restart's word for what nobody knows any more."""
    return first == second or second.cause is Cause.SHUTTING_DOWN or first.verdict is Verdict.UNKNOWN


class Proved(Answering):
    """Confirmed means read back: after the frame was done the drive answered a read that shows the value."""

    name, hazard = "confirmed means read back", "H5"

    def told(self, session: int, message: Response) -> None:
        request = self._asked.get((session, message.id)) if isinstance(message, Done) else None
        if request is None or not isinstance(message, Done):
            return
        outcome = message.outcome
        if outcome.verdict is not Verdict.CONFIRMED or len(request.told) > 1:
            return
        if request.hostile:
            self.fail(f"{request.what}, {request.hostile}, was confirmed")
        if outcome.reason in (BY_REPLY, PULSE, NOTHING_TO_DO) or request.drive is None:
            return
        self.looked += 1
        frame = request.frames[-1] if request.frames else None
        if frame is None and outcome.reason != ALREADY and not request.is_stop:
            self.fail(f"{request.what} was confirmed, and nothing of it was on the wire")
        if not self._shown(request, frame):
            self.fail(f"{request.what} was confirmed, and no answer showed it: {outcome.reason}")

    def _shown(self, request: Request, frame: Frame | None) -> bool:
        drive, ask = request.drive, request.ask
        assert drive is not None
        since = request.at if frame is None or request.is_stop else self._done_at(request, drive)
        answers = [a for a in self.seen.answers[drive.line, drive.unit] if a.at >= since - 1e-9]
        if isinstance(ask, RunCommand):
            return self._obeyed(ask, drive, answers)
        point = drive.profile.points[ask.target.partition(".")[2]]
        reading = Reading(drive, point)
        found = [words for a in answers if (words := a.at_registers(point.address, point.words))]
        if not reading.plain:
            return bool(found)
        value = ask.value if isinstance(ask.value, bool | int | float) else None
        if frame is None:  # it was so already: seen before, too
            found += [
                words
                for a in self.seen.answers[drive.line, drive.unit]
                if (words := a.at_registers(point.address, point.words))
            ]
        return any(reading.fits(words, value) for words in found)

    def _done_at(self, request: Request, drive: Any) -> float:
        """When the last frame of what is to be proved was over; the end of a pulse comes after its proof."""
        ask, points = request.ask, drive.profile.points
        step = drive.profile.commands[ask.name].steps[-1] if isinstance(ask, RunCommand) else None
        pulse = step is not None and any(points[name].pulse for name in step.write)
        return request.frames[0 if pulse else -1].end

    def _obeyed(self, ask: RunCommand, drive: Any, answers: list[Answer]) -> bool:
        """Each thing that the last step is to bring about was in an answer; without any, some answer came."""
        points = drive.profile.points
        steps = drive.profile.commands[ask.name].steps
        written = [points[name] for step in steps for name in step.write]
        terms = [(Reading(drive, points[t.name]), t) for t in steps[-1].until if t.name in points]
        for reading, term in terms:
            found = (a.at_registers(reading.point.address, reading.point.words) for a in answers)
            numbers = [reading.number(words) for words in found if words is not None]
            if not any(low <= number <= high for number in numbers for low, high in term.ranges):
                return not reading.plain and bool(numbers)
        return bool(terms) or bool(answers) or not any(point.access.readable for point in written)


class Entitled(Answering):
    """Nothing reaches a wire that is hostile, too old, or whose outcome was told (a stop is sent until the
    drive obeys)."""

    name, hazard = "nothing goes out that may not", "T1 T2 E1 H1"

    def sent(self, frame: Frame) -> None:
        request = self.seen.request_of(frame)
        if request is None or frame.intent is None:
            return
        self.looked += 1
        self._as_asked(request, frame)
        if request.hostile:
            self.fail(f"{request.what} ({request.hostile}) is on the wire: {frame.data.hex(' ')}")
        if request.is_stop:
            return
        late = frame.at - request.at - request.ask.ttl
        if len(request.frames) == 1 and late > LATE:
            self.fail(f"{request.what} of {request.at:.3f} went out {late:.3f} s after its time to live")
        if request.told:
            self.fail(f"{request.what} went out after its outcome {request.told[0][1]}")

    def _as_asked(self, request: Request, frame: Frame) -> None:
        """The record names whose request it is and what, and the words mean the value that was asked for."""
        ask, drive, intent = request.ask, request.drive, frame.intent
        assert intent is not None
        if intent.entry["what"] != request.what or intent.entry["by"]["who"] != ask.origin.who:
            text = f"{request.what} of {ask.origin.who} is on record as {intent.entry['what']}"
            self.fail(f"{text} of {intent.entry['by']['who']}")
        if drive is None:
            return
        if (frame.line, frame.unit) != (drive.line, drive.unit):
            self.fail(f"{request.what} went to unit {frame.unit} of {frame.line}")
        if not isinstance(ask, WriteTag) or not isinstance(ask.value, bool | int | float):
            return
        point = drive.profile.points[ask.target.partition(".")[2]]
        reading, first = Reading(drive, point), point.address - frame.address
        if not reading.plain or point.pulse or point.pace.slew is not None:
            return
        if 0 <= first <= len(frame.words) - point.words:
            words = frame.words[first : first + point.words]
            if not reading.fits(words, ask.value):
                self.fail(f"{request.what} = {ask.value!r} went out as {frame.data.hex(' ')}")

    def told(self, session: int, message: Response) -> None:
        request = self._asked.get((session, message.id)) if isinstance(message, Done) else None
        if request is None or not isinstance(message, Done):
            return
        outcome = message.outcome
        nothing = outcome.verdict in (Verdict.REFUSED, Verdict.EXPIRED, Verdict.SUPERSEDED)
        if outcome.sent == 0 and request.frames and request.life == self.seen.life and nothing:
            self.fail(f"{request.what}: {outcome} although {request.frames[0].data.hex(' ')} was sent")
