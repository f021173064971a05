"""``gateway simulate``: virtual drives on ptys, for whoever wants to talk to them."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from gateway.terminal.options import SiteFile

EXAMPLES = """
gateway simulate site.yaml

gateway run site.yaml --line north=/tmp/lines/north
"""


def simulate(
    site: SiteFile,
    folder: Annotated[Path, typer.Option("--dir", metavar="DIR", help="Where to put the links.")] = Path(
        "simulated"
    ),
    line: Annotated[
        list[str] | None, typer.Option("--line", metavar="NAME", help="Only this line; default: all.")
    ] = None,
) -> None:
    """Simulate the drives of every line until Ctrl-C; prints each line's name and the path of its pty.

    The ptys are linked as DIR/NAME. They keep the time that the bytes would take on a real wire.
    """
    from gateway.terminal.sites import chosen_lines, load

    lines = chosen_lines(load(site, warn=True), line or ())
    words = [word for name in lines for word in ("--line", name)]
    argv = [sys.executable, "-m", "gateway.simulator", str(site), "--dir", str(folder), *words]
    os.execv(sys.executable, argv)  # this process becomes the simulator, signals and all
