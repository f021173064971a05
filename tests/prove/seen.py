"""What is seen from outside the core: on its wires, by its clients, on its disk."""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass, field
from typing import Any

from gateway.bridge.messages import RunCommand, WriteTag
from gateway.mapping.site import DriveConfig
from gateway.tag import Outcome, Verdict

KEPT = 600
"""Frames and answers that are remembered of a line and of a drive."""

WRITES = (0x05, 0x06, 0x10)


@dataclass(slots=True, eq=False)
class Intent:
    """An intent that the core gave to its journal, and whether it was told that it is on disk."""

    number: int
    entry: dict[str, Any]
    at: float
    keep: bool
    flushed: bool = False

    @property
    def place(self) -> tuple[str, int, int, tuple[int, ...]]:
        """Line, unit, address and words of the frame."""
        entry = self.entry
        words = tuple(int(word[:-1], 16) for word in entry["words"])
        return entry["line"], entry["unit"], int(entry["address"][:-1], 16), words

    @property
    def stops(self) -> bool:
        """It is one of a stop."""
        return str(self.entry["what"]).endswith(".stop")

    @property
    def own(self) -> bool:
        """The core's own, for reasons of its own."""
        return bool(self.entry["by"]["through"] == "core")


@dataclass(slots=True, eq=False)
class Frame:
    """A request of ours on a wire, from ``at`` to ``end``."""

    number: int
    line: str
    at: float
    end: float
    data: bytes
    unit: int
    function: int
    address: int
    words: tuple[int, ...] = ()
    count: int = 0
    intent: Intent | None = None
    done: float | None = None
    """When the drive did it."""
    refused: bool = False

    @property
    def writes(self) -> bool:
        """It changes registers."""
        return self.function in WRITES

    def covers(self, address: int, count: int) -> bool:
        """It reads all of these registers."""
        return self.function == 3 and self.address <= address and address + count <= self.address + self.count


@dataclass(slots=True, frozen=True)
class Answer:
    """What a drive truly answered to a read, whoever asked."""

    at: float
    address: int
    words: tuple[int, ...]

    def at_registers(self, address: int, count: int) -> tuple[int, ...] | None:
        """These of its registers; None if it has not all of them."""
        first = address - self.address
        return self.words[first : first + count] if 0 <= first <= len(self.words) - count else None


@dataclass(slots=True, eq=False)
class Request:
    """A write or command of a client, under its key."""

    key: str
    at: float
    ask: WriteTag | RunCommand
    drive: DriveConfig | None
    session: int
    life: int
    hostile: str = ""
    """Why nothing of it may ever reach a wire."""
    online: bool = True
    """Its line was open when it came."""
    told: list[tuple[float, Outcome]] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)

    @property
    def what(self) -> str:
        """As the journal calls it."""
        ask = self.ask
        return ask.target if isinstance(ask, WriteTag) else f"{ask.drive}.{ask.name}"

    @property
    def is_stop(self) -> bool:
        """It is a stop."""
        return isinstance(self.ask, RunCommand) and self.ask.name == "stop"

    @property
    def outcome(self) -> Outcome | None:
        """What was told first."""
        return self.told[0][1] if self.told else None


class Seen:
    """Everything seen so far, as far as it is remembered."""

    def __init__(self) -> None:
        self.now = 0.0
        self.life = 0
        """How often the core was started."""
        self.frames: dict[str, deque[Frame]] = defaultdict(lambda: deque(maxlen=KEPT))
        self.by_number: dict[int, Frame] = {}
        self.answers: dict[tuple[str, int], deque[Answer]] = defaultdict(lambda: deque(maxlen=KEPT))
        self.intents: list[Intent] = []
        """Those of this life whose frame was not seen yet."""
        self.numbers: dict[int, Intent] = {}
        self.requests: dict[str, Request] = {}

    def intend(self, number: int, entry: dict[str, Any], keep: bool) -> None:
        """The core gave something to its journal."""
        if entry["kind"] == "intent":
            intent = Intent(number, entry, self.now, keep)
            self.intents.append(intent)
            self.numbers[number] = intent
        elif entry["kind"] == "unsent":
            which = entry["ask"], entry["frame"]
            self.intents = [i for i in self.intents if (i.entry["ask"], i.entry["frame"]) != which]

    def dropped(self, number: int) -> None:
        """The core was told that this entry is not on disk; where it was not to be kept, it never will be."""
        intent = self.numbers.get(number)
        if intent is not None and not intent.keep and intent in self.intents:
            self.intents.remove(intent)

    def flushed(self, number: int) -> None:
        """The core was told that this entry is on disk."""
        if (intent := self.numbers.pop(number, None)) is not None:
            intent.flushed = True

    def sent(self, frame: Frame) -> None:
        """A request of ours begins."""
        if frame.writes:
            frame.intent = self._claim(frame)
            key = frame.intent.entry.get("id", "") if frame.intent else ""
            if key in self.requests:
                self.requests[key].frames.append(frame)
        kept = self.frames[frame.line]
        if len(kept) == KEPT:
            self.by_number.pop(kept[0].number, None)
        kept.append(frame)
        self.by_number[frame.number] = frame

    def _claim(self, frame: Frame) -> Intent | None:
        place = frame.line, frame.unit, frame.address, frame.words
        for intent in self.intents:
            if intent.place == place:
                self.intents.remove(intent)
                return intent
        return None

    def request_of(self, frame: Frame) -> Request | None:
        """Whose request a write frame belongs to."""
        return self.requests.get(frame.intent.entry.get("id", "")) if frame.intent else None

    def begin(self) -> None:
        """The core starts: of the one before nothing comes any more."""
        self.life += 1
        self.intents.clear()
        self.numbers.clear()


def is_good(outcome: Outcome | None) -> bool:
    """True for what is told as done."""
    return outcome is not None and outcome.verdict is Verdict.CONFIRMED
