"""``gateway command``: a command of a drive's profile, and its true outcome."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile, TimeToLive

if TYPE_CHECKING:
    from gateway.tag import Outcome

EXAMPLES = """
gateway command site.yaml fan-1 run_forward frequency=60

gateway command site.yaml fan-1 stop
"""


def command(
    site: SiteFile,
    drive: Annotated[str, typer.Argument(metavar="DRIVE", help="The drive's name.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="The command's name.")],
    args: Annotated[list[str] | None, typer.Argument(metavar="ARG=VALUE")] = None,
    ttl: TimeToLive = 5.0,
    as_json: AsJson = False,
) -> None:
    """Carry out a command of a drive and print what became of it. Exit 1 unless it was confirmed.

    gateway profiles NAME lists the commands that a drive has.
    """
    from gateway.terminal.connect import run
    from gateway.terminal.output import finish

    asked = " ".join([drive, name, *(args or ())])
    finish(asked, run(_command(site, drive, name, args or (), ttl)), as_json)


async def _command(path: Path, drive: str, name: str, words: Sequence[str], ttl: float) -> Outcome:
    from gateway.terminal.connect import local_origin, open_bridge
    from gateway.terminal.sites import load, refuse_absent
    from gateway.terminal.words import arguments, find_command, find_drive

    loaded = load(path)
    refuse_absent(loaded, drive, name)
    async with open_bridge(loaded) as bridge:
        args = arguments(find_command(find_drive(bridge.catalogue, drive), name), words)
        return await bridge.command(drive, name, args, local_origin(), ttl)
