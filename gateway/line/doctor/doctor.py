"""What a line tells the doctor, and what the doctor says. Pure.

The line calls once when a request goes out, once when that is over, and for bytes that nobody asked for:
little work each time. `examine` is for now and then.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from gateway.line.doctor.chart import NOBODY, Arrival, Chart, Incident, Kind, Owed
from gateway.line.doctor.figures import LineFigures, UnitFigures
from gateway.line.doctor.finding import Finding, Illness
from gateway.line.doctor.rules import Patient, findings
from gateway.modbus.framing import FramingName
from gateway.modbus.overheard import Overheard, Sort, overheard
from gateway.modbus.timing import Timing

PIECES = 0.05
"""Seconds after which no further piece of a frame comes: hosts and adapters hand frames over in pieces."""
KEPT = 512
"""Bytes that nobody asked for are looked at when they end, or when there are so many."""
LEAST = 3
"""Fewer bytes than this are no reply that was damaged, but a spark on the wire."""
SECOND = 1.0
"""Seconds in which a second reply to one request comes."""
LATE = 8.0
"""Seconds in which the reply to a request that was given up may still come."""


@dataclass(frozen=True, slots=True)
class Asked:
    """A request that is over: what was sent to a unit, and the length of the normal reply to it on the wire.
    Its last bit left at ``ended``; the last byte since then came at ``heard_at``, if any did."""

    unit: int
    frame: bytes
    size: int
    ended: float
    heard_at: float = 0.0


class Doctor:
    """The doctor of one line. Times are seconds of the monotonic clock. ``longest`` is how many seconds the
    reply of each unit takes at most, by its profile; ``on_late`` gets a unit, and how long after its request
    it began a reply that came when it was not waited for any more."""

    def __init__(
        self,
        longest: Mapping[int, float],
        framing: FramingName,
        timing: Timing,
        echo: bool,
        on_late: Callable[[int, float], None] = lambda unit, seconds: None,
    ) -> None:
        self.line = LineFigures()
        self.units = {unit: UnitFigures() for unit in longest}
        self._longest = dict(longest)
        self._on_late = on_late
        self._chart = Chart(self.units)
        self._framing = framing
        self._timing = timing
        self._echo = echo
        self._head = 5 if framing == "ascii" else 2
        """Characters that a reply has in common with its request: those of unit and function."""
        self._slack = timing.character / 2
        self._quiet_since = -math.inf
        self._strays = b""
        self._sent = b""
        self._replies: dict[int, bytes] = {}
        """The last reply of each unit."""
        self._foreign = (NOBODY, -math.inf)
        """Whom somebody else asked last, and when."""

    # What happens

    def opened(self, now: float) -> None:
        """The port is open."""
        self._chart.open(now)
        self._strays = b""
        self._quiet_since = now

    def sent(self, unit: int, size: int, probe: bool, now: float) -> None:
        """A request of so many bytes goes out."""
        if self._strays:
            self._listen(self._strays, self._quiet_since)
            self._strays = b""
        if now - self._quiet_since < self._timing.gap - self._slack:
            self.line.violations += 1
        self._quiet_since = now + self._timing.duration(size)
        self.line.sent += size
        if unit in self.units:  # a broadcast goes to nobody in particular
            self.units[unit].began(size, probe)

    def answered(self, asked: Asked, reply: bytes, before: bytes, code: int | None, heard_at: float) -> None:
        """A reply came, complete at a moment; ``before`` are the bytes in front of it."""
        duration = self._timing.duration(len(reply))
        after = heard_at - asked.ended
        turnaround = max(0.0, after - duration)
        figures = self.units[asked.unit]
        figures.replied(code, turnaround, len(reply) + len(before), heard_at)
        if turnaround < self._timing.gap - 2 * self._slack:
            figures.traffic.early += 1
        self._quiet_since = heard_at
        self._chart.answered(asked.unit, heard_at)
        self._chart.arrivals.append(Arrival(asked.unit, heard_at, after, duration))
        if turnaround <= self._longest[asked.unit]:
            self._chart.units[asked.unit].lates.clear()
        if before or self._echo:
            self._in_front(asked, before, heard_at)
        self._sent, self._replies[asked.unit] = asked.frame, reply

    def missed(self, asked: Asked, heard: bytes, now: float) -> None:
        """No reply came in time; ``heard`` is what did."""
        body = self._without_echo(asked, heard, now)
        known = overheard(self._framing, body)
        own = [one for one in known.frames if one.unit == asked.unit and one.sort is not Sort.REQUEST]
        garbled = known.rest >= LEAST or (known.rest > 0 and not known.frames and len(body) >= LEAST)
        self._sent = asked.frame
        self.units[asked.unit].missed(len(body))
        if own and self._echo and body is heard:
            self._chart.note(Incident(now, asked.unit, Kind.NO_ECHO))
        kind = Kind.GARBLED if garbled else Kind.SILENT
        like, long = self._like(body, asked), len(body) >= asked.size + LEAST
        if own and not self._echo:
            self._own_late(asked, own)
        self._chart.missed(Incident(now, asked.unit, kind, like, long))
        if kind is Kind.SILENT:
            self._chart.units[asked.unit].owed.append(Owed(asked.ended, asked.size))
        for frame in known.frames:
            if frame not in own:  # a late reply is no illness
                self._stranger(frame, asked.heard_at)
        if body:
            self._quiet_since = max(self._quiet_since, now - self._timing.gap)

    def _like(self, body: bytes, asked: Asked) -> bool:
        """True when it is the reply that was due, but for a few bits: it begins as that, or is as long and
        begins nearly so. A reply begins as its request does."""
        head = asked.frame[: self._head]
        right = sum(one == other for one, other in zip(body, head, strict=False))
        return right == len(head) or (len(body) == asked.size and 2 * right >= len(head))

    def stray(self, data: bytes, now: float) -> None:
        """Bytes came in that nobody asked for."""
        self.line.strays += len(data)
        began = now - self._timing.duration(len(data))
        if not self._strays and began - self._quiet_since < self._timing.gap - 2 * self._slack:
            self.line.intrusions += 1
        self._quiet_since = now
        self._strays = (self._strays + data)[-KEPT:]

    def down(self, unit: int, now: float) -> None:
        """A unit is held to be down: nobody promises anything of its values until it is back."""
        self._chart.units[unit].down_at = now

    def renewed(self, unit: int, read_at: float, promised: float, now: float) -> None:
        """A planned read brought new values for those of a moment; ``promised`` is their worst age."""
        if read_at > self._chart.units[unit].down_at:
            self.units[unit].aged(now - read_at, promised, now)

    # What is wrong

    def examine(self, down: Iterable[int], is_open: bool, now: float) -> list[Finding]:
        """The diagnoses. ``down`` are the units that are held to be down."""
        if not is_open:
            return [Finding(Illness.PORT_DOWN)]
        if self._strays and now - self._quiet_since > PIECES:
            self._listen(self._strays, self._quiet_since)
            self._strays = b""
        self._chart.forget(now)
        return findings(Patient(self._chart, frozenset(down), self._echo, self._longest, now))

    # What came in

    def _in_front(self, asked: Asked, before: bytes, now: float) -> None:
        """Look at what came in front of a reply."""
        body = self._without_echo(asked, before, now)
        if self._echo and body is before:
            self._chart.note(Incident(now, asked.unit, Kind.NO_ECHO))
        if body:
            self._listen(body, now)

    def _without_echo(self, asked: Asked, heard: bytes, now: float) -> bytes:
        """What was heard behind our own request, if that came back; otherwise all of it."""
        if not heard.startswith(asked.frame):
            return heard
        self._chart.echoes.add(now)
        return heard[len(asked.frame) :]

    def _listen(self, data: bytes, now: float) -> None:
        """Who spoke, when nobody was asked?"""
        known = overheard(self._framing, data)
        if known.rest:
            self._chart.note(Incident(now, NOBODY, Kind.STRAY))
        for frame in known.frames:
            self._stranger(frame, now)

    def _stranger(self, frame: Overheard, now: float) -> None:
        """A frame that we did not ask for."""
        if frame.frame == self._sent and (self._echo or self._chart.has_echo(now - SECOND, now)):
            return  # our own, handed back late
        if frame.sort is Sort.REQUEST or frame.unit not in self.units:
            self._foreign = frame.unit, now
            kind = Kind.REPLY if frame.sort is Sort.REPLY else Kind.REQUEST
            self._chart.note(Incident(now, frame.unit, kind))
        elif (again := self._unasked(frame, now)) is not None:
            self._chart.note(Incident(now, frame.unit, again))

    def _own_late(self, asked: Asked, frames: Sequence[Overheard]) -> None:
        """Replies of the unit that was asked, and none of them the one that was due."""
        for frame in frames:
            if self._chart.units[asked.unit].owed and frame.frame != asked.frame:
                self._late(frame, asked.heard_at)

    def _late(self, frame: Overheard, now: float) -> None:
        """A reply of one of our units to a request that was given up: the oldest that it fits, if any."""
        owed, size = self._chart.units[frame.unit].owed, len(frame.frame)
        found = next((one for one in owed if one.size == size), None)
        owed.remove(found or owed[0])
        if found is not None:
            after = max(0.0, now - self._timing.duration(size) - found.ended)
            self._chart.late(frame.unit, after, now)
            self._on_late(frame.unit, after)

    def _unasked(self, frame: Overheard, now: float) -> Kind | None:
        """What a reply of one of our units is: to somebody else, late, or one too many."""
        chart = self._chart.units[frame.unit]
        unit, at = self._foreign
        if unit == frame.unit and now - at < SECOND:
            return Kind.REPLY
        while chart.owed and now - chart.owed[0].ended >= LATE:
            chart.owed.popleft()
        if chart.owed:
            self._late(frame, now)
            return None
        if now - chart.answered_at > SECOND:
            return Kind.REPLY
        last = self._replies.get(frame.unit, b"")
        alike = len(last) == len(frame.frame) and last.startswith(frame.frame[: self._head])
        return Kind.CONTRADICTED if alike and last != frame.frame else Kind.DOUBLED
