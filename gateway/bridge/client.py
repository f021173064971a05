"""The bridge over a socket, for adapters and the command line."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from gateway.bridge.api import API_VERSION, DEFAULT_TTL, BridgeError, Catalogue, Frame, Health, Update
from gateway.bridge.backlog import Backlog
from gateway.bridge.messages import (
    LENGTH_BYTES,
    AskHealth,
    AskTrace,
    Done,
    HealthIs,
    Hello,
    Promised,
    ReadTags,
    Reply,
    Request,
    Response,
    RunCommand,
    Samples,
    TraceIs,
    Watch,
    Welcome,
    WriteTag,
    Wrong,
    body_length,
    pack,
    unpack_response,
)
from gateway.tag import Origin, Outcome, Sample, Value

WELCOME_SECONDS = 10.0

_T = TypeVar("_T")


async def connect_fd(fd: int, name: str = "adapter") -> SocketBridge:
    """A bridge over an inherited socket.

    Raises:
        BridgeError: if there is no core at the other end, or one of another version.
    """
    return await _connect(socket.socket(fileno=fd), name)


async def connect_path(path: Path, name: str = "cli") -> SocketBridge:
    """A bridge to the core that listens at ``path``.

    Raises:
        BridgeError: as `connect_fd`.
    """
    link = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    link.setblocking(False)
    try:
        await asyncio.get_running_loop().sock_connect(link, str(path))
    except OSError as error:
        link.close()
        raise BridgeError(f"no gateway answers at {path}: {error.strerror}") from error
    return await _connect(link, name)


async def _connect(link: socket.socket, name: str) -> SocketBridge:
    reader, writer = await asyncio.open_unix_connection(sock=link)
    bridge = SocketBridge(reader, writer)
    try:
        async with asyncio.timeout(WELCOME_SECONDS):
            await bridge.greet(name)
    except TimeoutError as error:
        await bridge.close()
        raise BridgeError(f"the gateway did not answer within {WELCOME_SECONDS:g} s") from error
    except BridgeError:
        await bridge.close()
        raise
    return bridge


class SocketBridge:
    """Implements `gateway.bridge.api.Bridge` over a stream."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer
        self._welcome: Welcome | None = None
        self._waiting: dict[int, asyncio.Future[Reply]] = {}
        self._last_id = 0
        self._backlog = Backlog()
        self._news = asyncio.Event()
        self._gone: BridgeError | None = None
        self._task: asyncio.Task[None] | None = None

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

    async def greet(self, name: str) -> None:
        """Say hello, take the welcome and begin to listen."""
        self._send(Hello(API_VERSION, name))
        message = await self._receive()
        if isinstance(message, Wrong):
            raise BridgeError(message.reason)
        if not isinstance(message, Welcome) or message.version != API_VERSION:
            raise BridgeError("the running gateway speaks another version of the bridge (restart it)")
        self._welcome = message
        self._task = asyncio.create_task(self._listen())

    async def watch(self, wants: Mapping[str, float | None]) -> Mapping[str, float]:
        reply = await self._call(Watch(self._next_id(), wants))
        return _expect(reply, Promised).periods

    async def updates(self) -> AsyncIterator[Update]:
        while True:
            while (update := self._backlog.take()) is not None:
                yield update
            if self._gone is not None:
                return
            self._news.clear()
            await self._news.wait()

    async def read(self, tags: Sequence[str], max_age: float = 0.0) -> Sequence[Sample]:
        reply = await self._call(ReadTags(self._next_id(), tuple(tags), max_age))
        return _expect(reply, Samples).samples

    async def write(
        self, tag: str, value: Value, origin: Origin, ttl: float = DEFAULT_TTL, id: str = ""
    ) -> Outcome:
        reply = await self._call(WriteTag(self._next_id(), tag, value, origin, ttl, id))
        return _expect(reply, Done).outcome

    async def command(
        self,
        drive: str,
        name: str,
        args: Mapping[str, Value],
        origin: Origin,
        ttl: float = DEFAULT_TTL,
        id: str = "",
    ) -> Outcome:
        reply = await self._call(RunCommand(self._next_id(), drive, name, args, origin, ttl, id))
        return _expect(reply, Done).outcome

    async def health(self) -> Health:
        return _expect(await self._call(AskHealth(self._next_id())), HealthIs).health

    async def trace(self, line: str) -> Sequence[Frame]:
        return _expect(await self._call(AskTrace(self._next_id(), line)), TraceIs).frames

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
        self._end(BridgeError("the bridge was closed"))
        self._writer.close()
        with contextlib.suppress(OSError):
            await self._writer.wait_closed()

    def _next_id(self) -> int:
        self._last_id += 1
        return self._last_id

    async def _call(self, request: Watch | ReadTags | WriteTag | RunCommand | AskHealth | AskTrace) -> Reply:
        if self._gone is not None:
            raise self._gone
        future = asyncio.get_running_loop().create_future()
        self._waiting[request.id] = future
        try:
            self._send(request)
            reply: Reply = await future
        finally:
            self._waiting.pop(request.id, None)
        if isinstance(reply, Wrong):
            raise BridgeError(reply.reason)
        return reply

    def _send(self, request: Request) -> None:
        self._writer.write(pack(request))

    async def _receive(self) -> Response:
        try:
            header = await self._reader.readexactly(LENGTH_BYTES)
            return unpack_response(await self._reader.readexactly(body_length(header)))
        except (asyncio.IncompleteReadError, OSError) as error:
            raise BridgeError("the gateway went away") from error

    async def _listen(self) -> None:
        try:
            while True:
                self._deal_with(await self._receive())
        except BridgeError as error:
            self._end(error)

    def _deal_with(self, message: Response) -> None:
        if isinstance(message, Reply):
            future = self._waiting.get(message.id)
            if future is not None and not future.done():
                future.set_result(message)
        elif isinstance(message, Welcome):
            self._welcome = message
        else:
            self._backlog.put(message)
            self._news.set()

    def _end(self, error: BridgeError) -> None:
        self._gone = self._gone or error
        for future in self._waiting.values():
            if not future.done():
                future.set_exception(error)
        self._news.set()


def _expect(reply: object, kind: type[_T]) -> _T:
    if not isinstance(reply, kind):
        raise BridgeError(f"the gateway answered {type(reply).__name__} where {kind.__name__} was due")
    return reply
