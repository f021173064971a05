"""A site on paper: what each of its lines will have to do. Pure.

Planned is for what the default rule of an MQTT section asks and what a drive's watchdog needs: every readable
point that is no parameter, at the period of its class. A client may want more or less; then the core plans
anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gateway.bridge.api import RefusedGap
from gateway.core.drive import Drive, is_polled
from gateway.core.gaps import Gaps
from gateway.core.lines import settings_of
from gateway.core.polling import FASTEST, Polling
from gateway.line.forecast import Forecast, Setup, forecast
from gateway.line.interface import Block, UnitFacts, Want
from gateway.line.repairs import Repair, repairs
from gateway.line.requests import without
from gateway.mapping.profile import Kind
from gateway.mapping.site import LineConfig, Site
from gateway.tag import Instant

WATCHER = "plan"


@dataclass(frozen=True, slots=True)
class LinePlan:
    """What a line will do, and what to change where that is not enough."""

    line: LineConfig
    forecast: Forecast
    repairs: tuple[Repair, ...]
    gaps: tuple[RefusedGap, ...] = ()
    """What its drives turned out not to let themselves be read across; the plan respects it."""

    @property
    def mute(self) -> tuple[str, ...]:
        """The drives that do not speak at the line's speed."""
        if self.line.framing == "tcp":
            return ()
        drives = self.line.drives
        return tuple(d.name for d in drives if self.line.baud not in d.profile.serial.baud)

    def drive(self, unit: int) -> str:
        """The name of the drive at a unit address."""
        return next(drive.name for drive in self.line.drives if drive.unit == unit)

    def points(self, block: Block) -> list[str]:
        """The points that a read brings, in the order of the profile."""
        config = next(drive for drive in self.line.drives if drive.unit == block.unit)
        return [point.name for point in Drive(config).points_in(block.address, block.count)]


def line_plans(site: Site, turnaround: float | None = None, known: Gaps | None = None) -> list[LinePlan]:
    """The plan of every line. ``turnaround`` is how many seconds each drive is taken to need before it
    replies; None: what its profile says is usual. ``known`` is what a gateway found out before."""
    plans = []
    for line in site.lines:
        gaps = [gap for config in line.drives for gap in (known or Gaps()).of(Drive(config))]
        setup = setup_of(site, line, turnaround, gaps)
        plans.append(LinePlan(line, forecast(setup), tuple(repairs(setup)), tuple(gaps)))
    return plans


def setup_of(
    site: Site, line: LineConfig, turnaround: float | None = None, gaps: Sequence[RefusedGap] = ()
) -> Setup:
    """A line and its default demand, for the planner."""
    drives = [Drive(config) for config in line.drives]
    losses = {config.unit: config.profile.serial.comm_loss.after for config in line.drives}
    return Setup(
        settings=settings_of(line),
        units=tuple(_without(drive.facts, gaps) for drive in drives),
        wants=_by_class(_wants(drives, line.name, site.rates, gaps), site.rates),
        bauds=_common_bauds(line),
        comm_loss={unit: after for unit, after in losses.items() if after is not None},
        turnaround=turnaround,
    )


def _without(facts: UnitFacts, gaps: Sequence[RefusedGap]) -> UnitFacts:
    """The facts of a unit that is not read across these gaps, as far as they are its own."""
    return without(facts, tuple((gap.first, gap.last) for gap in gaps if gap.unit == facts.unit))


def with_rates(site: Site, rates: Mapping[str, float]) -> Site:
    """The site with other periods (seconds) for some rate classes."""
    return replace(site, rates={**site.rates, **rates})


def with_baud(site: Site, baud: int) -> Site:
    """The site with another speed on all serial lines."""
    lines = [line if line.framing == "tcp" else replace(line, baud=baud) for line in site.lines]
    return replace(site, lines=tuple(lines))


def _wants(
    drives: list[Drive], line: str, rates: Mapping[str, float], gaps: Sequence[RefusedGap]
) -> list[Want]:
    """What the core will have the line read when everything but parameters is watched."""
    polling = Polling(drives, dict(rates), lambda samples: None)
    for drive in drives:
        reasons = {name: gap.text for gap in gaps if gap.drive == drive.name for name in gap.points}
        polling.leave_out(drive, reasons, Instant(0.0, 0))
    polling.demands.change(
        WATCHER,
        {
            drive.tag(point.name): rates[point.rate]
            for drive in drives
            for point in drive.profile.points.values()
            if is_polled(point) and point.kind != Kind.PARAMETER
        },
    )
    return polling.wants(line)


def _by_class(wants: list[Want], rates: Mapping[str, float]) -> dict[str, tuple[Want, ...]]:
    """The wants of each rate class; classes of the same period count as the first of them."""
    names: dict[float, str] = {}
    for name, period in rates.items():
        names.setdefault(max(period, FASTEST), name)
    classes: dict[str, list[Want]] = {}
    for want in wants:
        classes.setdefault(names.get(want.period, f"{want.period:g} s"), []).append(want)
    return {name: tuple(found) for name, found in classes.items()}


def _common_bauds(line: LineConfig) -> tuple[int, ...]:
    """The speeds that all drives of a serial line speak."""
    if line.framing == "tcp" or not line.drives:
        return ()
    spoken = [set(drive.profile.serial.baud) for drive in line.drives]
    return tuple(sorted(set.intersection(*spoken)))
