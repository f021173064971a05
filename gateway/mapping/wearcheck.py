"""The checks of how often points may be written that wear by it."""

from __future__ import annotations

from gateway.mapping.finding import Report
from gateway.mapping.node import Path
from gateway.mapping.shape import closest, nearest
from gateway.mapping.site import DriveConfig, Site

MOST = 1000
"""Writes in a day; whoever needs more has a drive that does not wear, or will not have it long."""


def check_wear(site: Site, report: Report) -> None:
    """Budgets must be such, and for points that wear."""
    _check_budget(site.wear_per_day, ("writes", "wear_per_day"), report)
    for drive in site.drives:
        place = ("lines", drive.line, "drives", drive.name, "wear_per_day")
        for name, budget in drive.wear_per_day.items():
            _check_point(drive, name, (*place, name), report)
            _check_budget(budget, (*place, name), report)


def _check_budget(budget: int, place: Path, report: Report) -> None:
    if not 0 <= budget <= MOST:
        report.error(place, f"{budget} writes in a day are no budget", f"write 0 to {MOST}")


def _check_point(drive: DriveConfig, name: str, place: Path, report: Report) -> None:
    point = drive.profile.points.get(name)
    if point is None:
        worn = [p.name for p in drive.profile.points.values() if p.wear is not None]
        meant = closest(name, list(drive.profile.points))
        spared = meant is not None and meant not in worn
        remedy = f"writing `{meant}` wears nothing: leave it out" if spared else nearest(name, worn)
        report.error(place, f"`{drive.profile.name}` has no point `{name}`", remedy, key=True)
    elif point.wear is None:
        report.error(place, f"writing `{name}` wears nothing", "leave it out", key=True)
