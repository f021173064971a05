"""How the core is doing, for whoever asks. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from gateway.bridge.api import Frame, Health, LineHealth
from gateway.core.alarms import Alarms
from gateway.core.clients import Clients
from gateway.core.lines import Lines
from gateway.core.polling import wall_of
from gateway.core.trail import Trail
from gateway.core.watch import Watchkeeper
from gateway.mapping.site import LineConfig
from gateway.tag import Instant


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

    def line_up(self, line: str) -> None:
        """The port of a line is open."""
        self._down.pop(line, None)

    def line_down(self, line: str, reason: str) -> None:
        """The port of a line is gone."""
        self._down[line] = reason

    def uptime(self, now: float) -> float:
        """Seconds since the core was started."""
        return now - self.started.mono

    def report(self, now: Instant) -> Health:
        """The state of everything."""
        return Health(
            started=self.started.wall,
            lines=tuple(self._line(config, now.mono) for config in self._configs),
            drives=self._watchkeeper.up(),
            sessions=tuple(self._clients.names()),
            journal=self.journal,
            alarms=self._alarms.standing(),
        )

    def trace(self, name: str, now: Instant) -> tuple[Frame, ...] | None:
        """The last frames of a line, None when there is no such line."""
        line = self._lines.get(name)
        if line is None:
            return None
        return tuple(Frame(wall_of(at, now), sent, data, note) for at, sent, data, note in line.trace)

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
