"""Is the port open, and when is it opened again? Pauses grow from half a second to five."""

from __future__ import annotations

import math
from enum import Enum

from gateway.line.interface import Action, ClosePort, OpenPort

FIRST_PAUSE = 0.5
LONGEST_PAUSE = 5.0


class _State(Enum):
    STOPPED = "stopped"
    OPENING = "opening"
    OPEN = "open"
    PAUSING = "pausing"


class Connection:
    """The state of a line's port."""

    def __init__(self) -> None:
        self._state = _State.STOPPED
        self._pause = FIRST_PAUSE
        self.reason = "not started"
        self.open_at = math.inf
        """When it is to be opened again; infinite when that waits for something else."""

    @property
    def is_open(self) -> bool:
        """True while bytes can be sent."""
        return self._state is _State.OPEN

    def start(self) -> list[Action]:
        """Open the port, unless that is under way."""
        if self._state is not _State.STOPPED:
            return []
        self.reason = "opening"
        return self._open()

    def stop(self) -> list[Action]:
        """Close the port for good, unless it is."""
        if self._state is _State.STOPPED:
            return []
        self._state, self.reason, self.open_at = _State.STOPPED, "stopped", math.inf
        return [ClosePort()]

    def opened(self) -> None:
        """The port is ready; that means nothing when nobody waits for it any more."""
        if self._state is _State.OPENING:
            self._state, self.reason, self._pause = _State.OPEN, "", FIRST_PAUSE

    def lost(self, reason: str, now: float) -> None:
        """The port is not there (any more)."""
        if self._state is _State.STOPPED:
            return
        self._state, self.reason = _State.PAUSING, reason
        self.open_at = now + self._pause
        self._pause = min(2 * self._pause, LONGEST_PAUSE)

    def tick(self, now: float) -> list[Action]:
        """Open the port again when the pause is over."""
        return self._open() if self._state is _State.PAUSING and now >= self.open_at else []

    def _open(self) -> list[Action]:
        self._state, self.open_at = _State.OPENING, math.inf
        return [OpenPort()]
