"""What the gateway's own tags tell: the counters of lines and drives. Pure."""

from __future__ import annotations

from gateway.core.health import Wellbeing
from gateway.core.lines import Lines
from gateway.core.own import OwnTags, Tell
from gateway.line.line import Line
from gateway.mapping.own import OF_A_LINE, OF_THE_GATEWAY
from gateway.tag import GATEWAY, own_name


def register(own: OwnTags, lines: Lines, health: Wellbeing) -> None:
    """Make everything that is known of the lines and of the gateway tags."""
    for name in lines.names:
        line = lines.get(name)
        assert line is not None
        own.register(own_name(name), OF_A_LINE, _line_values(line))
    own.register(GATEWAY, OF_THE_GATEWAY, {"uptime": health.uptime, "journal": lambda now: health.journal})


def _line_values(line: Line) -> dict[str, Tell]:
    count = line.counters
    return {
        "utilisation": lambda now: 100.0 * line.utilisation(now),
        "requests": lambda now: count.requests,
        "answered": lambda now: count.answered,
        "refused": lambda now: count.refused,
        "timeouts": lambda now: count.timeouts,
        "damaged": lambda now: count.damaged,
    }
