"""No point may need itself: neither its scale, nor its meaning, nor whether it is there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gateway.mapping.finding import Report
from gateway.mapping.inherit import Inherited
from gateway.mapping.profile import Point

Leaning = Mapping[str, Mapping[str, str]]
"""Point to the points that it leans on, each with the key that says so."""


def check_circles(points: Mapping[str, Point], keys: Mapping[str, Inherited], report: Report) -> None:
    """Complain about each circle of points that depend on themselves, be it by way of others."""
    leaning = {point.name: dict(_needs(point)) for point in points.values()}
    told: set[frozenset[str]] = set()
    for name in points:
        way = _way_back(name, leaning)
        if way and frozenset(way) not in told:
            told.add(frozenset(way))
            chain = " needs ".join(f"`{each}`" for each in [name, *way])
            place = keys[name].place(leaning[name][way[0]])
            report.error(place, f"{chain}: a circle", "break it")


def _needs(point: Point) -> Iterator[tuple[str, str]]:
    """The names that a point leans on, and the key that names them."""
    for term in point.when:
        yield term.name, "when"
    for case in point.cases:
        for name in (*(term.name for term in case.when), case.encoding.times):
            if name is not None:
                yield name, "cases"
    if point.encoding.times is not None and not point.cases:
        yield point.encoding.times, "times"
    for name in point.select:
        yield name, "select"


def _way_back(start: str, leaning: Leaning) -> list[str]:
    """The shortest way from a point over others back to it; empty when there is none."""
    ways = [[name] for name in leaning[start]]
    seen: set[str] = set()
    while ways:
        way = ways.pop(0)
        if way[-1] == start:
            return way
        if way[-1] not in seen:
            seen.add(way[-1])
            ways += [[*way, name] for name in leaning.get(way[-1], ())]
    return []
