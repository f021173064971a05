"""What the doctor remembers of the last half minute: how often units answered, and what went wrong. Pure.

Answers are counted by the second; everything else is an incident with its moment, of which a bounded number
is kept. A healthy line has none.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

LOOK_BACK = 30
"""Seconds that are remembered."""
INCIDENTS = 512
"""Incidents that are remembered at most."""
ARRIVALS = 192
"""Replies whose moment of arrival is remembered."""
OWED = 16
"""Replies of a unit that are known to be missing, at most."""
LATES = 8
"""Late replies of a unit that are remembered."""
UNHEARD = 4
"""Requests that bring nothing, not even a late reply, after which a unit is no longer late but silent."""
NOBODY = -1
"""The unit of what no unit can be blamed for."""


class Kind(Enum):
    """What went wrong."""

    SILENT = "silent"
    """A request to which nothing came back."""
    GARBLED = "garbled"
    """Something came back, and no valid frame."""
    DOUBLED = "doubled"
    """A second reply to one request, with the same content."""
    CONTRADICTED = "contradicted"
    """A second reply that says something else."""
    REQUEST = "request"
    """A valid request that is not ours."""
    REPLY = "reply"
    """A valid reply to a request that is not ours."""
    NO_ECHO = "no echo"
    """A reply without the echo that the site declares."""
    LATE = "late"
    """The reply to a request of ours that was not waited for any more."""
    STRAY = "stray"
    """Bytes out of nowhere that are no frame."""


class Incident(NamedTuple):
    """Something went wrong with a unit. Of garbled replies: ``like`` the reply that was due in its first
    bytes, ``long``: longer than it."""

    at: float
    unit: int
    kind: Kind
    like: bool = False
    long: bool = False


class Arrival(NamedTuple):
    """When a reply was complete, how long after its request, and how long its bytes took on the wire."""

    unit: int
    at: float
    after: float
    duration: float


class Seconds:
    """Counts by the second."""

    def __init__(self) -> None:
        self._counts = [0] * LOOK_BACK
        self._newest = 0

    def add(self, now: float) -> None:
        """One more."""
        second = int(now)
        if second != self._newest:
            self._turn(second)
        self._counts[second % LOOK_BACK] += 1

    def since(self, began: float, now: float) -> int:
        """How many there were from the second of a moment on."""
        second = int(now)
        if second != self._newest:
            self._turn(second)
        first = max(int(began) if began > 0 else 0, second - LOOK_BACK + 1)
        return sum(self._counts[at % LOOK_BACK] for at in range(first, second + 1))

    def _turn(self, second: int) -> None:
        for passed in range(max(self._newest + 1, second - LOOK_BACK + 1), second + 1):
            self._counts[passed % LOOK_BACK] = 0
        self._newest = second


class Owed(NamedTuple):
    """A reply that may still come late: when its request ended, and its length on the wire."""

    ended: float
    size: int


@dataclass(slots=True)
class UnitChart:
    """One unit, since the port was opened. ``misses``: requests without an answer since the last answer."""

    answers: Seconds = field(default_factory=Seconds)
    answered_at: float = -math.inf
    missed_at: float = -math.inf
    down_at: float = -math.inf
    misses: int = 0
    owed: deque[Owed] = field(default_factory=lambda: deque(maxlen=OWED))
    lates: deque[float] = field(default_factory=lambda: deque(maxlen=LATES))
    """Seconds that late replies took to begin, those since it last answered in the time of its profile."""
    unheard: int = 0
    """Requests since the last late reply that brought none."""


class Chart:
    """All that is remembered of a line."""

    def __init__(self, units: Iterable[int]) -> None:
        self.units = {unit: UnitChart() for unit in units}
        self.echoes = Seconds()
        self.opened_at = -math.inf
        self.answered_at = -math.inf
        """When any unit last gave a valid reply."""
        self.arrivals: deque[Arrival] = deque(maxlen=ARRIVALS)
        self._incidents: deque[Incident] = deque(maxlen=INCIDENTS)

    def open(self, now: float) -> None:
        """The port was opened: what was before tells nothing of now."""
        self.opened_at = now
        self.answered_at = -math.inf
        self.arrivals.clear()
        self._incidents.clear()
        self.echoes = Seconds()
        self.units = {unit: UnitChart() for unit in self.units}

    def answered(self, unit: int, now: float) -> None:
        """A valid reply."""
        chart = self.units[unit]
        chart.answers.add(now)
        chart.answered_at = self.answered_at = now
        chart.misses = 0

    def late(self, unit: int, seconds: float, now: float) -> None:
        """A reply began so long after a request of ours that was not waited for any more."""
        chart = self.units[unit]
        chart.lates.append(seconds)
        chart.unheard = 0
        self._incidents.append(Incident(now, unit, Kind.LATE))

    def missed(self, incident: Incident) -> None:
        """A request was not answered."""
        chart = self.units[incident.unit]
        chart.missed_at = incident.at
        chart.misses += 1
        chart.unheard += 1
        if chart.unheard >= UNHEARD:
            chart.lates.clear()
        self._incidents.append(incident)

    def note(self, incident: Incident) -> None:
        """Something else went wrong."""
        self._incidents.append(incident)

    def incidents(self, since: float, *kinds: Kind) -> Iterator[Incident]:
        """What went wrong after a moment, oldest first."""
        return (one for one in self._incidents if one.at > since and one.kind in kinds)

    def answers(self, since: float, now: float, units: Iterable[int] | None = None) -> int:
        """Valid replies of these units (None: all) from a moment on."""
        chosen = self.units if units is None else units
        return sum(self.units[unit].answers.since(since, now) for unit in chosen)

    def has_echo(self, since: float, now: float) -> bool:
        """What we send comes back, with most answers: now and then another master asks just what we asked."""
        echoes = self.echoes.since(since, now)
        return echoes > 0 and 2 * echoes >= self.answers(since, now)

    def forget(self, now: float) -> None:
        """Let go of what is too old to matter."""
        while self._incidents and self._incidents[0].at <= now - LOOK_BACK:
            self._incidents.popleft()
