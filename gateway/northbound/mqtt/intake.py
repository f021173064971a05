"""Messages on their way from the connection to the commander: a stop goes at once, the others one after the
other.

Looking at a command and beginning it takes several times as long as reading it. So much is read and little
is begun at a time: a stop does not wait behind all that came before it. (What it overtook here must not be
carried out after it: the commander sees to that.)
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable

from gateway.northbound.mqtt.message import Incoming

TOGETHER = 2
"""Messages that are looked at before the next are read."""
MOST = 4096
"""Messages that wait at most. With more, each new one has to wait until an old one was looked at."""


class Intake:
    """Passes messages on to ``take``, those first of which ``urgent`` is true. All methods belong to the
    event loop's thread."""

    def __init__(self, take: Callable[[Incoming], None], urgent: Callable[[Incoming], bool]) -> None:
        self._take = take
        self._urgent = urgent
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[Incoming] = deque()
        self._busy = False
        """True when something was taken since the loop last looked at what else there is."""

    def put(self, incoming: Incoming) -> None:
        """A message came in."""
        if self._urgent(incoming):
            self._take(incoming)
            return
        self._waiting.append(incoming)
        if not self._busy:
            self._some()
        elif len(self._waiting) > MOST:
            self._take(self._waiting.popleft())

    def _some(self) -> None:
        """Take the next ones, and come back later for more."""
        self._busy = bool(self._waiting)
        if self._busy:
            self._loop.call_soon(self._some)
        for _ in range(min(TOGETHER, len(self._waiting))):
            self._take(self._waiting.popleft())
