"""Carries orders out over the bridge, many at a time but never without bound."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import defaultdict
from collections.abc import Callable

from gateway.bridge.api import Bridge, BridgeError, LeaseAct
from gateway.northbound.mqtt.order import Order
from gateway.northbound.mqtt.topics import LEASE, MAINTENANCE
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

log = logging.getLogger(__name__)

Done = Callable[[Outcome], None]


class Runner:
    """Runs orders in tasks of their own; ``done`` of each is called once, with its outcome."""

    def __init__(self, bridge: Bridge, role: Role, address: str) -> None:
        self._bridge = bridge
        self._role = role
        self._address = address
        self._tasks: set[asyncio.Task[Outcome]] = set()
        self._stops: defaultdict[str, int] = defaultdict(int)
        self._next_stop: dict[str, tuple[Order, Done]] = {}

    @property
    def full(self) -> bool:
        """True when no more orders are taken, but for stops."""
        return len(self._tasks) - sum(self._stops.values()) >= LIMIT

    def start(self, order: Order, done: Done) -> None:
        """Begin an order."""
        task = asyncio.create_task(self._run(order))
        self._tasks.add(task)
        task.add_done_callback(lambda ended: self._ended(ended, order, done))

    def stop(self, order: Order, done: Done) -> None:
        """Begin a stop, or keep it as the next one of its drive."""
        if self._stops[order.drive] < STOP_LIMIT:
            self._stops[order.drive] += 1
            self.start(order, done)
            return
        if (older := self._next_stop.get(order.drive)) is not None:
            older[1](SUPERSEDED)
        self._next_stop[order.drive] = (order, done)

    def turn_away(self, what: str, wanted: object, by: str, outcome: Outcome) -> None:
        """Have the core put on record what a rule of this adapter did not let pass."""
        self._bridge.turned_away(what, wanted, self._origin(by), outcome)

    async def finish(self, seconds: float) -> None:
        """Give what is under way so many seconds; what remains is told to be unknown."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                while self._tasks:
                    await asyncio.wait(self._tasks)
        for _, done in self._next_stop.values():
            done(UNFINISHED)
        self._next_stop.clear()
        for task in self._tasks:
            task.cancel()
        while self._tasks:
            await asyncio.wait(self._tasks)

    def _ended(self, task: asyncio.Task[Outcome], order: Order, done: Done) -> None:
        """Also for a task that was cancelled before it began."""
        self._tasks.discard(task)
        if order.is_stop:
            self._stops[order.drive] -= 1
            if (waiting := self._next_stop.pop(order.drive, None)) is not None:
                self.stop(*waiting)
        done(UNFINISHED if task.cancelled() else _outcome(task))

    async def _run(self, order: Order) -> Outcome:
        try:
            return await self._ask(order)
        except BridgeError as error:
            reason = f"the core is gone: {error}"
            return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER, reason=reason)

    async def _ask(self, order: Order) -> Outcome:
        origin = self._origin(order.by)
        if order.own == LEASE:
            return await self._bridge.lease(order.drive, LeaseAct(str(order.value)), origin, order.whom)
        if order.own == MAINTENANCE:
            return await self._bridge.maintain(order.drive, bool(order.value), origin, order.reason)
        if (args := order.args) is not None:
            return await self._bridge.command(
                order.drive, order.name, args, origin, order.ttl, order.bridge_id, order.confirm
            )
        tag = tag_of(order.drive, order.name)
        return await self._bridge.write(tag, order.value, origin, order.ttl, order.bridge_id, order.confirm)

    def _origin(self, by: str) -> Origin:
        return Origin(through="mqtt", who=by, role=self._role, address=self._address, authenticated=False)


def _outcome(task: asyncio.Task[Outcome]) -> Outcome:
    """A task's outcome; a mistake in our own program must not leave the sender without an answer."""
    if (error := task.exception()) is None:
        return task.result()
    log.error("a command failed inside the gateway", exc_info=error)
    return Outcome(verdict=Verdict.UNKNOWN, reason=f"the gateway failed inside: {error!r}")
