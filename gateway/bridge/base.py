"""What every bridge by messages has in common: requests that wait for replies, updates that queue."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Mapping, Sequence
from typing import Any, TypeVar

from gateway.bridge.api import (
    DEFAULT_TTL,
    BridgeError,
    Catalogue,
    ControlState,
    Demand,
    Health,
    LeaseAct,
    TracePage,
    Update,
)
from gateway.bridge.backlog import Backlog
from gateway.bridge.messages import (
    Acknowledge,
    AskControls,
    AskDemand,
    AskHealth,
    AskTrace,
    Call,
    ClientGone,
    ControlsAre,
    DemandIs,
    DoLease,
    Done,
    HealthIs,
    Maintain,
    Promised,
    ReadTags,
    Reply,
    Response,
    RunCommand,
    Samples,
    TraceIs,
    TurnedAway,
    Watch,
    Welcome,
    WriteTag,
    Wrong,
)
from gateway.tag import Origin, Outcome, Sample, Value

_T = TypeVar("_T")


class MessageBridge(ABC):
    """Implements `gateway.bridge.api.Bridge` for subclasses that can `send` a request and `hear` what
    comes back."""

    def __init__(self) -> None:
        self._welcome: Welcome | None = None
        self._waiting: dict[int, asyncio.Future[Reply]] = {}
        self._last_id = 0
        self._backlog = Backlog()
        self._news = asyncio.Event()
        self._gone: BridgeError | None = None

    @property
    def section(self) -> Mapping[str, Any]:
        return self._greeting.section

    @property
    def catalogue(self) -> Catalogue:
        return self._greeting.catalogue

    @property
    def _greeting(self) -> Welcome:
        if self._welcome is None:
            raise BridgeError("the gateway has not answered yet")
        return self._welcome

    @abstractmethod
    def send(self, request: Call) -> None:
        """Pass a request on to the core."""

    def hear(self, message: Response) -> None:
        """Take in a message of the core."""
        if isinstance(message, Reply):
            future = self._waiting.get(message.id)
            if future is not None and not future.done():
                future.set_result(message)
        elif isinstance(message, Welcome):
            self._welcome = message
        else:
            self._backlog.put(message)
            self._news.set()

    def end(self, error: BridgeError) -> None:
        """The core is gone: everybody who waits is told."""
        self._gone = self._gone or error
        for future in self._waiting.values():
            if not future.done():
                future.set_exception(error)
        self._news.set()

    async def watch(self, wants: Mapping[str, float | None]) -> Mapping[str, float]:
        reply = await self._call(Watch(self._next_id(), wants))
        return _expect(reply, Promised).periods

    async def updates(self) -> AsyncIterator[Update]:
        while True:
            while (update := self._backlog.take()) is not None:
                yield update
                await asyncio.sleep(0)  # updates that never end must not keep others from their turn
            if self._gone is not None:
                return
            self._news.clear()
            await self._news.wait()

    async def read(self, tags: Sequence[str], max_age: float = 0.0) -> Sequence[Sample]:
        reply = await self._call(ReadTags(self._next_id(), tuple(tags), max_age))
        return _expect(reply, Samples).samples

    async def write(
        self,
        tag: str,
        value: Value,
        origin: Origin,
        ttl: float = DEFAULT_TTL,
        id: str = "",
        confirm: str = "",
    ) -> Outcome:
        reply = await self._call(WriteTag(self._next_id(), tag, value, origin, ttl, id, confirm))
        return _expect(reply, Done).outcome

    async def command(
        self,
        drive: str,
        name: str,
        args: Mapping[str, Value],
        origin: Origin,
        ttl: float = DEFAULT_TTL,
        id: str = "",
        confirm: str = "",
    ) -> Outcome:
        reply = await self._call(RunCommand(self._next_id(), drive, name, args, origin, ttl, id, confirm))
        return _expect(reply, Done).outcome

    async def lease(self, drive: str, act: LeaseAct, origin: Origin, whom: str = "") -> Outcome:
        reply = await self._call(DoLease(self._next_id(), drive, act, origin, whom))
        return _expect(reply, Done).outcome

    async def gone(self, origin: Origin, may_return: bool) -> Outcome:
        reply = await self._call(ClientGone(self._next_id(), origin, may_return))
        return _expect(reply, Done).outcome

    async def controls(self) -> Sequence[ControlState]:
        return _expect(await self._call(AskControls(self._next_id())), ControlsAre).states

    async def maintain(self, drive: str, on: bool, origin: Origin, reason: str = "") -> Outcome:
        reply = await self._call(Maintain(self._next_id(), drive, on, origin, reason))
        return _expect(reply, Done).outcome

    def turned_away(self, what: str, wanted: Any, origin: Origin, outcome: Outcome) -> None:
        if self._gone is None:
            self.send(TurnedAway(0, what, wanted, origin, outcome))

    async def health(self) -> Health:
        return _expect(await self._call(AskHealth(self._next_id())), HealthIs).health

    async def acknowledge(self, alarm: str, origin: Origin) -> Outcome:
        reply = await self._call(Acknowledge(self._next_id(), alarm, origin))
        return _expect(reply, Done).outcome

    async def demand(self, tag: str) -> Demand:
        return _expect(await self._call(AskDemand(self._next_id(), tag)), DemandIs).demand

    async def trace(self, line: str, after: int = 0) -> TracePage:
        return _expect(await self._call(AskTrace(self._next_id(), line, after)), TraceIs).page

    async def close(self) -> None:
        self.end(BridgeError("the bridge was closed"))

    def _next_id(self) -> int:
        self._last_id += 1
        return self._last_id

    async def _call(self, request: Call) -> Reply:
        if self._gone is not None:
            raise self._gone
        future = asyncio.get_running_loop().create_future()
        self._waiting[request.id] = future
        try:
            self.send(request)
            reply: Reply = await future
        finally:
            self._waiting.pop(request.id, None)
        if isinstance(reply, Wrong):
            raise BridgeError(reply.reason)
        return reply


def _expect(reply: object, kind: type[_T]) -> _T:
    if not isinstance(reply, kind):
        raise BridgeError(f"the gateway answered {type(reply).__name__} where {kind.__name__} was due")
    return reply
