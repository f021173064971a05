"""ServiceLevel: how well the server can do its work (OPC 10000-4 section 6.6.2.4.2). Pure."""

from __future__ import annotations

HEALTHY = 255
NO_DATA = 1
_DEGRADED = (2, 199)


def service_level(drives: int, down: int) -> int:
    """255 when no drive is known to be lost, 1 when all are, and 2 to 199 in between."""
    if down <= 0:
        return HEALTHY
    if down >= drives:
        return NO_DATA
    low, high = _DEGRADED
    return low + (high - low) * (drives - down) // drives
