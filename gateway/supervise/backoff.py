"""How long to wait before a program that ended is started again. Pure."""

from __future__ import annotations

FIRST = 0.2
LONGEST = 10.0
HEALTHY = 30.0


class Backoff:
    """Seconds to wait: `FIRST`, doubling to `LONGEST`; from the beginning after a life of `HEALTHY`."""

    def __init__(self) -> None:
        self._next = FIRST

    def after(self, lived: float) -> float:
        """The wait after a life of ``lived`` seconds."""
        if lived >= HEALTHY:
            self._next = FIRST
        wait = self._next
        self._next = min(2 * wait, LONGEST)
        return wait
