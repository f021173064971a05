"""The doctor's visit in the terminal: figures of a line and its drives, and what is wrong, in words."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table

from gateway.bridge.api import Bridge, Diagnosis, LineHealth, OwnerInfo
from gateway.mapping.own import CONDITION, DEALINGS, OF_A_LINE
from gateway.mapping.site import LineConfig, Site
from gateway.tag import Value, own_name, split_tag, tag_of
from gateway.terminal.output import console, diagnosis_object, say
from gateway.terminal.words import points_by_tag, select

LOOK = 12.0
"""Seconds that are looked when no gateway was there to look before: every diagnosis is made within ten."""
STEP = 0.25
COUNTS = ("requests", "answered", "refused", "timeouts", "damaged", "retries")
SPREADS = ("p50/p95/max ms", "jitter ms", "oldest/promised")


@dataclass(frozen=True, slots=True)
class Visit:
    """What is known of a line: figures by the name of their tag, of the line and of each drive."""

    config: LineConfig
    health: LineHealth
    figures: Mapping[str, Value]
    drives: Mapping[str, Mapping[str, Value]]
    diagnoses: tuple[Diagnosis, ...]

    @property
    def ill(self) -> bool:
        """True when there is an error or a warning."""
        return any(one.severity != "info" for one in self.diagnoses)


async def look(bridge: Bridge, seconds: float) -> None:
    """Have everything monitored read for so long; a bar on standard error tells how far that is."""
    points, rates = points_by_tag(bridge.catalogue), bridge.catalogue.rates
    if not seconds:
        return
    wants: dict[str, float | None] = {tag: rates[points[tag].rate] for tag in select(bridge.catalogue, ())}
    await bridge.watch(wants)
    on_terminal = Console(stderr=True)
    columns = (TextColumn("looking"), BarColumn())
    with Progress(*columns, console=on_terminal, transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task("", total=seconds)
        for _ in range(max(1, round(seconds / STEP))):
            await asyncio.sleep(STEP)
            bar.advance(task, STEP)
    await bridge.watch(dict.fromkeys(wants))


async def visits(site: Site, bridge: Bridge) -> list[Visit]:
    """What is known of each line of the site."""
    catalogue, health = bridge.catalogue, await bridge.health()
    figures = await _figures(bridge, [*catalogue.drives, *catalogue.lines])
    return [
        Visit(
            config=config,
            health=next(line for line in health.lines if line.name == config.name),
            figures=figures[own_name(config.name)],
            drives={drive.name: figures[drive.name] for drive in config.drives},
            diagnoses=tuple(one for one in health.diagnoses if one.line == config.name),
        )
        for config in site.lines
    ]


async def _figures(bridge: Bridge, owners: list[OwnerInfo]) -> dict[str, dict[str, Value]]:
    names = {*DEALINGS, *OF_A_LINE}.difference(CONDITION)
    points = [(owner.name, point.name) for owner in owners for point in owner.points]
    tags = [tag_of(owner, name) for owner, name in points if name in names]
    found: dict[str, dict[str, Value]] = {owner.name: {} for owner in owners}
    for sample in await bridge.read(tags):
        owner, name = split_tag(sample.tag)
        found[owner][name.removeprefix("_")] = sample.value
    return found


def visit_object(visit: Visit) -> dict[str, Any]:
    """A line for programs; the shape stands in docs/cli.md."""
    return {
        "line": visit.config.name,
        "port": visit.config.port,
        "up": visit.health.up,
        "healthy": not visit.diagnoses,
        "diagnoses": [diagnosis_object(one) for one in visit.diagnoses],
        "figures": visit.figures,
        "drives": visit.drives,
    }


def show(visit: Visit) -> None:
    """A line for people."""
    config, figures = visit.config, visit.figures
    serial = config.framing if config.framing == "tcp" else f"{config.framing} {config.baud} {config.format}"
    use = f"in use {figures['utilisation']:.0f} %" if visit.health.up else "down"
    say(f"line {config.name} ({serial}, {config.port}): {use}, {figures['requests']} requests")
    console().print(_table(visit))
    told = [f"  {one.severity}: {one.text} ({one.remedy})" for one in visit.diagnoses]
    say("\n".join(told) or "  healthy")


def _table(visit: Visit) -> Table:
    table = Table(box=None, header_style="dim", padding=(0, 2, 0, 0))
    for column in ("drive", *COUNTS, *SPREADS):
        table.add_column(column, justify="left" if column == "drive" else "right", no_wrap=True)
    for name, figures in visit.drives.items():
        counts = [str(figures[column]) for column in COUNTS]
        spread = "/".join(_short(figures[f"turnaround_{end}"]) for end in ("p50", "p95", "max"))
        table.add_row(name, *counts, spread, _short(figures["jitter"]), _percent(figures["age_share"]))
    return table


def _short(value: Value) -> str:
    return f"{value:.1f}" if isinstance(value, float) else "-"


def _percent(value: Value) -> str:
    return f"{value:.0f} %" if isinstance(value, float) else "-"
