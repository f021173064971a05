"""What a client may ask that changes nothing: how things are, who wants what, what was on the wire. Pure."""

from __future__ import annotations

from gateway.bridge.messages import (
    AskControls,
    AskDemand,
    AskHealth,
    AskTrace,
    ControlsAre,
    DemandIs,
    HealthIs,
    Reply,
    TraceIs,
    Wrong,
)
from gateway.core.clients import Clients
from gateway.core.control import Control
from gateway.core.demanded import demand_for
from gateway.core.doctors import Doctors
from gateway.core.gaps import GapWatch
from gateway.core.health import Wellbeing
from gateway.core.lines import Lines
from gateway.core.polling import Polling
from gateway.tag import Instant

Inquiry = AskControls | AskHealth | AskDemand | AskTrace


class Inquiries:
    """Answers them from what the parts of the core know."""

    def __init__(
        self,
        health: Wellbeing,
        doctors: Doctors,
        gaps: GapWatch,
        control: Control,
        polling: Polling,
        lines: Lines,
        clients: Clients,
    ) -> None:
        self._health = health
        self._doctors = doctors
        self._gaps = gaps
        self._control = control
        self._polling = polling
        self._lines = lines
        self._clients = clients

    def answer(self, inquiry: Inquiry, now: Instant) -> Reply:
        """The answer."""
        match inquiry:
            case AskControls(id):
                return ControlsAre(id, tuple(self._control.states()))
            case AskHealth(id):
                return HealthIs(id, self._health.report(self._doctors.standing(), self._gaps.refused(), now))
            case AskDemand(id, tag):
                gaps = self._gaps.refused()
                return DemandIs(id, demand_for(tag, self._polling, self._lines, self._clients, gaps))
            case AskTrace(id, line, after):
                page = self._health.trace(line, after, now)
                return Wrong(id, f"there is no line {line}") if page is None else TraceIs(id, page)
