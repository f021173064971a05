"""What its plan says against a site, as findings beside those of its file."""

from __future__ import annotations

from gateway.core.planning import LinePlan, setup_of
from gateway.line.forecast import Setup, forecast
from gateway.line.repairs import repairs
from gateway.mapping.finding import Finding, Report
from gateway.mapping.node import Node
from gateway.mapping.reader import read
from gateway.mapping.site import Site
from gateway.terminal.planning import repair_text


def judged(site: Site) -> list[Finding]:
    """Warnings about a site that loads: drives that will take their line for dead."""
    root, _ = read(site.path.read_bytes(), str(site.path))
    report = Report(str(site.path), root or Node(1, 1, {}))
    for line in site.lines:
        setup = setup_of(site, line)
        plan = LinePlan(line, forecast(setup), ())
        if message := _late(plan):
            report.warn(("lines", line.name), message, _remedy(plan, setup), key=True)
    return report.findings


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


def _remedy(plan: LinePlan, setup: Setup) -> str:
    """The cheapest change that is enough, in the words of the plan."""
    if not all(watchdog.possible for watchdog in plan.forecast.watchdogs):
        return "raise the speed, or split the line"
    best = next((repair for repair in repairs(setup) if repair.forecast.fits), None)
    return repair_text(plan, best) if best else "read less of it, or less often"
