"""How the core is doing, for whoever asks. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from gateway.bridge.api import Diagnosis, Frame, Health, LineHealth, RefusedGap, TracePage
from gateway.core.alarms import Alarms
from gateway.core.clients import Clients
from gateway.core.lines import Lines
from gateway.core.polling import wall_of
from gateway.core.trail import Trail
from gateway.core.watch import Watchkeeper
from gateway.mapping.site import LineConfig
from gateway.tag import Instant

PAGE = 200
"""Frames that are told at once: less than a millisecond of work, so that no line waits for it."""
CLOCK_STEP = 1_000_000
"""Nanoseconds by which the wall clock must have been set before frames of the past get other times: else
each frame has one time, whenever it is asked for."""


class Wellbeing:
    """Reports of health."""

    def __init__(
        self,
        configs: Sequence[LineConfig],
        lines: Lines,
        clients: Clients,
        watchkeeper: Watchkeeper,
        alarms: Alarms,
        trail: Trail,
    ) -> None:
        self.started = Instant(0.0, 0)
        self._clock = self.started
        self._trail = trail
        self._configs = configs
        self._lines = lines
        self._clients = clients
        self._watchkeeper = watchkeeper
        self._alarms = alarms
        self._down: dict[str, str] = {config.name: "not open yet" for config in configs}

    @property
    def journal(self) -> str:
        """Why the journal cannot be written; "" if it can."""
        return self._trail.problem

    def start(self, now: Instant) -> None:
        """The core begins."""
        self.started = self._clock = now

    def line_up(self, line: str) -> None:
        """The port of a line is open."""
        self._down.pop(line, None)

    def line_down(self, line: str, reason: str) -> None:
        """The port of a line is gone."""
        self._down[line] = reason

    def uptime(self, now: float) -> float:
        """Seconds since the core was started."""
        return now - self.started.mono

    def report(self, diagnoses: tuple[Diagnosis, ...], gaps: tuple[RefusedGap, ...], now: Instant) -> Health:
        """The state of everything, with what is wrong with lines and what drives refuse to be read across."""
        return Health(
            started=self.started.wall,
            lines=tuple(self._line(config, now.mono) for config in self._configs),
            drives=self._watchkeeper.up(),
            sessions=tuple(self._clients.names()),
            journal=self.journal,
            alarms=self._alarms.standing(),
            gaps=gaps,
            diagnoses=diagnoses,
        )

    def trace(self, name: str, after: int, now: Instant) -> TracePage | None:
        """Frames of a line behind a number, None when there is no such line."""
        line = self._lines.get(name)
        if line is None:
            return None
        if abs(wall_of(self._clock.mono, now) - self._clock.wall) > CLOCK_STEP:
            self._clock = now
        line.trace.settle(now.mono)
        first, traced = line.trace.page(after, PAGE)
        frames = (
            Frame(_exact(wall_of(at, self._clock)), sent, data, note) for at, sent, data, note in traced
        )
        return TracePage(first, tuple(frames), line.trace.last)

    def _line(self, config: LineConfig, mono: float) -> LineHealth:
        line = self._lines.get(config.name)
        assert line is not None
        count = line.counters
        return LineHealth(
            name=config.name,
            port=config.port,
            up=config.name not in self._down,
            reason=self._down.get(config.name, ""),
            requests=count.requests,
            answered=count.answered,
            refused=count.refused,
            timeouts=count.timeouts,
            damaged=count.damaged,
            utilisation=line.utilisation(mono),
        )


def _exact(time: int) -> int:
    """Nanoseconds cut to microseconds: more than that is not known of a wire."""
    return time // 1000 * 1000
