"""Silences that drives need after a transaction, beside the gap that every frame needs.

A drive that stores a parameter hears nothing for a while. The line then stays silent for everybody, with one
exception: a stop to another drive waits for the gap only. In a pause that is made to listen, every stop does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gateway.line.requests import BROADCAST

LISTEN = 0.1
"""Seconds for which the line listens at most."""
NOBODY = -1
"""For whose sake the line listens: no stop waits for that."""


@dataclass(frozen=True, slots=True)
class _Pause:
    """For whose sake the line is silent until when, and the job that is told at its end."""

    unit: int
    until: float
    job: int | None

    def concerns(self, unit: int) -> bool:
        return self.unit != NOBODY and (BROADCAST in (self.unit, unit) or self.unit == unit)


class Pauses:
    """The pauses that are being kept; times in seconds of the monotonic clock."""

    def __init__(self) -> None:
        self._kept: list[_Pause] = []

    def keep(self, unit: int, until: float, job: int | None = None) -> None:
        """Keep silent for a unit's sake (0: all of them); ``job`` is done when that is over."""
        self._kept.append(_Pause(unit, until, job))

    def listen(self, since: float, seconds: float) -> None:
        """Keep silent for so long, or as long as one may listen, to hear what comes."""
        self.keep(NOBODY, since + min(seconds, LISTEN))

    def until(self) -> float:
        """The instant from which anything may go out."""
        return max((pause.until for pause in self._kept), default=-math.inf)

    def until_for_stop(self, unit: int) -> float:
        """The instant from which a stop may go to a unit: only the pauses that it needs itself count."""
        return max((pause.until for pause in self._kept if pause.concerns(unit)), default=-math.inf)

    def awaited(self) -> float:
        """When the next job is done; infinite when none waits for the end of a pause."""
        return min((pause.until for pause in self._kept if pause.job is not None), default=math.inf)

    def over(self, now: float) -> list[int]:
        """Forget the pauses that have ended; the jobs that are done thereby."""
        if not self._kept:
            return []
        ended = [pause for pause in self._kept if pause.until <= now]
        self._kept = [pause for pause in self._kept if pause.until > now]
        return [pause.job for pause in ended if pause.job is not None]

    def drop(self) -> list[int]:
        """Forget all pauses: the line is gone. The jobs that waited for the end of one."""
        return self.over(math.inf)
