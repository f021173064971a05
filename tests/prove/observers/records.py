"""What must hold between wire and journal."""

from __future__ import annotations

from typing import Any

from gateway.mapping.site import SETPOINT
from tests.prove.observers.base import Observer
from tests.prove.seen import Frame, Intent

REPEATS = "pulse"


class OnRecord(Observer):
    """The intent of a write frame is on the disk before the frame is on the wire (stops and a setpoint of
    zero excepted), and stands for one frame only."""

    name, hazard = "no write that is not on record", "R1"

    def sent(self, frame: Frame) -> None:
        if not frame.writes:
            return
        self.looked += 1
        intent = frame.intent
        if intent is None:
            self.fail(f"{frame.data.hex(' ')} on {frame.line} has no intent of its own")
        elif not intent.flushed and not harmless(intent):
            self.fail(f"{frame.data.hex(' ')} on {frame.line}: its intent is not on the disk yet")


def harmless(intent: Intent) -> bool:
    """A stop, or a setpoint of zero: carried out even where it cannot be put on record."""
    new = intent.entry["new"]
    return (
        intent.stops
        or (set(new) == {SETPOINT} and new[SETPOINT] == 0)
        or all(value == 0 for value in new.values())
    )


class OnceSent(Observer):
    """A write is sent once: not again while nobody knows what became of it, not in another life. A stop may
    be repeated, and what the drive refused did nothing."""

    name, hazard = "no write is sent twice", "H3 H5"

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._frames: dict[str, list[tuple[int, Frame]]] = {}

    def sent(self, frame: Frame) -> None:
        intent = frame.intent
        key = intent.entry.get("id", "") if intent else ""
        if intent is None or not key or intent.stops:
            return
        self.looked += 1
        before = self._frames.setdefault(key, [])
        life = self.seen.life
        for was, other in before:
            if was != life:
                self.fail(f"{key!r} was sent in life {was} and again in life {life}")
            elif (other.address, other.words) == (frame.address, frame.words) and not other.refused:
                self._again(frame, intent, other)
        before.append((life, frame))

    def _again(self, frame: Frame, intent: Intent, other: Frame) -> None:
        drive = next(d for d in self.box.site.drives if d.name == intent.entry["drive"])
        points = [drive.profile.points[name] for name in intent.entry["new"]]
        if any(point.pulse for point in points) and not any(intent.entry["new"].values()):
            return  # a pulse is taken back until the drive answers
        self.fail(f"{frame.data.hex(' ')} was sent at {other.at:.3f} already")


class Kept(Observer):
    """What was told to be on the disk is there after any crash, and the chain is whole."""

    name, hazard = "what was flushed survives", "R1"

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._by_number: dict[int, dict[str, Any]] = {}
        self._flushed: list[tuple[str, float, str]] = []

    def recorded(self, number: int, entry: dict[str, Any]) -> None:
        self._by_number[number] = entry

    def flushed(self, number: int) -> None:
        """The core was told so."""
        entry = self._by_number.pop(number, None)
        if entry is not None:
            self._flushed.append(_mark(entry))

    def began(self) -> None:
        self._by_number.clear()
        if not self._flushed:
            return
        self.looked += 1
        there = {_mark(entry) for entry in self.box.safe.entries()}
        lost = [mark for mark in self._flushed if mark not in there]
        if lost:
            self.fail(f"{len(lost)} entries are lost, such as {lost[0]}")
        if self.box.safe.broken:
            self.fail(f"the chain is broken: {self.box.safe.broken}")


def _mark(entry: dict[str, Any]) -> tuple[str, float, str]:
    return (
        str(entry.get("boot")),
        float(entry.get("mono", 0.0)),
        f"{entry['kind']} {entry.get('ask')} {entry.get('frame')}",
    )
