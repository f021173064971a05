"""``gateway write``: one value to one drive, and its true outcome."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gateway.terminal.options import AsJson, Confirm, Hold, SiteFile, TimeToLive

EXAMPLES = """
gateway write site.yaml fan-1.frequency_command=30

gateway write site.yaml fan-1.run_source=line --json
"""


def write(
    site: SiteFile,
    assignment: Annotated[
        str,
        typer.Argument(
            metavar="TAG=VALUE", help="Enumerations by name or number, named codes (switched_off) by name."
        ),
    ],
    ttl: TimeToLive = 5.0,
    confirm: Confirm = "",
    hold: Hold = False,
    as_json: AsJson = False,
) -> None:
    """Write one value and print what became of it. Exit 1 unless it was confirmed by reading back.

    As for gateway command, the lease of the drive is released when it is done; --hold stays instead.
    """
    from gateway.terminal.connect import run

    run(_write(site, assignment, ttl, confirm, hold, as_json))


async def _write(path: Path, assignment: str, ttl: float, confirm: str, hold: bool, as_json: bool) -> None:
    from gateway.tag import split_tag
    from gateway.terminal.connect import local_origin, open_bridge
    from gateway.terminal.leasing import finish_under, hand_on
    from gateway.terminal.sites import load
    from gateway.terminal.words import as_meant, drive_named, points_by_tag, split

    tag, text = split(assignment)
    async with open_bridge(load(path)) as bridge:
        point = points_by_tag(bridge.catalogue).get(tag)
        value = as_meant(text, point.type, point.values) if point else text
        origin = local_origin()
        hand = hand_on(bridge, drive_named(bridge.catalogue, split_tag(tag)[0]), origin, hold)
        await finish_under(
            hand,
            assignment,
            lambda: bridge.write(tag, value, origin, ttl, confirm=confirm),
            hold,
            as_json,
            point,
        )
