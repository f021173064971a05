"""What was seen on a line since counting began."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

KEPT = 50_000
"""Values of a distribution that are kept."""


@dataclass(slots=True)
class Tally:
    """Counts of one line. Times are seconds of the monotonic clock, of which all processes have the same.

    ``first`` and ``last`` are when the first and the last request of the count began: what is counted in
    ``reads`` (by unit, address and count) was asked from ``first`` on and answered before ``last``.
    ``idle``: how long each request came after the earliest moment that was allowed. ``late``: how long after
    its time this process handed a reply over; that is our own fault, not the master's.
    """

    first: float | None = None
    last: float | None = None
    requests: int = 0
    violations: int = 0
    damaged: int = 0
    unanswered: int = 0
    refused: int = 0
    reads: dict[str, int] = field(default_factory=dict)
    writes: list[tuple[float, int, int, tuple[int, ...]]] = field(default_factory=list)
    idle: list[float] = field(default_factory=list)
    late: list[float] = field(default_factory=list)

    def report(self) -> dict[str, Any]:
        """All of it, fit for JSON."""
        return asdict(self)


def keep(values: list[float], value: float) -> None:
    """Add to a distribution, which is bounded."""
    if len(values) < KEPT:
        values.append(value)
