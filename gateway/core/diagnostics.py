"""What the gateway's own tags tell of lines and of the dealings with drives. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import attrgetter

from gateway.core.drive import Drive
from gateway.core.health import Wellbeing
from gateway.core.lastly import LastOutcomes
from gateway.core.lines import Lines
from gateway.core.own import OwnTags, Tell
from gateway.core.trail import Trail
from gateway.line.doctor.figures import Traffic, UnitFigures
from gateway.line.doctor.histogram import Spread, share_of
from gateway.line.line import Line
from gateway.mapping.own import CONDITION, DEALINGS, OF_A_LINE, OF_THE_GATEWAY
from gateway.tag import GATEWAY, own_name

SHARES = {"p50": 0.5, "p95": 0.95, "max": 1.0}
"""The part of all values that is at most as great, by the end of a tag's name."""
_FROM_LINES = {name: point for name, point in OF_A_LINE.items() if name not in CONDITION}


def register(own: OwnTags, drives: Sequence[Drive], lines: Lines, health: Wellbeing, trail: Trail) -> None:
    """Make everything that is known of lines, drives and the gateway tags."""
    LastOutcomes(drives, own, trail)
    for name in lines.names:
        line = lines.get(name)
        assert line is not None
        own.register(own_name(name), _FROM_LINES, _line_values(line))
        for drive in drives:
            if drive.line == name:
                own.register(drive.name, DEALINGS, _drive_values(line.doctor.units[drive.unit]))
    own.register(GATEWAY, OF_THE_GATEWAY, {"uptime": health.uptime, "journal": lambda now: health.journal})


def _line_values(line: Line) -> dict[str, Tell]:
    count, doctor = line.counters, line.doctor
    units = list(doctor.units.values())

    def total(field: str) -> Tell:
        get: Callable[[Traffic], int] = attrgetter(field)
        return lambda now: sum(get(unit.traffic) for unit in units)

    def received(now: float) -> int:
        return doctor.line.strays + sum(unit.traffic.received_bytes for unit in units)

    def age_share(now: float) -> float | None:
        shares = [share for unit in units if (share := unit.share.get(now)) is not None]
        return 100.0 * max(shares) if shares else None

    return {
        "utilisation": lambda now: 100.0 * line.utilisation(now),
        "load": lambda now: 100.0 * line.plan.load,
        "stretch": lambda now: line.plan.stretch,
        "requests": lambda now: count.requests,
        "answered": lambda now: count.answered,
        "refused": lambda now: count.refused,
        "timeouts": lambda now: count.timeouts,
        "damaged": lambda now: count.damaged,
        "retries": total("retries"),
        "probes": total("probes"),
        "bytes_sent": lambda now: doctor.line.sent,
        "bytes_received": received,
        "stray_bytes": lambda now: doctor.line.strays,
        "gap_violations": lambda now: doctor.line.violations,
        "stray_gap_violations": lambda now: doctor.line.intrusions,
        "age_share": age_share,
        **_turnarounds("turnaround", [unit.turnaround for unit in units]),
    }


def _drive_values(figures: UnitFigures) -> dict[str, Tell]:
    traffic = figures.traffic

    def of_traffic(field: str) -> Tell:
        get: Callable[[Traffic], int] = attrgetter(field)
        return lambda now: get(traffic)

    return {
        "_requests": of_traffic("requests"),
        "_answered": of_traffic("answered"),
        "_refused": of_traffic("refused"),
        "_exceptions": lambda now: _codes(figures),
        "_timeouts": of_traffic("timeouts"),
        "_damaged": of_traffic("damaged"),
        "_retries": of_traffic("retries"),
        "_probes": of_traffic("probes"),
        "_early_replies": of_traffic("early"),
        "_bytes_sent": of_traffic("sent_bytes"),
        "_bytes_received": of_traffic("received_bytes"),
        "_jitter": lambda now: 1000.0 * figures.jitter if traffic.answered else None,
        "_worst_age": figures.age.get,
        "_age_share": lambda now: _times(100.0, figures.share.get(now)),
        **_turnarounds("_turnaround", [figures.turnaround]),
    }


def _turnarounds(name: str, spreads: Sequence[Spread]) -> dict[str, Tell]:
    """Percentiles over all these distributions together, in milliseconds."""

    def at(part: float) -> Tell:
        return lambda now: _times(1000.0, share_of(spreads, part, now))

    return {f"{name}_{end}": at(part) for end, part in SHARES.items()}


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


def _codes(figures: UnitFigures) -> str:
    return ", ".join(f"{code:02X}H: {count}" for code, count in sorted(figures.codes.items()))
