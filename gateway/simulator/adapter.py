"""A serial adapter that collects what it receives and hands it over only now and then.

FTDI's chips pass on what came in when their latency timer fires, every 16 ms unless they are told otherwise
(application note AN232B-04).
"""

from __future__ import annotations

import math


class LatencyTimer:
    """Holds bytes back until the next multiple of ``period`` seconds; with 0 not at all."""

    def __init__(self, period: float = 0.0) -> None:
        self.period = period
        self._held = bytearray()
        self._fires = math.inf

    def take(self, data: bytes, now: float) -> bytes:
        """Bytes came in; what the host gets now."""
        if not self.period:
            return data
        if data and not self._held:
            self._fires = (math.floor(now / self.period) + 1) * self.period
        self._held += data
        if now < self._fires:
            return b""
        handed, self._held, self._fires = bytes(self._held), bytearray(), math.inf
        return handed

    def due(self) -> float:
        """When `take` has something to hand over; infinite when nothing is held."""
        return self._fires
