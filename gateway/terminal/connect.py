"""The way from a command to the core: the running one if there is one, else one of our own."""

from __future__ import annotations

import asyncio
import getpass
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager
from typing import Any, TypeVar

from gateway.bridge.api import Bridge, BridgeError
from gateway.bridge.client import connect_path
from gateway.bridge.place import running, socket_path
from gateway.mapping.site import Site
from gateway.tag import Origin, Role
from gateway.terminal.errors import CommandError

_T = TypeVar("_T")


def local_origin() -> Origin:
    """Whoever runs this command. He can open the core's 0600 socket, so nothing is kept from him."""
    return Origin(through="cli", who=getpass.getuser(), role=Role.ADMIN)


@asynccontextmanager
async def running_bridge(site: Site) -> AsyncIterator[Bridge]:
    """A bridge to the running core of this site's data folder.

    Raises:
        CommandError: if there is none.
        BridgeError: if it cannot be reached.
    """
    if not running(site.data):
        raise CommandError(f"no gateway is running (start it: gateway run {site.path})")
    bridge = await connect_path(socket_path(site.data))
    try:
        yield bridge
    finally:
        await bridge.close()


@asynccontextmanager
async def open_bridge(site: Site) -> AsyncIterator[Bridge]:
    """A bridge to the running core of this site's data folder; without one, to a core in this process,
    which opens the lines itself, guard and journal included.

    Raises:
        CommandError: if there is no running core and a line is only simulated.
        BridgeError: if the running core cannot be reached.
    """
    if running(site.data):
        async with running_bridge(site) as bridge:
            yield bridge
        return
    refuse_simulated(site)
    from gateway.core.direct import open_core
    from gateway.log import configure

    configure("cli", "warning")  # to standard error: the output is for answers
    async with open_core(site, {}) as own:
        yield own


def refuse_simulated(site: Site) -> None:
    """Raises CommandError if a line is simulated, for then only a running gateway has drives on it."""
    for line in site.lines:
        if line.port == "simulated:":
            raise CommandError(
                f"line {line.name} is simulated, and no gateway is running "
                f"(start it: gateway run {site.path})"
            )


def run(work: Coroutine[Any, Any, _T]) -> _T:
    """Run a command's work; what goes wrong on the way to the core becomes a CommandError."""
    try:
        return asyncio.run(work)
    except BridgeError as error:
        raise CommandError(str(error)) from error
