"""A core in the same process: for the command line when none is running, and for tests. Shell."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator, Mapping
from typing import Any

from gateway.bridge.api import BridgeError
from gateway.bridge.base import MessageBridge
from gateway.bridge.messages import Call
from gateway.core.lock import data_lock
from gateway.core.shell import Shell
from gateway.mapping.site import Site
from gateway.tag import Role

OPEN_SECONDS = 3.0
"""How long a first request waits for the ports; after that it is told that its line is down."""


class DirectBridge(MessageBridge):
    """A client of a core in the same process."""

    def __init__(
        self, shell: Shell, name: str, ceiling: Role, section: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__()
        self._shell = shell
        self._session = shell.join(name, ceiling, self.hear, section or {})

    def send(self, request: Call) -> None:
        self._shell.ask(self._session, request)

    async def close(self) -> None:
        self._shell.leave(self._session)
        await super().close()


@contextlib.asynccontextmanager
async def open_core(
    site: Site, line_ports: Mapping[str, str] | None = None, name: str = "cli", ceiling: Role = Role.ADMIN
) -> AsyncIterator[DirectBridge]:
    """A core of one's own, guard and journal included, for as long as the context lasts.

    Raises:
        BridgeError: if another core has the data folder.
    """
    with data_lock(site.data):
        shell = Shell(site, line_ports or {})
        shell.start()
        await shell.ports_tried(OPEN_SECONDS)
        bridge = DirectBridge(shell, name, ceiling)
        try:
            yield bridge
        finally:
            await bridge.close()
            await shell.stop()


__all__ = ["BridgeError", "DirectBridge", "open_core"]
