"""How an emulated line is set up, and the time that things take on it."""

from __future__ import annotations

from dataclasses import dataclass, field

FIXED_ABOVE, FIXED_SILENCE = 19200, 0.00175
"""Above this baud rate the silence is no longer counted in characters (serial line V1.02, 2.5.1.1)."""
SILENCE = 3.5


@dataclass(slots=True)
class LineSettings:
    """One line. ``bits``: of a character on the wire, with start, parity and stop bits. Times in seconds.

    ``pieces``: a reply is handed over after so many characters each (0: whole). ``hold``: an adapter hands
    everything over so much later than it crossed the wire. ``silent``: units that do not answer.
    ``strict``: a request that comes too early is not answered, as drives do.
    """

    name: str
    baud: int
    bits: int
    units: list[int]
    turnaround: float = 0.005
    pieces: int = 0
    hold: float = 0.0
    strict: bool = True
    silent: list[int] = field(default_factory=list)

    @property
    def character(self) -> float:
        """Seconds that a character takes."""
        return self.bits / self.baud

    @property
    def silence(self) -> float:
        """Seconds of silence that have to precede a frame."""
        return FIXED_SILENCE if self.baud > FIXED_ABOVE else SILENCE * self.character
