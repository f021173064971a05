"""The core process, seen from the supervisor: started, ready, given its adapters' sockets."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import msgspec
import structlog

from gateway.supervise.child import Child
from gateway.supervise.keeper import Keeper

READY_SECONDS = 15.0
"""A core that has not said that it is ready after so long is taken for hung, and killed."""

ORPHAN_GRACE = 1.0
"""Seconds that adapters have to end once their core is gone."""

_log = structlog.get_logger(__name__)


class Core(Keeper):
    """Keeps the core running. `up` is set from its ready line to its end."""

    refusals: ClassVar[Mapping[int, str]] = {
        3: "the data folder cannot be had: another gateway runs on it, or it cannot be written"
    }

    def __init__(self, argv: Callable[[int], Sequence[str]], log: int | None = None) -> None:
        """``argv`` makes the command line, given the number of the control socket."""
        super().__init__("core")
        self.up = asyncio.Event()
        self.dependants: list[Keeper] = []
        self._argv = argv
        self._log = log
        self._control: socket.socket | None = None

    async def start(self) -> Child:
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._control.setblocking(False)
        with theirs:
            return Child(self._argv(theirs.fileno()), keep=(theirs.fileno(),), log=self._log)

    async def started(self) -> None:
        try:
            async with asyncio.timeout(READY_SECONDS):
                await self._hear_ready()
        except TimeoutError:
            _log.error("not ready", program=self.name, seconds=READY_SECONDS)
            await self.stop(0.0)

    async def stop(self, grace: float) -> None:
        await super().stop(grace)
        self._hang_up()

    async def ended(self) -> None:
        self._hang_up()
        await asyncio.gather(*(keeper.stop(ORPHAN_GRACE) for keeper in self.dependants))

    def hand_over(self, header: Mapping[str, Any], end: socket.socket) -> None:
        """Give the core one end of an adapter's socket pair, and tell what it is for.

        Raises:
            OSError: if the core is gone.
        """
        if self._control is None:
            raise ConnectionError("the core is not running")
        socket.send_fds(self._control, [msgspec.json.encode(header) + b"\n"], [end.fileno()])

    def _hang_up(self) -> None:
        self.up.clear()
        if self._control is not None:
            self._control.close()

    async def _hear_ready(self) -> None:
        """Wait for the ready line; return without it when the core ends instead."""
        if self._control is None:
            return
        line = await asyncio.get_running_loop().sock_recv(self._control, 4096)
        if line and msgspec.json.decode(line).get("ready"):
            self.up.set()
