"""``gateway command``: a command of a drive's profile, and its true outcome."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, Confirm, Hold, SiteFile, TimeToLive

if TYPE_CHECKING:
    from collections.abc import Awaitable

    from gateway.tag import Outcome

STOPS = ("stop", "stop_all")
"""These need no lease."""

EXAMPLES = """
gateway command site.yaml fan-1 run_forward frequency=60

gateway command site.yaml fan-1 stop

gateway command site.yaml north stop_all
"""


def command(  # noqa: PLR0913 - the options of the command line
    site: SiteFile,
    drive: Annotated[str, typer.Argument(metavar="DRIVE", help="A drive; or a line, for all its drives.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="The command's name.")],
    args: Annotated[list[str] | None, typer.Argument(metavar="ARG=VALUE")] = None,
    ttl: TimeToLive = 5.0,
    confirm: Confirm = "",
    hold: Hold = False,
    as_json: AsJson = False,
) -> None:
    """Carry out a command of a drive and print what became of it. Exit 1 unless it was confirmed.

    gateway profiles NAME lists the commands that a drive has. Where the drive needs a lease, the command
    releases it when it is done: what was set running then ends as the site's on_expiry says, unless somebody
    acquires the lease within its ttl. --hold stays instead.
    """
    from gateway.terminal.connect import run

    run(_command(site, drive, name, args or (), ttl, confirm, hold, as_json))


async def _command(  # noqa: PLR0913 - the options of the command line
    path: Path,
    drive: str,
    name: str,
    words: Sequence[str],
    ttl: float,
    confirm: str,
    hold: bool,
    as_json: bool,
) -> None:
    from gateway.terminal.connect import local_origin, open_bridge
    from gateway.terminal.leasing import finish_under, hand_on
    from gateway.terminal.output import finish
    from gateway.terminal.sites import load
    from gateway.terminal.words import arguments, command_named, commanded_named, written_by

    async with open_bridge(load(path)) as bridge:
        found, origin = commanded_named(bridge.catalogue, drive), local_origin()
        args = arguments(command_named(found, name), words)
        asked = " ".join([drive, name, *words])

        def work() -> Awaitable[Outcome]:
            whom = found.name if found else drive
            return bridge.command(whom, name, args, origin, ttl, confirm=confirm)

        if name in STOPS:
            finish(asked, await work(), as_json)
        point = written_by(found, name)
        await finish_under(hand_on(bridge, found, origin, hold), asked, work, hold, as_json, point)
