"""Samples as they come, on the terminal."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

from rich.live import Live

from gateway.bridge.api import Batch, Bridge, PointInfo
from gateway.tag import Sample
from gateway.terminal.board import Board
from gateway.terminal.connect import open_bridge
from gateway.terminal.errors import CommandError
from gateway.terminal.output import sample_line, sample_object, say, say_json
from gateway.terminal.sites import load
from gateway.terminal.words import points_by_tag, select


async def watch_site(
    path: Path, patterns: Sequence[str], period: float | None, seconds: float | None, as_json: bool
) -> None:
    """Show the tags of a site for so many seconds, None: until interrupted."""
    async with open_bridge(load(path)) as bridge:
        tags = select(bridge.catalogue, patterns)
        points = points_by_tag(bridge.catalogue)
        board = Board(points, tags)
        samples = follow(bridge, tags, period)
        live = sys.stdout.isatty() and not as_json
        show = show_table(board, samples) if live else _show_lines(board, samples, points, as_json)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await show


async def follow(
    bridge: Bridge, tags: Sequence[str], period: float | None = None
) -> AsyncIterator[Sequence[Sample]]:
    """Batches of samples of the tags, each at ``period`` seconds or at its own rate, until the bridge ends.

    Raises:
        CommandError: when the gateway went away.
    """
    points, rates = points_by_tag(bridge.catalogue), bridge.catalogue.rates
    await bridge.watch({tag: period or rates[points[tag].rate] for tag in tags})
    async for update in bridge.updates():
        if isinstance(update, Batch):
            yield update.samples
    raise CommandError("the gateway went away")


async def show_table(board: Board, samples: AsyncIterator[Sequence[Sample]]) -> None:
    """Show a live table on the terminal until cancelled."""
    # Without rich's own refresh thread: a process that starts others stays single-threaded.
    with Live(board.table(), auto_refresh=False) as live:
        async for batch in samples:
            board.take(batch)
            live.update(board.table(), refresh=True)


async def _show_lines(
    board: Board, samples: AsyncIterator[Sequence[Sample]], points: dict[str, PointInfo], as_json: bool
) -> None:
    async for batch in samples:
        for sample in board.take(batch):
            point = points[sample.tag]
            if as_json:
                say_json(sample_object(sample, point))
            else:
                say(sample_line(sample, point))
