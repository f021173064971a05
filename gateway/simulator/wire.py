"""How long things take on the wire, and the record of what was on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gateway.mapping.profile import SerialFormat

ASCII_END = b"\r\n"
ASCII_PATIENCE = 1.0
"""Seconds between two characters of an ASCII frame after which it is given up."""


@dataclass(frozen=True, slots=True)
class WireTiming:
    """Speed and format of a line. ``gap`` is the drives' least silence in seconds beside 3.5 characters."""

    baud: int
    format: SerialFormat
    gap: float = 0.0
    framing: Literal["rtu", "ascii"] = "rtu"

    @property
    def character(self) -> float:
        """Seconds of one character."""
        return self.format.bits_per_character / self.baud

    @property
    def silence(self) -> float:
        """Seconds of silence that must precede a frame; in ASCII its colon is enough."""
        return max(3.5 * self.character, self.gap) if self.framing == "rtu" else 0.0

    def patience(self, data: bytes | bytearray) -> float:
        """Seconds of silence after which these bytes are taken for a whole frame."""
        if self.framing == "rtu":
            return self.silence
        return 0.0 if data.endswith(ASCII_END) else ASCII_PATIENCE

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
