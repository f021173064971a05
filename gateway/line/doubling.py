"""Is a unit one drive? Two drives with one address answer each request twice, and so does a line that repeats
frames.

A serial line numbers nothing: the second answer to one request looks like the answer to the next one. So the
line listens for a moment behind the first answer of a unit, before anything else is asked. A unit that was
heard once too often is not read for a while, nothing that it says of its registers is believed, and then the
line listens behind it again. Pure.
"""

from __future__ import annotations

import math
from enum import Enum

USUAL = 32
"""So many replies in time show that the line is as fast as is configured: none can be there sooner."""
MOST = 1024


class _State(Enum):
    NEW = "nothing was heard of it yet"
    ONE = "it answers once"
    DOUBTFUL = "it was heard once too often"
    LISTENING = "after that it answered, and perhaps once only"


class Doubling:
    """How often one unit answers. ``longest`` is the longest time in seconds that it needs: so long it is not
    read when it was heard once too often, until all its answers to what it was asked before are over."""

    def __init__(self, longest: float) -> None:
        self._aside = longest
        self._state = _State.NEW
        self.until = -math.inf
        """It is not read before this instant."""

    @property
    def believed(self) -> bool:
        """False from an answer too many until one came that stayed alone."""
        return self._state in (_State.NEW, _State.ONE)

    @property
    def doubtful(self) -> bool:
        """True until it is asked once more, from ``until`` on."""
        return self._state is _State.DOUBTFUL

    def back(self) -> None:
        """It was silent and is heard again: perhaps there are two now."""
        if self._state is _State.ONE:
            self._state = _State.NEW

    def too_many(self, now: float) -> bool:
        """It gave an answer that nobody waits for. False while that may be one to what was asked before we
        were started."""
        if self._state is _State.NEW:
            return False
        self._state = _State.DOUBTFUL
        self.until = now + self._aside
        return True

    def answered(self, now: float) -> bool:
        """It answered; True when nothing else is to be asked until a second answer would have come."""
        match self._state:
            case _State.NEW:
                self._state = _State.ONE
                return True
            case _State.DOUBTFUL if now >= self.until:
                self._state = _State.LISTENING
                self.until = now + self._aside
                return True
            case _State.LISTENING if now >= self.until:
                self._state = _State.ONE
        return False


class Punctual:
    """Whether a unit's replies come before their bytes can have come behind the request. Behind a device
    server the line may be faster than is configured; where no reply ever was too early, one that is answers
    something older."""

    def __init__(self) -> None:
        self._in_time = 0

    def impossible(self, early: bool) -> bool:
        """True for a reply that is too early, of a unit whose replies are not."""
        if not early:
            self._in_time = min(self._in_time + 1, MOST)
            return False
        sure, self._in_time = self._in_time >= USUAL, self._in_time // 2
        return sure
