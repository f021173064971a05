"""Carries what monitored items want to the core, and remembers what the plan promised."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from gateway.bridge.api import Bridge
from gateway.northbound.opcua.interest import Interest, Item
from gateway.northbound.opcua.live import Live


class Demands:
    """The demands of all monitored items together. Changes are told to the core in batches."""

    def __init__(self, bridge: Bridge, live: Live) -> None:
        self._bridge = bridge
        self._live = live
        self._interest = Interest()
        self._promised: dict[str, float] = {}
        self._dirty = asyncio.Event()
        self._telling = asyncio.Lock()

    def want(self, item: Item, tag: str, period: float) -> None:
        """The item wants the tag every ``period`` seconds."""
        self._interest.want(item, tag, period)
        self._dirty.set()

    def drop(self, item: Item) -> None:
        """The item is gone or disabled."""
        self._interest.drop(item)
        self._dirty.set()

    def watched(self, tag: str) -> bool:
        """True while any item wants the tag."""
        return tag in self._interest

    def promise(self, tag: str) -> float | None:
        """Seconds between two samples that the plan holds; None when nothing is promised."""
        return self._promised.get(tag)

    def replan(self, periods: Mapping[str, float]) -> None:
        """The plan changed: these are its periods now."""
        self._promised.update({tag: period for tag, period in periods.items() if self.watched(tag)})

    async def settle(self) -> None:
        """Tell the core what changed. When this returns, `promise` is up to date.

        Raises:
            BridgeError: if the core is gone; the changes then count as not told.
        """
        async with self._telling:
            changes = self._interest.take_changes()
            if not changes:
                return
            withdrawn = [tag for tag, period in changes.items() if period is None]
            self._live.forget(withdrawn)
            try:
                promised = await self._bridge.watch(changes)
            except BaseException:
                self._interest.give_back(changes)
                raise
            for tag in changes:
                self._promised.pop(tag, None)
            self._promised.update(promised)

    async def run(self) -> None:
        """Tell changes that nobody waits for, such as the end of a session, until cancelled."""
        while True:
            await self._dirty.wait()
            self._dirty.clear()
            await self.settle()
