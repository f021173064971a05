"""``gateway doctor``: what is wrong with the lines, and how they get on with their drives."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.terminal.doctoring import Visit

EXAMPLES = """
gateway doctor site.yaml

gateway doctor site.yaml --for 60 --json
"""


def doctor(
    site: SiteFile,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--for",
            metavar="SECONDS",
            min=0,
            help="Look so long.",
            show_default="12; none with a running gateway",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Say what is wrong with each line in plain words, with numbers and a remedy.

    Asks the running gateway; without one it opens the lines itself and reads everything that is monitored.
    Nothing is written. Exit 1 if there is an error or a warning.
    """
    from gateway.terminal.connect import run
    from gateway.terminal.doctoring import show, visit_object
    from gateway.terminal.output import say_json

    visits = run(_visit(site, seconds))
    for visit in visits:
        if as_json:
            say_json(visit_object(visit))
        else:
            show(visit)
    if any(visit.ill for visit in visits):
        raise typer.Exit(1)


async def _visit(path: Path, seconds: float | None) -> list[Visit]:
    from gateway.bridge.place import running
    from gateway.terminal.connect import open_bridge
    from gateway.terminal.doctoring import LOOK, look, visits
    from gateway.terminal.sites import load

    site = load(path)
    patience = seconds if seconds is not None else 0.0 if running(site.data) else LOOK
    async with open_bridge(site) as bridge:
        await look(bridge, patience)
        return await visits(site, bridge)
