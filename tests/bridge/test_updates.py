"""Updates as their consumer sees them."""

from __future__ import annotations

import asyncio

from gateway.bridge.api import Batch
from gateway.bridge.base import Call, MessageBridge
from gateway.tag import Quality, Sample


class Deaf(MessageBridge):
    """A bridge to nobody."""

    def send(self, request: Call) -> None:
        raise NotImplementedError


async def test_updates_that_come_faster_than_they_are_taken_leave_others_their_turn() -> None:
    bridge, turns = Deaf(), 0

    async def others() -> None:
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    beside = asyncio.create_task(others())
    bridge.hear(Batch(1, (Sample("a", 1, Quality.GOOD, 1),)))
    async for update in bridge.updates():
        assert isinstance(update, Batch)
        if update.seq == 100:
            break
        bridge.hear(Batch(update.seq + 1, update.samples))
    beside.cancel()
    assert turns > 50
