"""What must hold on every wire."""

from __future__ import annotations

from gateway.bridge.messages import Call, RunCommand
from gateway.tag import Role
from tests.line.storm.wire import TIMER
from tests.prove.observers.base import Observer
from tests.prove.seen import Frame

EXACT = 1e-6
BABBLE = 0.1
"""Seconds for which others hold a request back: a babbler stops nothing (`STRAY_HOLD` of `gateway.line`)."""
APART = 0.01
"""Seconds of silence that end what others say to each other."""


class Gap(Observer):
    """No frame without the silence before it: 3.5 characters, or what a drive of the line wants."""

    name, hazard = "no frame without its gap", "H4"

    def began(self) -> None:
        self._ends: dict[str, float] = {}
        self._heard: dict[str, tuple[float, float]] = {}
        """Since when others have been heard, and until when."""
        self._silence = {}
        for line in self.box.site.lines:
            character = self.box.buses[line.name].character
            gap = max(drive.profile.serial.gap for drive in line.drives)
            self._silence[line.name] = max(3.5 * character, gap) if line.framing == "rtu" else gap

    def closed(self, line: str) -> None:
        self._ends.pop(line, None)  # nobody can know what is left of a frame on a port that is gone

    def sent(self, frame: Frame) -> None:
        self.looked += 1
        silence = frame.at - self._ends.get(frame.line, -1.0)
        since, until = self._heard.get(frame.line, (self.now, -1.0))
        held = until > self._ends.get(frame.line, -1.0) - EXACT and self.now - since >= BABBLE
        if silence < self._silence[frame.line] - EXACT and not held:
            self.fail(f"{frame.data.hex(' ')} on {frame.line} after {1000 * silence:.3f} ms")
        self._ends[frame.line] = frame.end

    def heard(self, line: str, data: bytes) -> None:
        since, until = self._heard.get(line, (self.now, self.now))
        self._heard[line] = (self.now if self.now - until > APART else since), self.now
        held = self.box.buses[line].faults.weather.pieces == "timer"
        self._ends[line] = max(self._ends.get(line, -1.0), self.now - (TIMER if held else 0.0))


class StopFirst(Observer):
    """A stop overtakes everything but the transaction on the wire, and is not late."""

    name, hazard = "a stop goes first", "H20"
    most = 1.1
    """Seconds: the longest transaction, a reply that never comes, and the gaps around it. One may be on the
    wire, and one for each other drive that has to be stopped goes before."""

    def began(self) -> None:
        self._most = {line.name: (1 + len(line.drives)) * self.most for line in self.box.site.lines}
        self._asked: dict[str, tuple[str, float]] = {}
        """By drive that is to be stopped: its line, and when that was asked."""

    def died(self) -> None:
        self._asked.clear()

    def closed(self, line: str) -> None:
        self._asked = {d: what for d, what in self._asked.items() if what[0] != line}

    def asked(self, session: int, call: Call) -> None:
        if not isinstance(call, RunCommand) or call.name != "stop" or not self._may(call):
            return
        drive = next(d for d in self.box.site.drives if d.name == call.drive)
        again = call.key in self.seen.requests and self.seen.requests[call.key].ask.id != call.id
        if self.box.buses[drive.line].open and not again:
            self._asked.setdefault(call.drive, (drive.line, self.now))

    def _may(self, call: RunCommand) -> bool:
        return call.origin.role.covers(Role.OPERATOR)

    def sent(self, frame: Frame) -> None:
        if not self._asked:
            return
        waiting = {d: at for d, (line, at) in self._asked.items() if line == frame.line}
        intent = frame.intent
        if intent is not None and intent.stops:
            self._asked.pop(intent.entry["drive"], None)
        elif waiting:
            self.fail(f"{frame.data.hex(' ')} went before the stop of {', '.join(waiting)}")

    def stepped(self) -> None:
        for drive, (line, at) in self._asked.items():
            self.looked += 1
            if self.now - at > self._most[line]:
                self.fail(f"the stop of {drive} asked at {at:.3f} is not on the wire yet")
