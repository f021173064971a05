"""``gateway plan``: which reads the monitored points cost, and whether the line can hold them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.line.interface import Block, Plan
    from gateway.mapping.site import Site

EXAMPLES = """
gateway plan site.yaml
"""


def plan(site: SiteFile, as_json: AsJson = False) -> None:
    """Show how each line is read when everything for monitoring is wanted at its own rate.

    Nothing is opened. Exit 1 if a line cannot hold the periods and has to stretch them.
    """
    from gateway.terminal.output import say, say_json
    from gateway.terminal.sites import load

    plans = _plans(load(site))
    for name, found in plans.items():
        if as_json:
            say_json(_object(name, found))
        else:
            say("\n".join(_lines(name, found)))
    if any(found.stretch > 1 for found in plans.values()):
        raise typer.Exit(1)


def _plans(site: Site) -> dict[str, Plan]:
    """What the core itself plans for a client that watches everything."""
    from gateway import __version__
    from gateway.bridge.messages import Watch
    from gateway.core.core import Core
    from gateway.core.events import Asked, Joined, Started
    from gateway.tag import Instant, Role
    from gateway.terminal.words import points_by_tag, select

    core, now = Core(site, __version__), Instant(0.0, 0)
    points = points_by_tag(core.catalogue)
    wants = {tag: site.rates[points[tag].rate] for tag in select(core.catalogue, ())}
    for event in (Started(), Joined(1, "plan", Role.VIEWER), Asked(1, Watch(1, wants))):
        core.step(event, now)
    return {line.name: core.lines.plan(line.name) for line in site.lines}


def _lines(name: str, plan: Plan) -> list[str]:
    stretched = f", periods stretched {plan.stretch:.2f} times" if plan.stretch > 1 else ""
    head = f"line {name}: {len(plan.blocks)} reads, load {plan.load:.0%}{stretched}"
    return [head, *(f"  {_block_line(block)}" for block in plan.blocks)]


def _block_line(block: Block) -> str:
    last = block.address + block.count - 1
    return (
        f"unit {block.unit:3}  {block.address:04X}H-{last:04X}H  every {block.period:g} s"
        f"  takes {block.cost * 1000:.1f} ms  oldest value {block.worst_age:.2f} s"
    )


def _object(name: str, plan: Plan) -> dict[str, Any]:
    blocks = [
        {
            "unit": block.unit,
            "table": block.table,
            "address": block.address,
            "count": block.count,
            "period": block.period,
            "cost": block.cost,
            "worst_age": block.worst_age,
        }
        for block in plan.blocks
    ]
    return {"line": name, "load": plan.load, "stretch": plan.stretch, "blocks": blocks}
