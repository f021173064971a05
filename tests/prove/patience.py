"""An end to what would go on for ever in a world, so that a hanging core is a finding like any other."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from types import FrameType

MOST = 200.0
"""Seconds of processor time that one world may take: a hundred times what most take."""


class HangsError(Exception):
    """It went on for too long."""


@contextlib.contextmanager
def patience(seconds: float = MOST) -> Iterator[None]:
    """Raise `HangsError` in what takes longer; for the main thread of a process."""

    def ring(number: int, frame: FrameType | None) -> None:
        raise HangsError(f"nothing came of it in {seconds:g} s of processor time")

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
