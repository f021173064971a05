"""What must follow a stop that the drive did not hear, and the end of a lease."""

from __future__ import annotations

from gateway.bridge.api import ControlState
from gateway.bridge.messages import Response
from tests.prove.observers.base import Observer
from tests.prove.seen import Frame

AGAIN = 10.0
"""Seconds after which a stop that no drive heard is on the wire again: the longest pause between two, and
what may be on the wire before it."""
EACH = 1.1
"""Seconds of the longest transaction."""
SLACK = 1.0


class Repeats(Observer):
    """A stop goes out again and again until its drive has heard it, or refused it."""

    name, hazard = "a stop is repeated until it is heard", "H20"

    def began(self) -> None:
        self._unheard: dict[str, list[Frame]] = {}

    died = began

    def closed(self, line: str) -> None:
        self._unheard = {d: frames for d, frames in self._unheard.items() if frames[0].line != line}

    def sent(self, frame: Frame) -> None:
        if frame.intent is not None and frame.intent.stops:
            self._unheard.setdefault(frame.intent.entry["drive"], []).append(frame)

    def stepped(self) -> None:
        for drive, frames in list(self._unheard.items()):
            self.looked += 1
            if any(frame.done is not None or frame.refused for frame in frames):
                del self._unheard[drive]
            elif self.now - frames[-1].end > AGAIN:
                self.fail(f"the stop of {drive} was sent at {frames[-1].at:.3f}, unheard, and not again")


class Expires(Observer):
    """Where a lease ends that told of a stop to follow, the stop is on the wire soon."""

    name, hazard = "what follows the end of a lease follows", "H10"

    def __init__(self, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        self._drives = {drive.name: drive for drive in self.box.site.drives}
        self.began()

    def began(self) -> None:
        self._state: dict[str, ControlState] = {}
        self._due: dict[str, float] = {}

    died = began

    def closed(self, line: str) -> None:
        self._due = {d: at for d, at in self._due.items() if self._drives[d].line != line}

    def told(self, session: int, message: Response) -> None:
        if not isinstance(message, ControlState):
            return
        before = self._state.get(message.drive)
        self._state[message.drive] = message
        if before is None or before.holder is None or before.then != "stop":
            return
        line = self.box.buses[self._drives[message.drive].line]
        if message.phase == "free" and not message.void and line.open:
            most = EACH * (1 + len(line.stations)) + SLACK
            self._due.setdefault(message.drive, self.now + most)

    def sent(self, frame: Frame) -> None:
        if frame.intent is not None and frame.intent.stops:
            self._due.pop(frame.intent.entry["drive"], None)

    def stepped(self) -> None:
        for drive, at in self._due.items():
            self.looked += 1
            if self.now > at:
                self.fail(f"the lease of {drive} is over, and no stop follows")
