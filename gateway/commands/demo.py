"""``gateway demo``: a simulated drive on OPC UA and MQTT, in one command."""

from __future__ import annotations

import asyncio
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from gateway.demo import Demo
    from gateway.mapping.site import Site
    from gateway.supervisor import Supervisor
    from gateway.terminal.board import Board

EXAMPLES = """
gateway demo

gateway demo --dir my-demo
"""

LINE_EVERY = 2.0
"""Seconds between two lines of values where there is no terminal."""

READY_WITHIN = 30.0


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
    from gateway.demo import prepare
    from gateway.supervise.keeper import StartRefusedError
    from gateway.terminal.errors import CommandError

    with _place(folder) as place:
        try:
            asyncio.run(_run(prepare(place), place / "gateway.log", seconds))
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


async def _run(demo: Demo, log: Path, seconds: float | None) -> None:
    from gateway.log import configure
    from gateway.supervisor import Supervisor, run_until_signal
    from gateway.terminal.output import say

    with log.open("a", encoding="utf-8") as file:
        configure("supervisor", stream=file)
        supervisor = Supervisor(demo.site, log=file.fileno())
        if seconds is not None:
            asyncio.get_running_loop().call_later(seconds, supervisor.stop)
        viewer = asyncio.create_task(_view(demo, supervisor, log))
        try:
            await run_until_signal(supervisor)
        finally:
            viewer.cancel()
            await asyncio.gather(viewer, return_exceptions=True)
    say("The demo has ended; everything that it started is gone.")


async def _view(demo: Demo, supervisor: Supervisor, log: Path) -> None:
    """Say where everything is as soon as it answers, then show values."""
    from gateway.demo import banner, listening
    from gateway.terminal.output import say

    say("Starting...")
    try:
        async with asyncio.timeout(READY_WITHIN):
            await supervisor.ready.wait()
            await listening(demo.endpoint, *([supervisor.broker.address] if supervisor.broker else []))
    except TimeoutError:
        say(f"Not everything has started after {READY_WITHIN:g} s; see {log}")
    for line in banner(demo, supervisor, log, _program()):
        say(line)
    while True:
        await supervisor.core.up.wait()
        await _show(demo.site)


async def _show(site: Site) -> None:
    """Show values until the core goes away."""
    from gateway.bridge.api import BridgeError
    from gateway.commands.watch import follow, show_table
    from gateway.demo import DRIVE, POINTS
    from gateway.terminal.board import Board
    from gateway.terminal.connect import running_bridge
    from gateway.terminal.errors import CommandError
    from gateway.terminal.words import points_by_tag

    try:
        async with running_bridge(site) as bridge:
            points = points_by_tag(bridge.catalogue)
            tags = [tag for tag in (f"{DRIVE}.{name}" for name in POINTS) if tag in points]
            board, samples = Board(points, tags), follow(bridge, tags)
            if sys.stdout.isatty():
                await show_table(board, samples)
            lines = asyncio.create_task(_lines(board))
            try:
                async for batch in samples:
                    board.take(batch)
            finally:
                lines.cancel()
    except (BridgeError, CommandError):
        await asyncio.sleep(0.2)  # the supervisor starts the core again


async def _lines(board: Board) -> None:
    from gateway.terminal.output import say

    while True:
        await asyncio.sleep(LINE_EVERY)
        say(board.line())


def _program() -> str:
    """How this gateway was called, for use in another terminal of the same folder."""
    called = Path(sys.argv[0])
    if called.name == "__main__.py":
        return "python -m gateway"
    return os.path.relpath(called) if called.is_file() else "gateway"
