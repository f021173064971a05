"""The time that frames take on a wire."""

from __future__ import annotations

from dataclasses import dataclass

from gateway.mapping.profile import SerialFormat
from gateway.modbus.framing import FramingName

SILENCE = 3.5
"""Characters of silence between RTU frames (serial line V1.02, section 2.5.1.1)."""
END = 1.5
"""Characters of silence after which an RTU frame has ended: what comes earlier belongs to it."""
FIXED_ABOVE = 19200
"""Above this baud rate silences are no longer counted in characters but fixed."""
FIXED_SILENCE = 0.00175
FIXED_END = 0.00075
"""Seconds of both above `FIXED_ABOVE` baud."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Seconds per character, the mandatory silence between frames, and the silence that ends a frame."""

    character: float
    gap: float
    end: float = 0.0

    def duration(self, characters: int) -> float:
        """Seconds that a frame of so many characters takes."""
        return characters * self.character

    def transaction(self, request: int, reply: int, turnaround: float, pause: float = 0.0) -> float:
        """Seconds of line that an exchange takes: both frames (in characters), the unit's turnaround, and
        the silence after it (at least ``pause``). The silence before the reply is part of the turnaround."""
        return self.duration(request + reply) + turnaround + max(self.gap, pause)


def timing_of(framing: FramingName, baud: int, form: SerialFormat, gap: float = 0.0) -> Timing:
    """The timing of a line; ``gap`` is what its drives ask for beyond the standard's silence."""
    if framing == "tcp":
        return Timing(0.0, gap)
    character = form.bits_per_character / baud
    if framing == "ascii":
        return Timing(character, gap)
    if baud > FIXED_ABOVE:
        return Timing(character, max(gap, FIXED_SILENCE), FIXED_END)
    return Timing(character, max(gap, SILENCE * character), END * character)
