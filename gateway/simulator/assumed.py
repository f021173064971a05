"""What the twin assumes, brought together with the points that this one drive has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gateway.mapping.profile import Point
from gateway.mapping.twin import SHOWN, Simulate


def assumed(points: Mapping[str, Point], facts: Simulate) -> dict[str, Point]:
    """The points, with the units that the twin assumes where the document has none."""
    result = dict(points)
    for name, (scale, symbol) in facts.units.items():
        if name in result:
            encoding = replace(result[name].encoding, scale=scale, symbol=symbol)
            result[name] = replace(result[name], encoding=encoding)
    return result


def fitting(facts: Simulate, points: Mapping[str, Point]) -> Simulate:
    """The facts without those about points that the settings of this drive have left out."""
    known = points.keys() | set(SHOWN)
    external = facts.external_fault
    if external is not None and external.by not in points:
        external = replace(external, by=None)
    return replace(
        facts,
        shows={n: what for n, what in _of(facts.shows, points).items() if known.issuperset(what)},
        codes=_of(facts.codes, points),
        history=tuple(name for name in facts.history if name in points),
        restarts=_of(facts.restarts, points),
        external_fault=external,
        reset=facts.reset if facts.reset in points else None,
        panel_frequency=facts.panel_frequency if facts.panel_frequency in points else None,
    )


def _of(table: Mapping[str, Any], points: Mapping[str, Point]) -> dict[str, Any]:
    return {name: value for name, value in table.items() if name in points}
