"""The loop that the core runs on: timers that are exact, and the processor before other programs. Shell.

A frame that leaves half a millisecond late costs a line at 9600 baud more than a percent.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import os
import selectors
import time

SPIN = 150e-6
"""Seconds before an instant that are waited out by looking at the clock: sleeping wakes too late."""
PR_SET_TIMERSLACK = 29


class ExactSelector(selectors.SelectSelector):
    """Waits until an instant, not until some time after it.

    epoll, the usual selector, rounds up to whole milliseconds; select ends a tenth of one late. What happens
    meanwhile on a file ends the waiting, however it is done.
    """

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """As `selectors.BaseSelector.select`."""
        if timeout is None or timeout <= 0:
            return super().select(timeout)
        until = time.monotonic() + timeout
        ready = super().select(max(0.0, timeout - SPIN))
        while not ready and time.monotonic() < until:
            ready = super().select(0)
        return ready


def exact_loop() -> asyncio.AbstractEventLoop:
    """A loop with exact timers."""
    return asyncio.SelectorEventLoop(ExactSelector())


def go_first() -> bool:
    """Let this process run as soon as it can, whatever else the machine does; False without the right to.

    The lines need little of a processor, but at once. As root, with ``CAP_SYS_NICE``, or where the limit of
    real-time priorities allows it (systemd: ``LimitRTPRIO=1``).
    """
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0)
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
        return True
    return False
