"""Paths that are hardly ever taken, and whether to take one now for no other reason than to see that it is
right. Pure.

A gateway never does. A simulation takes some of them at random, so that what takes a thousand writes at once
is played where there are ten.
"""

from __future__ import annotations

from collections.abc import Callable

Rarely = Callable[[str], bool]
"""Asked with the name of a path whether to take it although nothing demands it."""

MANY_READS = "many reads wait to be looked at"
MANY_WRITES = "many writes are under way"
MANY_IDS = "many ids have to be remembered"
UNFORETOLD = "nothing is foretold"

PATHS = (MANY_READS, MANY_WRITES, MANY_IDS, UNFORETOLD)


def never(path: str) -> bool:
    """Outside simulations."""
    return False
