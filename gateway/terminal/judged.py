"""What its plan and this version say against a site, as findings beside those of its file."""

from __future__ import annotations

from gateway.core.planning import LinePlan, line_plans
from gateway.mapping.absent import NOT_SENT
from gateway.mapping.finding import Finding, Report, some
from gateway.mapping.node import Node
from gateway.mapping.reader import read
from gateway.mapping.site import Site
from gateway.terminal.planning import repair_text


def judged(site: Site) -> list[Finding]:
    """Warnings about a site that loads: drives that will take their line for dead, and commands of profiles
    that this version does not send."""
    root, _ = read(site.path.read_bytes(), str(site.path))
    report = Report(str(site.path), root or Node(1, 1, {}))
    for plan in line_plans(site):
        if message := _late(plan):
            report.warn(("lines", plan.line.name), message, _remedy(plan), key=True)
    first = {drive.profile.name: drive for drive in reversed(site.drives)}
    for drive in first.values():
        if drive.profile.broadcast is not None and drive.profile.broadcast.commands:
            place = ("lines", drive.line, "drives", drive.name, "profile")
            names = some(list(drive.profile.broadcast.commands))
            message = f"{names} of `{drive.profile.name}` cannot be used: {_WHY}"
            report.warn(place, message, "command each drive by itself")
    return report.findings


_WHY = NOT_SENT.replace("it goes", "they go")
"""Why no command of a broadcast layout can be used."""


def _late(plan: LinePlan) -> str:
    """Which drives are not asked in time; empty when all are."""
    late = [watchdog for watchdog in plan.forecast.watchdogs if not watchdog.fed]
    if not late:
        return ""
    first = min(late, key=lambda watchdog: watchdog.after)
    drives = len(plan.line.drives)
    if not first.possible:
        return (
            f"{drives} drives cannot all be spoken to before the first of them takes the line for dead; "
            f"{first.fitting} can"
        )
    return (
        f"`{plan.drive(first.unit)}` takes the line for dead after {first.after:g} s, and with everything "
        f"monitored it is asked every {first.planned:.2f} s at the latest"
    )


def _remedy(plan: LinePlan) -> str:
    """The cheapest change that is enough, in the words of the plan."""
    possible = all(watchdog.possible for watchdog in plan.forecast.watchdogs)
    best = next((repair for repair in plan.repairs if repair.forecast.fits), None)
    return repair_text(plan, best) if best and possible else "raise the speed, or split the line"
