"""``gateway maintenance``: somebody works on a drive, so that only a stop is let through."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.tag import Outcome

EXAMPLES = """
gateway maintenance site.yaml fan-1 on --reason "bearing is changed"

gateway maintenance site.yaml fan-1 off
"""


def maintenance(
    site: SiteFile,
    drive: Annotated[str, typer.Argument(metavar="DRIVE", help="The drive's name.")],
    switch: Annotated[str, typer.Argument(metavar="on|off")],
    reason: Annotated[str, typer.Option("--reason", help="Shown to whoever is refused.")] = "",
    as_json: AsJson = False,
) -> None:
    """Switch a drive into maintenance or out of it. It outlives restarts. No lock: the drive's supply and its
    panel know nothing of it.
    """
    from gateway.terminal.connect import run
    from gateway.terminal.errors import UsageError
    from gateway.terminal.output import finish

    if switch not in ("on", "off"):
        raise UsageError("say on or off")
    outcome = run(_maintain(site, drive, switch == "on", reason))
    finish(f"{drive} maintenance {switch}", outcome, as_json)


async def _maintain(path: Path, drive: str, on: bool, reason: str) -> Outcome:
    from gateway.terminal.connect import local_origin, open_bridge
    from gateway.terminal.sites import load
    from gateway.terminal.words import find_drive

    async with open_bridge(load(path)) as bridge:
        found = find_drive(bridge.catalogue, drive)
        return await bridge.maintain(found.name, on, local_origin(), reason)
