"""The loop that the core runs on: timers that are exact, and the processor before other programs. Shell.

A frame that leaves half a millisecond late costs a line at 9600 baud more than a percent.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import os
import selectors
import struct
import time
from collections.abc import Callable
from pathlib import Path

SPIN = 150e-6
"""Seconds before an instant that are waited out by looking at the clock: sleeping wakes too late."""
PR_SET_TIMERSLACK = 29
WAKING = Path("/dev/cpu_dma_latency")
"""Where Linux takes how long waking may take, in microseconds (kernel documentation, PM Quality of Service).
The demand stands as long as the file is open."""
IDLE_DRIVER = Path("/sys/devices/system/cpu/cpuidle/current_driver")
WAKING_MICROSECONDS = 10
"""Lets a processor halt, but not switch itself off part by part: that is left in tenths of a millisecond."""


class ExactSelector(selectors.SelectSelector):
    """Waits until an instant, not until some time after it.

    epoll, the usual selector, rounds up to whole milliseconds; select ends a tenth of one late. What happens
    meanwhile on a file ends the waiting, however it is done. ``at_once`` is called, by file, as soon as the
    file is seen to be readable.
    """

    def __init__(self) -> None:
        super().__init__()
        self.at_once: dict[int, Callable[[], None]] = {}

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """As `selectors.BaseSelector.select`."""
        ready = self._wait(timeout)
        for key, events in ready:
            if events & selectors.EVENT_READ and key.fd in self.at_once:
                self.at_once[key.fd]()
        return ready

    def _wait(self, timeout: float | None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None or timeout <= 0:
            return super().select(timeout)
        until = time.monotonic() + timeout
        ready = super().select(max(0.0, timeout - SPIN))
        while not ready and time.monotonic() < until:
            ready = super().select(0)
        return ready


class ExactLoop(asyncio.SelectorEventLoop):
    """A loop with exact timers, that is `gateway.line.port.Prompt`."""

    def __init__(self) -> None:
        self._exact = ExactSelector()
        super().__init__(self._exact)

    def read_at_once(self, descriptor: int, read: Callable[[], None] | None) -> None:
        """See `gateway.line.port.Prompt.read_at_once`."""
        if read is None:
            self._exact.at_once.pop(descriptor, None)
        else:
            self._exact.at_once[descriptor] = read


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


def stay_awake() -> bool:
    """Let no processor of the machine sleep so deeply that waking it delays a frame, until this process ends;
    False without the right to.

    In a virtual machine (idle driver ``haltpoll``) halting hands the processor to the host, which gives it
    back late: there it has to wait awake.
    """
    with contextlib.suppress(OSError):
        virtual = IDLE_DRIVER.read_text().strip() == "haltpoll" if IDLE_DRIVER.exists() else False
        demand = os.open(WAKING, os.O_WRONLY)
        os.write(demand, struct.pack("i", 0 if virtual else WAKING_MICROSECONDS))
        return True
    return False
