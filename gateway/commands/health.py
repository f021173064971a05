"""``gateway health``: is the gateway running, and how is it doing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.bridge.api import Alarm, Health, LineHealth

EXAMPLES = """
gateway health site.yaml
"""


def health(site: SiteFile, as_json: AsJson = False) -> None:
    """Show how the running gateway is doing. Exit 1 if none answers or its journal cannot be written.

    A line or drive that is down, or an alarm, is shown, but is not the gateway's own illness.
    """
    from gateway.terminal.connect import run
    from gateway.terminal.output import health_object, say, say_json

    found = run(_health(site))
    if as_json:
        say_json(health_object(found))
    else:
        say("\n".join(_lines(found)))
    if found.journal:
        raise typer.Exit(1)


async def _health(path: Path) -> Health:
    from gateway.terminal.connect import running_bridge
    from gateway.terminal.sites import load

    async with running_bridge(load(path)) as bridge:
        return await bridge.health()


def _lines(health: Health) -> list[str]:
    from gateway.terminal.output import moment

    drives = [f"drive {name}: {'up' if up else 'down'}" for name, up in health.drives.items()]
    journal = [f"journal: {health.journal}"] if health.journal else []
    alarms = map(_alarm, health.alarms)
    found = [f"line {one.line}: {one.text} ({one.remedy})" for one in health.diagnoses]
    found += [gap.text for gap in health.gaps]
    return [
        f"up since {moment(health.started)}",
        *map(_line, health.lines),
        *drives,
        *journal,
        *alarms,
        *found,
    ]


def _alarm(alarm: Alarm) -> str:
    from gateway.terminal.output import moment

    seen = f", acknowledged by {alarm.by}" if alarm.acknowledged else ""
    over = ", its cause is gone" if alarm.cleared > alarm.raised else ""
    return f"alarm {alarm.key}: {alarm.text} (since {moment(alarm.raised)}{over}{seen})"


def _line(line: LineHealth) -> str:
    state = "up" if line.up else f"down ({line.reason})"
    return (
        f"line {line.name}: {state}, in use {line.utilisation:.0%}, requests {line.requests}, "
        f"answered {line.answered}, refused {line.refused}, timeouts {line.timeouts}, damaged {line.damaged}"
    )
