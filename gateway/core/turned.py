"""Attempts that an adapter refused before they reached the core, put on record (R1). Pure.

The kind of their entries is ``turned away``. A flood of them must not wash everything else out of the
journal: beyond so many at a time they are only counted, and the next entry tells how many (D2).
"""

from __future__ import annotations

from gateway.bridge.messages import TurnedAway
from gateway.core.trail import Trail
from gateway.tag import Instant

BURST = 200
PER_SECOND = 20.0
"""Entries that each client gets, and how fast they come back."""

TEXT = 200
"""Characters of what was wanted that are kept."""


class _Allowance:
    """What one client has left."""

    def __init__(self, now: float) -> None:
        self.left, self.since, self.passed_over = float(BURST), now, 0

    def take(self, now: float) -> bool:
        """Use one up, if there is one."""
        self.left = min(float(BURST), self.left + (now - self.since) * PER_SECOND)
        self.since = now
        if self.left < 1.0:
            self.passed_over += 1
            return False
        self.left -= 1.0
        return True


class TurnedAways:
    """All of them."""

    def __init__(self, trail: Trail) -> None:
        self._trail = trail
        self._allowances: dict[str, _Allowance] = {}

    def record(self, client: str, attempt: TurnedAway, now: Instant) -> None:
        """Put one on record, or count it."""
        allowance = self._allowances.setdefault(client, _Allowance(now.mono))
        if not allowance.take(now.mono):
            return
        wanted = attempt.wanted
        entry = {
            "kind": "turned away",
            "what": attempt.what[:TEXT],
            "wanted": wanted if isinstance(wanted, bool | int | float | None) else str(wanted)[:TEXT],
            "by": attempt.origin,
            "client": client,
            "outcome": attempt.outcome,
        }
        if allowance.passed_over:
            entry["passed_over"], allowance.passed_over = allowance.passed_over, 0
        self._trail.record(entry)
