"""``gateway write``: one value to one drive, and its true outcome."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile, TimeToLive

if TYPE_CHECKING:
    from gateway.tag import Outcome

EXAMPLES = """
gateway write site.yaml fan-1.frequency_command=30

gateway write site.yaml fan-1.run_source=line --json
"""


def write(
    site: SiteFile,
    assignment: Annotated[str, typer.Argument(metavar="TAG=VALUE", help="Enumerations by name or number.")],
    ttl: TimeToLive = 5.0,
    as_json: AsJson = False,
) -> None:
    """Write one value and print what became of it. Exit 1 unless it was confirmed by reading back."""
    from gateway.terminal.connect import run
    from gateway.terminal.output import finish

    finish(assignment, run(_write(site, assignment, ttl)), as_json)


async def _write(path: Path, assignment: str, ttl: float) -> Outcome:
    from gateway.tag import split_tag
    from gateway.terminal.connect import local_origin, open_bridge
    from gateway.terminal.sites import load, refuse_absent
    from gateway.terminal.words import find_point, read_value, split

    tag, text = split(assignment)
    site = load(path)
    refuse_absent(site, *split_tag(tag))
    async with open_bridge(site) as bridge:
        point = find_point(bridge.catalogue, tag)
        value = read_value(text, point.type, point.values)
        return await bridge.write(tag, value, local_origin(), ttl)
