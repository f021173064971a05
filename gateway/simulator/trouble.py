"""Faults and warnings of a drive: how they strike, what they leave in the history, how they go."""

from __future__ import annotations

from collections.abc import Mapping

from gateway.mapping.profile import Kind, Point, Profile
from gateway.mapping.twin import Reaction, Simulate
from gateway.simulator.bank import Bank, UnsupportedError
from gateway.simulator.motion import Motion

COMMUNICATION = "communication"
"""The alarm of a lost line."""
WARNING = "warning"
"""What the names of light faults begin with."""


class Trouble:
    """All faults of one drive. ``active`` are the names of those that have not been reset."""

    def __init__(
        self, bank: Bank, profile: Profile, facts: Simulate, points: Mapping[str, Point], motion: Motion
    ) -> None:
        self.active: set[str] = set()
        self.line_lost = False
        self._bank = bank
        self._profile = profile
        self._points = points
        self._facts = facts
        self._motion = motion
        self._bits = tuple(p.name for p in points.values() if p.kind is Kind.FAULT and p.encoding.width == 1)

    @property
    def warning(self) -> bool:
        """A light fault is there."""
        return any(name.startswith(WARNING) for name in self.active)

    def require(self, fault: str) -> None:
        """Refuse the name of a fault that this drive cannot have."""
        if fault not in self._bits and fault not in self._facts.alarms:
            raise UnsupportedError(f"{fault} is no fault of the profile")

    def strike(self, fault: str, reaction: Reaction = "coast") -> None:
        """A fault appears; a warning leaves the motor alone."""
        self._mark(fault, True)
        if not fault.startswith(WARNING):
            self._remember(self._code(fault))
            self._motion.react(reaction)

    def cure(self, fault: str) -> None:
        """A fault goes by itself."""
        self._mark(fault, False)

    def lose_line(self) -> None:
        """Nobody has spoken for too long."""
        self.line_lost = True
        if COMMUNICATION in self._facts.alarms:
            self._remember(self._facts.alarms[COMMUNICATION])
        self._motion.react(self.action(self._profile.serial.comm_loss.action))

    def action(self, name: str | None) -> Reaction:
        """What the point or setting of that name tells the drive to do; a coast where nothing is told."""
        if name is None:
            return "coast"
        point, setting = self._points.get(name), self._profile.settings.get(name)
        values = point.encoding.values if point else setting.values if setting else {}
        return self._facts.actions.get(values.get(int(self._bank.number(name) or 0), ""), "coast")

    def reset(self) -> None:
        """Forget all faults; warnings stay while their cause does."""
        self._motion.reaction, self.line_lost = None, False
        for fault in [name for name in self.active if not name.startswith(WARNING)]:
            self._mark(fault, False)

    def forget(self) -> None:
        """As after the mains were off."""
        self.active.clear()
        self._motion.reaction, self.line_lost = None, False

    def _mark(self, fault: str, present: bool) -> None:
        (self.active.add if present else self.active.discard)(fault)
        if fault in self._points:
            self._bank.set(fault, present)

    def _code(self, fault: str) -> int:
        if fault in self._facts.alarms:
            return self._facts.alarms[fault]
        return self._points[fault].encoding.bit + 1

    def _remember(self, code: int) -> None:
        """The latest fault comes first in the history."""
        codes = [code, *(self._bank.raw(name) for name in self._facts.history)]
        for name, each in zip(self._facts.history, codes, strict=False):
            width = self._points[name].encoding.width or 16
            self._bank.put(name, each & ((1 << width) - 1))
