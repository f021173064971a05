"""``gateway watch``: samples as they come."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.bridge.api import Bridge, PointInfo
    from gateway.tag import Sample
    from gateway.terminal.board import Board

EXAMPLES = """
gateway watch site.yaml

gateway watch site.yaml 'fan-1.output_*' --period 0.2

gateway watch site.yaml --json | jq .value
"""


def watch(
    site: SiteFile,
    tags: Annotated[list[str] | None, typer.Argument(metavar="TAG", help="* and ? match.")] = None,
    period: Annotated[
        float | None, typer.Option(min=0.01, help="Seconds; default: each point's rate.", show_default=False)
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--for", metavar="SECONDS", help="End by itself.", show_default=False)
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Watch tags: a live table in a terminal, else one line for each change.

    Without tags: everything that the drives' profiles have for monitoring.
    """
    from gateway.terminal.connect import run

    run(_watch(site, tags or (), period, seconds, as_json))


async def _watch(
    path: Path, patterns: Sequence[str], period: float | None, seconds: float | None, as_json: bool
) -> None:
    from gateway.terminal.board import Board
    from gateway.terminal.connect import open_bridge
    from gateway.terminal.sites import load
    from gateway.terminal.words import points_by_tag, select

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
    from gateway.bridge.api import Batch
    from gateway.terminal.errors import CommandError
    from gateway.terminal.words import points_by_tag

    points, rates = points_by_tag(bridge.catalogue), bridge.catalogue.rates
    await bridge.watch({tag: period or rates[points[tag].rate] for tag in tags})
    async for update in bridge.updates():
        if isinstance(update, Batch):
            yield update.samples
    raise CommandError("the gateway went away")


async def show_table(board: Board, samples: AsyncIterator[Sequence[Sample]]) -> None:
    """Show a live table on the terminal until cancelled."""
    from rich.live import Live

    # Without rich's own refresh thread: a process that starts others stays single-threaded.
    with Live(board.table(), auto_refresh=False) as live:
        async for batch in samples:
            board.take(batch)
            live.update(board.table(), refresh=True)


async def _show_lines(
    board: Board, samples: AsyncIterator[Sequence[Sample]], points: dict[str, PointInfo], as_json: bool
) -> None:
    from gateway.terminal.output import sample_line, sample_object, say, say_json

    async for batch in samples:
        for sample in board.take(batch):
            point = points[sample.tag]
            if as_json:
                say_json(sample_object(sample, point))
            else:
                say(sample_line(sample, point))
