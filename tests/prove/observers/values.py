"""What must hold of every value that a client is told."""

from __future__ import annotations

import heapq
import itertools
from dataclasses import dataclass
from typing import Any

from gateway.bridge.api import Batch, Periods
from gateway.bridge.messages import Call, Promised, Response, Samples, Watch
from gateway.mapping.profile import Point
from gateway.mapping.site import DriveConfig
from gateway.simulator.slot import Slot
from gateway.tag import Quality, Sample, Value, is_own, split_tag
from tests.prove.observers.base import Observer
from tests.prove.seen import Frame

STALE_PERIODS = 2
LATE = 0.65
"""Seconds that may pass until a broken promise is shown: ages are looked at ten times a second, by a process
that may stand still for a while."""
EXACT = 1e-4


class Reading:
    """How registers are read, by the simulator's own rules; `expected` is None where they are not enough."""

    def __init__(self, drive: DriveConfig, point: Point) -> None:
        self.drive, self.point = drive, point
        self.slot = Slot(point.address, point.encoding)
        self.plain = not (point.cases or point.when or point.select or point.encoding.times is not None)

    def _raw(self, words: tuple[int, ...]) -> int:
        return self.slot.read(dict(enumerate(words, self.point.address)))

    def number(self, words: tuple[int, ...]) -> float:
        """What these registers mean in the unit."""
        raw = self._raw(words)
        if self.point.encoding.active_low:
            return 1 - raw
        return self.slot.number(raw) * self.slot.scale + self.slot.offset

    def fits(self, words: tuple[int, ...], value: Value) -> bool:
        """True when these registers mean this value."""
        if value is None:
            return True
        if isinstance(value, str):
            named = self.point.encoding.values.get(self._raw(words))
            return named is None or named == value
        number = self.number(words)
        return abs(number - value) <= max(abs(self.slot.scale) / 2, 1e-9)


class Truth(Observer):
    """A value shown as good is one that its drive answered to the latest request for it, not to another one
    and not before."""

    name, hazard = "no wrong or old value is good", "H4 H17"

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._readings = {
            f"{drive.name}.{point.name}": Reading(drive, point)
            for drive in self.box.site.drives
            for point in drive.profile.points.values()
            if point.access.readable
        }

    def told(self, session: int, message: Response) -> None:
        if isinstance(message, Batch | Samples):
            for sample in message.samples:
                self._look_at(sample)

    def _look_at(self, sample: Sample) -> None:
        reading = self._readings.get(sample.tag)
        if sample.quality is not Quality.GOOD or reading is None or not reading.plain:
            return
        at = self.box.moment_of(sample.time)
        drive, point = reading.drive, reading.point
        request = self._request(drive, point, at)
        answers = self.seen.answers[drive.line, drive.unit]
        if request is None or not answers or answers[0].at > request.at:
            return  # longer ago than is remembered
        self.looked += 1
        for answer in reversed(answers):
            if answer.at < request.at:
                break
            words = answer.at_registers(point.address, point.words)
            if words is not None and answer.at <= at + EXACT and reading.fits(words, sample.value):
                return
        self.fail(f"{sample.tag} = {sample.value!r} of {at:.3f} (asked at {request.at:.3f}) was not answered")

    def _request(self, drive: DriveConfig, point: Point, at: float) -> Frame | None:
        """The latest of our requests for it that was sent by then."""
        for frame in reversed(self.seen.frames[drive.line]):
            if frame.unit == drive.unit and frame.at <= at and frame.covers(point.address, point.words):
                return frame
        return None


@dataclass(slots=True)
class Shown:
    """What a client sees of a tag: until when the value may be good, and which version of it that is."""

    period: float
    of: float | None = None
    """When the value was true; None: it is not shown as good."""
    version: int = 0


class Promise(Observer):
    """Every promised period is kept, or is shown to be broken."""

    name, hazard = "no old value is good", "H17"

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._shown: dict[tuple[int, str], Shown] = {}
        self._due: list[tuple[float, int, tuple[int, str], int]] = []
        self._order = itertools.count()
        self._asked: dict[tuple[int, int], Watch] = {}

    def died(self) -> None:
        self._shown.clear()
        self._due.clear()
        self._asked.clear()

    def left(self, session: int) -> None:
        self._shown = {key: shown for key, shown in self._shown.items() if key[0] != session}

    def asked(self, session: int, call: Call) -> None:
        if isinstance(call, Watch):
            self._asked[session, call.id] = call

    def told(self, session: int, message: Response) -> None:
        match message:
            case Promised(id, periods):
                for tag, wanted in self._asked.pop((session, id)).wants.items():
                    if wanted is None:
                        self._shown.pop((session, tag), None)
                    elif tag not in periods and not is_own(tag):
                        self.fail(f"nothing is promised of {tag}")
                self._promised(session, periods)
            case Periods(periods):
                self._promised(session, periods)
            case Batch():
                for sample in message.samples:
                    self._told(session, sample)

    def _promised(self, session: int, periods: Any) -> None:
        for tag, period in periods.items():
            if not is_own(tag):
                shown = self._shown.setdefault((session, tag), Shown(period))
                shown.period = period
                self._plan((session, tag), shown)

    def _told(self, session: int, sample: Sample) -> None:
        shown = self._shown.get((session, sample.tag))
        if shown is not None:
            shown.of = self.box.moment_of(sample.time) if sample.quality is Quality.GOOD else None
            self._plan((session, sample.tag), shown)

    def _plan(self, key: tuple[int, str], shown: Shown) -> None:
        shown.version += 1
        if shown.of is not None:
            due = max(self.now, shown.of + STALE_PERIODS * shown.period) + LATE
            heapq.heappush(self._due, (due, next(self._order), key, shown.version))

    def stepped(self) -> None:
        while self._due and self._due[0][0] < self.now:
            _, _, key, version = heapq.heappop(self._due)
            shown = self._shown.get(key)
            self.looked += 1
            if shown is not None and shown.version == version and shown.of is not None:
                text = f"{key[1]} is shown as good, {self.now - shown.of:.2f} s old, promised every"
                self.fail(f"{text} {shown.period:g} s")

    def ended(self) -> None:
        """No demand starves: without faults everything wanted that can be read is fresh."""


def drive_of(box: Any, tag: str) -> DriveConfig:
    """The drive of a tag."""
    name = split_tag(tag)[0]
    drive: DriveConfig = next(d for d in box.site.drives if d.name == name)
    return drive
