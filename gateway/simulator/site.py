"""The lines of a site as ptys, until somebody says stop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection
from contextlib import ExitStack
from pathlib import Path

from gateway.mapping.site import LineConfig, Site
from gateway.simulator.bank import UnsupportedError
from gateway.simulator.live import SimulatedLine


def _ignore(name: str, path: Path) -> None:
    pass


async def run(
    site: Site,
    folder: Path,
    lines: Collection[str] | None = None,
    *,
    speed: float = 1.0,
    ready: Callable[[str, Path], None] = _ignore,
) -> None:
    """Simulate the named lines (None: all) until cancelled. Each appears as ``folder/<line>``; ``ready``
    is told its name and path as soon as it can be opened. Motors ramp ``speed`` times as fast.

    Raises `UnsupportedError` for a line that does not exist or cannot be simulated.
    """
    simulated = [SimulatedLine(line, folder, speed=speed) for line in _chosen(site, lines)]
    with ExitStack() as stack:
        for line in simulated:
            stack.enter_context(line)
            ready(line.name, line.path)
        await asyncio.Event().wait()


def _chosen(site: Site, names: Collection[str] | None) -> list[LineConfig]:
    known = {line.name: line for line in site.lines}
    unknown = [] if names is None else sorted(set(names) - known.keys())
    if unknown:
        raise UnsupportedError(f"the site has no line {', '.join(unknown)}; it has {', '.join(known)}")
    return [line for line in site.lines if names is None or line.name in names]
