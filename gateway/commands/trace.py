"""``gateway trace``: the last frames of a line, as bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.bridge.api import Frame

EXAMPLES = """
gateway trace site.yaml north
"""


def trace(
    site: SiteFile,
    line: Annotated[str, typer.Argument(metavar="LINE", help="The line's name.")],
    as_json: AsJson = False,
) -> None:
    """Print the last frames of a line of the running gateway: >> sent, << received."""
    from gateway.terminal.connect import run
    from gateway.terminal.output import say, say_json

    for frame in run(_trace(site, line)):
        if as_json:
            say_json(_frame_object(frame))
        else:
            say(_frame_line(frame))


async def _trace(path: Path, line: str) -> Sequence[Frame]:
    from gateway.terminal.connect import running_bridge
    from gateway.terminal.sites import chosen_lines, load

    site = load(path)
    chosen_lines(site, [line])
    async with running_bridge(site) as bridge:
        return await bridge.trace(line)


def _frame_line(frame: Frame) -> str:
    from gateway.terminal.output import moment

    note = f"  {frame.note}" if frame.note else ""
    return f"{moment(frame.time)}  {'>>' if frame.sent else '<<'} {frame.data.hex(' ').upper()}{note}"


def _frame_object(frame: Frame) -> dict[str, object]:
    from gateway.terminal.output import moment

    return {
        "time": moment(frame.time),
        "sent": frame.sent,
        "data": frame.data.hex(" ").upper(),
        "note": frame.note,
    }
