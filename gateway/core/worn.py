"""How often registers were written that wear by it, as the journal remembers it (H14). Pure.

The intent of a frame names the registers that it wears (``wears``). What the drive refused, or was not sent
in the end, wears nothing: an entry of kind ``spared`` takes it back. A day is the last 24 hours of lived time
(`gateway.core.runs`), so that no change of the clock gives writes back or takes them away.
"""

from __future__ import annotations

import msgspec
from msgspec import field

from gateway.core.chain import Entry

DAY = 86400.0


class Worn(msgspec.Struct, kw_only=True):
    """How often a register was written: ever, and when in the last day (lived time)."""

    total: int = 0
    day: list[float] = field(default_factory=list)

    def write(self, lived: float) -> None:
        """It is written once more."""
        self.total += 1
        self.day = [*self.since(lived), lived]

    def spare(self) -> None:
        """The last write did not happen."""
        self.total = max(0, self.total - 1)
        del self.day[-1:]

    def since(self, lived: float) -> list[float]:
        """When it was written in the day that ends now."""
        return [at for at in self.day if at > lived - DAY]


class Wear(msgspec.Struct, kw_only=True):
    """What is remembered of all registers that wear, by `place`."""

    registers: dict[str, Worn] = field(default_factory=dict)

    def fold(self, entry: Entry) -> None:
        """Take in one entry of the journal."""
        if entry["kind"] == "intent":
            for register in entry.get("wears", ()):
                worn = self.registers.setdefault(place(entry["drive"], register), Worn())
                worn.write(entry["lived"])
        elif entry["kind"] == "spared":
            for register in entry["wears"]:
                self.of(entry["drive"], register).spare()

    def of(self, drive: str, register: str) -> Worn:
        """How often a register was written."""
        return self.registers.get(place(drive, register), Worn())


def place(drive: str, register: str) -> str:
    """The name under which a register is kept: ``fan-1:0103H``."""
    return f"{drive}:{register}"
