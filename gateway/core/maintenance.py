"""Drives in maintenance: whoever works on one switches it so, and only a stop is let through. Pure.

It outlives restarts; only switching it off ends it. It is an agreement between people that this gateway
keeps, and no lock: the drive's supply and its panel know nothing of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

from gateway.core.agreed import Worked
from gateway.core.drive import Drive
from gateway.core.guard import refuse
from gateway.core.lease import shown
from gateway.tag import Cause, Origin, Outcome, Role, Verdict

MAINTAINER = Role.ENGINEER
"""Least role that may switch it on and off."""


class Services(Protocol):
    """What it needs from the rest of the core."""

    def record(self, entry: dict[str, Any]) -> object:
        """Append to the journal."""

    def control_changed(self, drive: Drive) -> None:
        """Clients should hear who may command the drive."""

    def tell_event(self, drive: Drive, name: str, text: str) -> None:
        """Tell everybody that something happened."""


class Maintenance:
    """The drives that are in maintenance."""

    def __init__(self, drives: Iterable[Drive], services: Services) -> None:
        self._drives = {drive.name: drive for drive in drives}
        self._services = services
        self._on: dict[str, str] = {}

    def words(self, drive: Drive) -> str:
        """Who switched it on, and why; empty while it is off."""
        return self._on.get(drive.name, "")

    def check(self, drive: Drive) -> None:
        """Raises Ended while the drive is in maintenance."""
        if drive.name in self._on:
            reason = f"{drive.name} is in maintenance, {self._on[drive.name]}; only a stop is let through"
            raise refuse(Cause.MAINTENANCE, reason)

    def switch(self, drive: Drive, on: bool, origin: Origin, reason: str) -> Outcome:
        """Switch it on or off."""
        if on == (drive.name in self._on):
            return Outcome(verdict=Verdict.CONFIRMED, reason="it was so already")
        by = f"switched on by {shown(origin)}" + (f": {reason}" if reason else "")
        self._services.record(
            {"kind": "maintenance", "drive": drive.name, "on": on, "by": origin, "words": by if on else ""}
        )
        if on:
            self._on[drive.name] = by
        else:
            del self._on[drive.name]
        text = f"{drive.name}: maintenance " + (by if on else f"ended by {shown(origin)}")
        self._services.tell_event(drive, "maintenance_on" if on else "maintenance_off", text)
        self._services.control_changed(drive)
        return Outcome(verdict=Verdict.CONFIRMED)

    def restore(self, worked: Mapping[str, Worked]) -> None:
        """What was so before the restart is so still."""
        self._on = {name: kept.words for name, kept in worked.items() if kept.on and name in self._drives}
