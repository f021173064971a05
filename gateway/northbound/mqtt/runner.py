"""Carries orders out over the bridge, many at a time but never without bound."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from gateway.bridge.api import Bridge, BridgeError
from gateway.northbound.mqtt.order import Order
from gateway.tag import Cause, Origin, Outcome, Role, Verdict, tag_of

LIMIT = 64
"""Most orders under way at a time, stops not counted."""
STOP_LIMIT = 4
"""Most stops under way per drive. Of more, the newest waits, and goes as soon as one is done."""

SUPERSEDED = Outcome(
    verdict=Verdict.SUPERSEDED, cause=Cause.SUPERSEDED, reason="a newer stop takes its place"
)
UNFINISHED = Outcome(
    verdict=Verdict.UNKNOWN,
    cause=Cause.SHUTTING_DOWN,
    reason="the gateway's MQTT side ended before the answer",
)

Done = Callable[[Outcome], None]


class Runner:
    """Runs orders in tasks of their own; ``done`` of each is called with its outcome."""

    def __init__(self, bridge: Bridge, role: Role, address: str) -> None:
        self._bridge = bridge
        self._role = role
        self._address = address
        self._tasks: set[asyncio.Task[None]] = set()
        self._stops: dict[str, int] = {}
        self._next_stop: dict[str, tuple[Order, Done]] = {}

    @property
    def full(self) -> bool:
        """True when no more orders are taken, but for stops."""
        return len(self._tasks) - sum(self._stops.values()) >= LIMIT

    def start(self, order: Order, done: Done) -> None:
        """Begin an order."""
        self._begin(self._run(order, done))

    def stop(self, order: Order, done: Done) -> None:
        """Begin a stop, or keep it as the next one of its drive."""
        if self._stops.get(order.drive, 0) < STOP_LIMIT:
            self._begin_stop(order, done)
            return
        if (older := self._next_stop.get(order.drive)) is not None:
            older[1](SUPERSEDED)
        self._next_stop[order.drive] = (order, done)

    async def finish(self, seconds: float) -> None:
        """Give what is under way so many seconds; what remains is told to be unknown."""
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=seconds)
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _begin(self, run: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(run)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _begin_stop(self, order: Order, done: Done) -> None:
        self._stops[order.drive] = self._stops.get(order.drive, 0) + 1
        self._begin(self._run_stop(order, done))

    async def _run_stop(self, order: Order, done: Done) -> None:
        try:
            await self._run(order, done)
        finally:
            self._stops[order.drive] -= 1
            if (waiting := self._next_stop.pop(order.drive, None)) is not None:
                self._begin_stop(*waiting)

    async def _run(self, order: Order, done: Done) -> None:
        outcome = UNFINISHED
        try:
            outcome = await self._ask(order)
        except BridgeError as error:
            outcome = Outcome(
                verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason=f"the core is gone: {error}"
            )
        finally:
            done(outcome)

    async def _ask(self, order: Order) -> Outcome:
        origin = Origin(
            through="mqtt", who=order.by, role=self._role, address=self._address, authenticated=False
        )
        if (args := order.args) is not None:
            return await self._bridge.command(
                order.drive, order.name, args, origin, order.ttl, order.bridge_id
            )
        tag = tag_of(order.drive, order.name)
        return await self._bridge.write(tag, order.value, origin, order.ttl, order.bridge_id)
