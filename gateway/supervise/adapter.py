"""An adapter process, seen from the supervisor."""

from __future__ import annotations

import socket
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from gateway.supervise.child import Child
from gateway.supervise.core import Core
from gateway.supervise.keeper import Keeper


class Adapter(Keeper):
    """Keeps one northbound adapter running, each life with a fresh socket pair to the core."""

    def __init__(
        self,
        name: str,
        argv: Callable[[int], Sequence[str]],
        header: Mapping[str, Any],
        core: Core,
        log: int | None = None,
    ) -> None:
        """``argv`` makes the command line, given the number of the bridge socket; ``header`` tells the
        core which adapter it is."""
        super().__init__(name)
        self._argv = argv
        self._header = header
        self._core = core
        self._log = log

    async def start(self) -> Child:
        await self._core.up.wait()
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        with ours, theirs:
            self._core.hand_over(self._header, ours)
            return Child(self._argv(theirs.fileno()), keep=(theirs.fileno(),), log=self._log)
