"""``gateway watch``: samples as they come."""

from __future__ import annotations

from typing import Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

EXAMPLES = """
gateway watch site.yaml

gateway watch site.yaml 'fan-1.output_*' --period 0.2

gateway watch site.yaml --json | jq .value
"""


def watch(
    site: SiteFile,
    tags: Annotated[list[str] | None, typer.Argument(metavar="TAG", help="* and ? match.")] = None,
    period: Annotated[
        float | None, typer.Option(min=0.01, help="Seconds; default: each point's rate.", show_default=False)
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--for", metavar="SECONDS", help="End by itself.", show_default=False)
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Watch tags: a live table in a terminal, else one line for each change.

    Without tags: everything that the drives' profiles have for monitoring.
    """
    from gateway.terminal.connect import run
    from gateway.terminal.watching import watch_site

    run(watch_site(site, tags or (), period, seconds, as_json))
