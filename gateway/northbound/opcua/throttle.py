"""How long a source must wait after wrong passwords. Pure: time comes in.

Per source, never for all: a guesser must not be able to keep the operators out. Within the waiting time
attempts are refused unread.
"""

from __future__ import annotations

from typing import NamedTuple

FREE = 3
"""Mistakes that cost nothing."""
LONGEST = 30.0
"""Seconds that a source waits at most."""
FORGET = 900.0
"""Seconds after which a source's mistakes are forgotten."""
SOURCES = 1000
"""Sources remembered at most; beyond that the one that failed longest ago is forgotten."""


class _Record(NamedTuple):
    mistakes: int
    until: float
    last: float


class Throttle:
    """Counts wrong passwords per source. Times are seconds of the monotonic clock."""

    def __init__(self) -> None:
        self._records: dict[str, _Record] = {}

    def wait(self, source: str, now: float) -> float:
        """Seconds before the source may try again; 0: now."""
        record = self._records.get(source)
        return max(0.0, record.until - now) if record is not None else 0.0

    def failed(self, source: str, now: float) -> None:
        """A wrong name or password came from the source."""
        record = self._records.pop(source, _Record(0, now, now))
        mistakes = 1 if now - record.last > FORGET else record.mistakes + 1
        pause = min(LONGEST, 2.0 ** (mistakes - FREE)) if mistakes > FREE else 0.0
        self._records[source] = _Record(mistakes, now + pause, now)
        if len(self._records) > SOURCES:
            del self._records[next(iter(self._records))]

    def succeeded(self, source: str) -> None:
        """The source knows a password; its mistakes are forgiven."""
        self._records.pop(source, None)
