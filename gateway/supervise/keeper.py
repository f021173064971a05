"""Keeps one program running."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import structlog

from gateway.supervise.backoff import Backoff
from gateway.supervise.child import Child

_log = structlog.get_logger(__name__)


class StartRefusedError(Exception):
    """A program said that starting it again is no use. The message is for people."""


class Keeper(ABC):
    """Starts a program, and starts it again, later and later, whenever it ends."""

    refusals: ClassVar[Mapping[int, str]] = {}
    """Exit codes after which it is not started again, and what they mean."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.alive = asyncio.Event()
        self._child: Child | None = None
        self._backoff = Backoff()

    @property
    def pid(self) -> int | None:
        """The process id of the present child; None between two lives."""
        return self._child.pid if self._child and self.alive.is_set() else None

    @abstractmethod
    async def start(self) -> Child:
        """Start it once. May raise OSError: that counts as a life of no length."""

    async def started(self) -> None:
        """Called when it was started, before anybody waits for its end."""

    async def ended(self) -> None:
        """Called after each end, before the wait."""

    async def keep(self) -> None:
        """Keep it running until cancelled.

        Raises:
            StartRefusedError: if it ended with one of the refusals.
        """
        while True:
            lived = await self._live()
            wait = self._backoff.after(lived)
            _log.info("restart", program=self.name, wait=wait)
            await asyncio.sleep(wait)

    async def stop(self, grace: float) -> None:
        """End the present child, if there is one; after ``grace`` seconds by force."""
        if self._child is not None:
            await self._child.stop(grace)

    async def _live(self) -> float:
        """One life; how many seconds it took."""
        try:
            child = self._child = await self.start()
        except OSError as error:
            _log.error("cannot start", program=self.name, reason=str(error))
            return 0.0
        self.alive.set()
        _log.info("started", program=self.name, pid=child.pid)
        await self.started()
        code = await child.wait()
        self.alive.clear()
        _log.warning("ended", program=self.name, pid=child.pid, code=code, lived=round(child.lived, 1))
        await self.ended()
        if code in self.refusals:
            raise StartRefusedError(self.refusals[code])
        return child.lived


class Helper(Keeper):
    """A program that needs nothing but its command line: a simulator, a broker."""

    def __init__(self, name: str, argv: Sequence[str], log: int | None = None) -> None:
        super().__init__(name)
        self._argv = argv
        self._log = log

    async def start(self) -> Child:
        return Child(self._argv, log=self._log)
