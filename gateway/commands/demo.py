"""``gateway demo``: a simulated drive on OPC UA and MQTT, in one command."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """
gateway demo

gateway demo --dir my-demo
"""


def demo(
    seconds: Annotated[
        float | None, typer.Option("--for", metavar="SECONDS", help="End by itself.", show_default=False)
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option("--dir", metavar="DIR", help="Keep everything there; default: a temporary folder."),
    ] = None,
) -> None:
    """Run a simulated drive, an OPC UA server and a broker on this machine, and show live values."""
    import asyncio

    from gateway.demo.show import run_demo
    from gateway.demo.site import prepare
    from gateway.supervise.keeper import StartRefusedError
    from gateway.terminal.errors import CommandError

    with _place(folder) as place:
        try:
            asyncio.run(run_demo(prepare(place), place / "gateway.log", seconds))
        except (StartRefusedError, OSError) as error:
            raise CommandError(f"the demo cannot run: {error}") from error


@contextmanager
def _place(folder: Path | None) -> Iterator[Path]:
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        yield folder.resolve()
        return
    temporary = Path(tempfile.mkdtemp(prefix="gateway-demo-"))
    try:
        yield temporary
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
