"""How long things take on the wire, and the record of what was on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gateway.mapping.profile import SerialFormat


@dataclass(frozen=True, slots=True)
class WireTiming:
    """Speed and format of a line. ``gap`` is the drives' least silence in seconds beside 3.5 characters."""

    baud: int
    format: SerialFormat
    gap: float = 0.0

    @property
    def character(self) -> float:
        """Seconds of one character."""
        return self.format.bits_per_character / self.baud

    @property
    def silence(self) -> float:
        """Seconds of silence that end a frame and must precede the next one."""
        return max(3.5 * self.character, self.gap)

    @property
    def tolerance(self) -> float:
        """One bit time: no receiver measures silence more exactly."""
        return 1 / self.baud


@dataclass(frozen=True, slots=True)
class WireFrame:
    """A frame that was on the wire from ``start`` to ``end``: ``>>`` from the master, ``<<`` from
    ``drive``. ``note`` says what spoiled it; empty: it stands as it was sent."""

    start: float
    end: float
    direction: Literal[">>", "<<"]
    data: bytes
    drive: str = ""
    note: str = ""

    def __str__(self) -> str:
        return f"{self.direction} {self.data.hex(' ').upper()}"
