"""Profiles as plain data for programs (the shape stands in docs/cli.md), and as lines for people."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from gateway.mapping.profile import Command, Encoding, Point, Profile, Provenance


def profile_object(profile: Profile) -> dict[str, Any]:
    """A profile with every point and command."""
    return {
        "name": profile.name,
        "title": profile.title,
        "maker": profile.maker,
        "models": list(profile.models),
        "version": profile.version,
        "documents": {name: document.title for name, document in profile.documents.items()},
        "points": [point_object(point) for point in profile.points.values()],
        "commands": [command_object(command) for command in profile.commands.values()],
    }


def point_object(point: Point) -> dict[str, Any]:
    """A point: where it is, what it means, how it may be written, and how far that may be believed."""
    encoding = point.encoding
    return {
        "name": point.name,
        "group": point.group,
        "kind": point.kind,
        "registers": [f"{point.address + index:04X}H" for index in range(point.words)],
        "table": point.table,
        "notation": point.notation,
        "bits": _bits(encoding),
        "type": encoding.type,
        "value_type": encoding.value_type,
        "scale": _number(encoding.scale),
        "offset": _number(encoding.offset),
        "times": encoding.times,
        "unit": encoding.symbol,
        "values": {str(raw): name for raw, name in encoding.values.items()},
        "range": [_bound(point.limits.low), _bound(point.limits.high)] if point.limits else None,
        "access": point.access,
        "role": point.role,
        "by_command_only": point.by_command_only,
        "rate": point.rate,
        "help": point.help,
        **_provenance(point.provenance),
    }


def command_object(command: Command) -> dict[str, Any]:
    """A command: its arguments with the points that lend them type, unit and limits."""
    return {
        "name": command.name,
        "args": dict(command.args),
        "role": command.role,
        "urgent": command.urgent,
        "help": command.help,
        **_provenance(command.provenance),
    }


def point_row(point: Point) -> tuple[str, ...]:
    """A point for people: name, register, type, unit, access, rate, doubt."""
    low_high = _bits(point.encoding)
    bits = (
        ""
        if low_high is None
        else f".{low_high[0]}" + (f"-{low_high[1]}" if low_high[1] > low_high[0] else "")
    )
    return (
        point.name,
        f"{point.notation or f'{point.address:04X}H'}{bits}",
        point.encoding.type,
        point.encoding.symbol or "",
        point.access,
        point.rate,
        point.provenance.doubt or "",
    )


def _bits(encoding: Encoding) -> list[int] | None:
    """First and last bit of a field; None when the whole register is meant."""
    return [encoding.bit, encoding.bit + encoding.width - 1] if encoding.width else None


def _number(value: Fraction) -> int | float:
    return int(value) if value.denominator == 1 else float(value)


def _bound(value: Fraction | str) -> int | float | str:
    return value if isinstance(value, str) else _number(value)


def _provenance(provenance: Provenance) -> Mapping[str, Any]:
    source = f"{provenance.document} {provenance.place}".strip()
    return {"source": source, "similar_model": provenance.similar, "doubt": provenance.doubt}
