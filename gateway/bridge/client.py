"""The bridge over a socket, for adapters and the command line."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from pathlib import Path

from gateway.bridge.api import API_VERSION, BridgeError
from gateway.bridge.base import MessageBridge
from gateway.bridge.messages import (
    LENGTH_BYTES,
    Call,
    Hello,
    Response,
    Welcome,
    Wrong,
    body_length,
    pack,
    unpack_response,
)

WELCOME_SECONDS = 10.0


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


class SocketBridge(MessageBridge):
    """Implements `gateway.bridge.api.Bridge` over a stream."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        super().__init__()
        self._reader = reader
        self._writer = writer
        self._task: asyncio.Task[None] | None = None

    async def greet(self, name: str) -> None:
        """Say hello, take the welcome and begin to listen."""
        self._writer.write(pack(Hello(API_VERSION, name)))
        message = await self._receive()
        if isinstance(message, Wrong):
            raise BridgeError(message.reason)
        if not isinstance(message, Welcome) or message.version != API_VERSION:
            raise BridgeError("the running gateway speaks another version of the bridge (restart it)")
        self.hear(message)
        self._task = asyncio.create_task(self._listen())

    def send(self, request: Call) -> None:
        self._writer.write(pack(request))

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
        await super().close()
        self._writer.close()
        with contextlib.suppress(OSError):
            await self._writer.wait_closed()

    async def _receive(self) -> Response:
        try:
            header = await self._reader.readexactly(LENGTH_BYTES)
            return unpack_response(await self._reader.readexactly(body_length(header)))
        except (asyncio.IncompleteReadError, OSError) as error:
            raise BridgeError("the gateway went away") from error

    async def _listen(self) -> None:
        try:
            while True:
                self.hear(await self._receive())
        except BridgeError as error:
            self.end(error)
