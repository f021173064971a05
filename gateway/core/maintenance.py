"""Drives in maintenance: whoever works on one switches it so, and only a stop is let through. Pure.

It outlives restarts; only switching it off ends it. So it is confirmed when it is on the disk and not before:
until then the drive is in maintenance either way, and what cannot be put on record is refused and stays as it
was (safety.md R2). It is an agreement between people that this gateway keeps, and no lock: the drive's supply
and its panel know nothing of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from gateway.core.agreed import Worked
from gateway.core.drive import Drive
from gateway.core.guard import refuse
from gateway.core.lease import shown
from gateway.core.trail import HANGING
from gateway.tag import Cause, Instant, Origin, Outcome, Role, Verdict

MAINTAINER = Role.ENGINEER
"""Least role that may switch it on and off."""

UNKEPT = Outcome(
    verdict=Verdict.UNKNOWN,
    cause=Cause.JOURNAL,
    reason=f"the disk has not answered for {HANGING:g} s: it is not on record yet, and would be lost if the "
    "gateway ended now",
)


class Services(Protocol):
    """What it needs from the rest of the core."""

    def record(self, entry: dict[str, Any], keep: bool = True) -> int:
        """Append to the journal; the number of the entry, whose end is told by `Maintenance.recorded`."""

    def control_changed(self, drive: Drive) -> None:
        """Clients should hear who may command the drive."""

    def tell_event(self, drive: Drive, name: str, text: str) -> None:
        """Tell everybody that something happened."""


@dataclass(slots=True)
class Switching:
    """A switch that is not on record yet, and by when it has to be (monotonic)."""

    drive: Drive
    on: bool
    text: str
    until: float
    answer: Callable[[Outcome], None]
    told: bool = False


class Maintenance:
    """The drives that are in maintenance."""

    def __init__(self, drives: Iterable[Drive], services: Services) -> None:
        self._drives = {drive.name: drive for drive in drives}
        self._services = services
        self._on: dict[str, str] = {}
        self._switching: dict[int, Switching] = {}
        """By the number of the entry that tells it."""

    def words(self, drive: Drive) -> str:
        """Who switched it on, and why; empty while it is off."""
        return self._on.get(drive.name, "")

    def check(self, drive: Drive) -> None:
        """Raises Ended while the drive is in maintenance."""
        if drive.name in self._on:
            reason = f"{drive.name} is in maintenance, {self._on[drive.name]}; only a stop is let through"
            raise refuse(Cause.MAINTENANCE, reason)

    def switch(
        self,
        drive: Drive,
        on: bool,
        origin: Origin,
        reason: str,
        now: Instant,
        answer: Callable[[Outcome], None],
    ) -> None:
        """Switch it on or off; ``answer`` hears what became of it.

        Raises:
            Ended: while somebody else's switch is not on record.
        """
        if any(drive is other.drive for other in self._switching.values()):
            raise refuse(Cause.MAINTENANCE, f"{drive.name} is being switched; that is not on record yet")
        if on == (drive.name in self._on):
            answer(Outcome(verdict=Verdict.CONFIRMED, reason="it was so already"))
            return
        by = f"switched on by {shown(origin)}" + (f": {reason}" if reason else "")
        entry = {
            "kind": "maintenance",
            "drive": drive.name,
            "on": on,
            "by": origin,
            "words": by if on else "",
        }
        number = self._services.record(entry, keep=False)
        text = f"{drive.name}: maintenance " + (by if on else f"ended by {shown(origin)}")
        self._switching[number] = Switching(drive, on, text, now.mono + HANGING, answer)
        if on:
            self._on[drive.name] = by
            self._services.control_changed(drive)

    def recorded(self, number: int, problem: str) -> None:
        """An entry of the journal is on disk, or the problem says why it is not and will not be."""
        switching = self._switching.pop(number, None)
        if switching is None:
            return
        drive, kept = switching.drive, not problem
        if kept != switching.on:
            del self._on[drive.name]
            self._services.control_changed(drive)
        if kept:
            name = "maintenance_on" if switching.on else "maintenance_off"
            self._services.tell_event(drive, name, switching.text)
            outcome = Outcome(verdict=Verdict.CONFIRMED)
        else:
            reason = f"what cannot be put on record would be lost at a restart: {problem}"
            outcome = refuse(Cause.JOURNAL, reason).outcome
            if switching.told:
                text = f"{switching.text}, but not done: {reason}"
                self._services.tell_event(drive, "maintenance_refused", text)
        if not switching.told:
            switching.answer(outcome)

    def tick(self, now: Instant) -> None:
        """Tell those who wait too long for the disk."""
        for switching in self._switching.values():
            if switching.until <= now.mono and not switching.told:
                switching.told = True
                switching.answer(UNKEPT)

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        return min((each.until for each in self._switching.values() if not each.told), default=None)

    def restore(self, worked: Mapping[str, Worked]) -> None:
        """What was so before the restart is so still."""
        self._on = {name: kept.words for name, kept in worked.items() if kept.on and name in self._drives}
