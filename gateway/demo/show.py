"""The demo at work: everything started, its values on the terminal."""

from __future__ import annotations

import asyncio
import os
import sys
from contextlib import closing, suppress
from pathlib import Path
from urllib.parse import urlsplit

from gateway.bridge.api import BridgeError
from gateway.demo.site import DRIVE, POINTS, Demo, banner
from gateway.log import configure
from gateway.mapping.site import Site
from gateway.supervisor import Supervisor, run_until_signal
from gateway.terminal.board import Board
from gateway.terminal.connect import running_bridge
from gateway.terminal.errors import CommandError
from gateway.terminal.output import say
from gateway.terminal.watching import follow, show_table
from gateway.terminal.words import points_by_tag

LINE_EVERY = 2.0
"""Seconds between two lines of values where there is no terminal."""

READY_WITHIN = 30.0


async def run_demo(demo: Demo, log: Path, seconds: float | None) -> None:
    """Run the demo until a signal, or for so many seconds."""
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
            with suppress(asyncio.CancelledError):
                await viewer
    say("The demo has ended; everything that it started is gone.")


async def _view(demo: Demo, supervisor: Supervisor, log: Path) -> None:
    """Say where everything is as soon as it answers, then show values."""
    say("Starting...")
    try:
        async with asyncio.timeout(READY_WITHIN):
            await supervisor.ready.wait()
            await _listening(demo.endpoint, *([supervisor.broker.address] if supervisor.broker else []))
    except TimeoutError:
        say(f"Not everything has started after {READY_WITHIN:g} s; see {log}")
    for line in banner(demo, supervisor, log, _program()):
        say(line)
    while True:
        await supervisor.core.up.wait()
        await _show(demo.site)


async def _show(site: Site) -> None:
    """Show values until the core goes away."""
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
    while True:
        await asyncio.sleep(LINE_EVERY)
        say(board.line())


def _program() -> str:
    """How this gateway was called, for use in another terminal of the same folder."""
    called = Path(sys.argv[0])
    if called.name == "__main__.py":
        return "python -m gateway"
    return os.path.relpath(called) if called.is_file() else "gateway"


async def _listening(*addresses: str) -> None:
    """Return when something listens at all of the addresses."""
    for address in addresses:
        url = urlsplit(address)
        while not await _answers(url.hostname or "", url.port or 0):  # noqa: ASYNC110 - it is elsewhere
            await asyncio.sleep(0.05)


async def _answers(host: str, port: int) -> bool:
    try:
        _, writer = await asyncio.open_connection(host, port)
    except OSError:
        return False
    with closing(writer):
        return True
