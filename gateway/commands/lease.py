"""``gateway lease``: who may command the drives, and to get hold of one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gateway.bridge.api import ControlState

EXAMPLES = """
gateway lease site.yaml

gateway lease site.yaml fan-1 acquire --hold

gateway lease site.yaml fan-1 take --from anna
"""


def lease(
    site: SiteFile,
    drive: Annotated[str | None, typer.Argument(metavar="DRIVE", help="The drive's name.")] = None,
    act: Annotated[str | None, typer.Argument(metavar="ACT", help="acquire, renew, release or take.")] = None,
    hold: Annotated[bool, typer.Option("--hold", help="Stay and renew it until Ctrl-C.")] = False,
    whom: Annotated[str, typer.Option("--from", metavar="WHO", help="Take it from him only.")] = "",
    as_json: AsJson = False,
) -> None:
    """Tell who may command each drive; or acquire, renew, release or take the lease of one.

    What is acquired belongs to this user of the command line, and ends after its ttl unless it is renewed: by
    commands, by renew, or by --hold. Exit 1 if it is refused.
    """
    from gateway.bridge.api import LeaseAct
    from gateway.terminal.connect import run
    from gateway.terminal.errors import UsageError

    if drive is None:
        for state in run(_states(site)):
            _show(state, as_json)
        return
    if act not in list(LeaseAct):
        raise UsageError(f"say what to do with the lease: {', '.join(LeaseAct)}")
    run(_carry_out(site, drive, LeaseAct(act), whom, hold, as_json))


async def _states(path: Path) -> Sequence[ControlState]:
    from gateway.terminal.connect import running_bridge
    from gateway.terminal.sites import load

    async with running_bridge(load(path)) as bridge:
        return await bridge.controls()


async def _carry_out(path: Path, drive: str, act: Any, whom: str, hold: bool, as_json: bool) -> None:
    from gateway.tag import Verdict
    from gateway.terminal.connect import local_origin, running_bridge
    from gateway.terminal.leasing import Hand
    from gateway.terminal.output import tell
    from gateway.terminal.sites import load
    from gateway.terminal.words import find_drive

    async with running_bridge(load(path)) as bridge:
        found, origin = find_drive(bridge.catalogue, drive), local_origin()
        outcome = await bridge.lease(found.name, act, origin, whom)
        tell(f"{act} {drive}", outcome, as_json)
        held = outcome.verdict is Verdict.CONFIRMED
        if held and hold:
            held = await Hand(bridge, found, origin).hold()
    if not held:
        raise typer.Exit(1)


def _show(state: ControlState, as_json: bool) -> None:
    from gateway.terminal.output import control_line, control_object, say, say_json

    if as_json:
        say_json(control_object(state))
    else:
        say(control_line(state))
