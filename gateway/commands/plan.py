"""``gateway plan``: which reads the monitored points cost, and whether the line can hold them."""

from __future__ import annotations

from typing import Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

EXAMPLES = """
gateway plan site.yaml

gateway plan site.yaml --what-if baud=38400 --what-if rates.fast=500ms
"""


def plan(
    site: SiteFile,
    what_if: Annotated[
        list[str] | None,
        typer.Option(
            "--what-if", metavar="KEY=VALUE", help="Plan with another baud, reply, or rates.<class>."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show how each line is read when everything but parameters is wanted at its own rate.

    Nothing is opened. Exit 1 if a line cannot hold the periods, or a drive would take it for dead.
    """
    from gateway.core.planning import LinePlan, line_plans
    from gateway.terminal.learned import learned_gaps
    from gateway.terminal.output import console, say, say_json
    from gateway.terminal.planning import plan_head, plan_notes, plan_object, plan_table
    from gateway.terminal.sites import load
    from gateway.terminal.whatif import what_if as changed_by

    def show(found: LinePlan) -> None:
        say(plan_head(found))
        console().print(plan_table(found))
        say("\n".join(f"  {note}" for note in plan_notes(found)))

    changed = changed_by(load(site, warn=True), what_if or ())
    plans = line_plans(changed.site, changed.turnaround, learned_gaps(changed.site))
    for found in plans:
        if as_json:
            say_json(plan_object(found))
        else:
            show(found)
    if not all(found.forecast.fits for found in plans):
        raise typer.Exit(1)
