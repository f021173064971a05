"""The core's end of the bridge sockets. Shell.

Each connection is a session. Replies and updates go out in one task per session; a watcher that does
not take them makes its own backlog fold and holds up nobody.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import os
import socket
import struct
import time
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import structlog

from gateway.bridge.api import API_VERSION, BridgeError, Update
from gateway.bridge.backlog import Backlog
from gateway.bridge.messages import (
    LENGTH_BYTES,
    Call,
    Hello,
    Response,
    Wrong,
    body_length,
    pack,
    unpack_request,
)
from gateway.core.shell import Shell
from gateway.tag import Role

log = structlog.get_logger(__name__)

GATHER = 0.01
"""Seconds for which updates are gathered: many batches cost a client little more than one. Replies go out at
once."""

TOGETHER = 16 * 1024
"""Bytes after which what is sent is handed over before more is added."""

READ_AHEAD = 16
"""Requests that are read before lines have their turn. To read one takes some ten microseconds, to begin what
it asks half a millisecond."""

ROOM = 1024 * 1024
"""Bytes of requests that may wait for their turn; a client with more of them is not read."""

MAX_UNSENT_REPLIES = 10_000
"""Replies that may wait for one client; one that asks and never listens is cut off."""


class Server:
    """Serves the bridge on sockets that adapters inherited and on the command line's socket."""

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._tasks: set[asyncio.Task[None]] = set()
        self._listener: asyncio.Server | None = None

    async def listen(self, path: Path) -> None:
        """Listen for command lines of this user at ``path`` (mode 0600)."""
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)  # noqa: PTH108 - a left-over of a core that was killed; quick enough for a loop
        mask = os.umask(0o177)
        try:
            self._listener = await asyncio.start_unix_server(self._local, path)
        finally:
            os.umask(mask)

    def adopt(self, link: socket.socket, ceiling: Role, section: Mapping[str, Any]) -> None:
        """Serve an adapter on its end of a socket pair."""
        self._begin(self._adopt(link, ceiling, section))

    async def close(self) -> None:
        """Cut everybody off."""
        if self._listener is not None:
            self._listener.close()
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _begin(self, work: Any) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _adopt(self, link: socket.socket, ceiling: Role, section: Mapping[str, Any]) -> None:
        reader, writer = await asyncio.open_unix_connection(sock=link)
        await Session(self._shell, reader, writer, ceiling, section).serve()

    async def _local(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if peer_user(writer.get_extra_info("socket")) not in (os.getuid(), 0):
            writer.close()
            return
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        await Session(self._shell, reader, writer, Role.ADMIN, {}).serve()


def peer_user(link: socket.socket) -> int:
    """The user id of the process at the other end."""
    size = struct.calcsize("3i")
    _, uid, _ = struct.unpack("3i", link.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, size))
    return int(uid)


class Waiting(NamedTuple):
    """A request that waits for its turn: when it came (monotonic), and its size in bytes."""

    request: Call
    came: float
    size: int


class Session:
    """One client on a stream. Its requests are begun one at a time, so that lines come first;
    a stop goes at once."""

    def __init__(
        self,
        shell: Shell,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        ceiling: Role,
        section: Mapping[str, Any],
    ) -> None:
        self._shell = shell
        self._reader = reader
        self._writer = writer
        self._ceiling = ceiling
        self._section = section
        self._replies: deque[Response] = deque()
        self._waiting: deque[Waiting] = deque()
        self._size = 0
        self._begun = asyncio.Event()
        self._busy = False
        """Something was begun since the loop last looked at lines."""
        self._number = 0
        """What the shell knows the session by, once it was greeted."""
        self._backlog = Backlog()
        self._news = asyncio.Event()
        self._gathering = False

    async def serve(self) -> None:
        """Talk until one end leaves."""
        sender = asyncio.create_task(self._send())
        try:
            self._number = await self._greet()
            await self._listen()
        except BridgeError as error:
            log.debug("client left", reason=str(error))
            await self._wait_for(0)  # what it asked before it left has its turn
            self._deliver(Wrong(0, str(error)))
        finally:
            self._waiting.clear()
            self._shell.leave(self._number)
            await self._flush()
            sender.cancel()
            self._writer.close()

    async def _listen(self) -> None:
        """Read requests, stops to be told at once and others to wait, until the client leaves."""
        for count in itertools.count(1):
            body = await self._receive()
            request, came = unpack_request(body), time.monotonic()
            if isinstance(request, Hello):
                raise BridgeError("a second hello")
            if self._shell.core.urgent(request):
                self._shell.ask(self._number, request)
            else:
                self._put(Waiting(request, came, len(body)))
            if count % READ_AHEAD == 0:
                await asyncio.sleep(0)  # what is there already is read without waiting
            await self._wait_for(ROOM)

    async def _wait_for(self, size: int) -> None:
        """Wait until the requests that wait are no more than so many bytes."""
        while self._size > size:
            self._begun.clear()
            await self._begun.wait()

    def _put(self, waiting: Waiting) -> None:
        """Begin what was asked, at once if nothing else was begun since the loop last looked at lines."""
        self._waiting.append(waiting)
        self._size += waiting.size
        if not self._busy:
            self._begin()

    def _begin(self) -> None:
        """Begin what waits longest, and come back later for the next."""
        self._busy = bool(self._waiting)
        if self._busy:
            asyncio.get_running_loop().call_soon(self._begin)
            request, came, size = self._waiting.popleft()
            self._size -= size
            self._begun.set()
            self._shell.ask(self._number, request, came)

    async def _greet(self) -> int:
        hello = unpack_request(await self._receive())
        if not isinstance(hello, Hello) or hello.version != API_VERSION:
            raise BridgeError(f"this gateway speaks version {API_VERSION} of the bridge")
        return self._shell.join(hello.name, self._ceiling, self._deliver, self._section)

    async def _receive(self) -> bytes:
        try:
            header = await self._reader.readexactly(LENGTH_BYTES)
            return await self._reader.readexactly(body_length(header))
        except (asyncio.IncompleteReadError, OSError) as error:
            raise BridgeError("gone") from error

    def _deliver(self, message: Response) -> None:
        if isinstance(message, Update):
            self._backlog.put(message)
            if not self._gathering:
                self._gathering = True
                asyncio.get_running_loop().call_later(GATHER, self._news.set)
            return
        if len(self._replies) >= MAX_UNSENT_REPLIES:
            self._writer.transport.abort()
        else:
            self._replies.append(message)
        self._news.set()

    async def _send(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                await self._news.wait()
                self._news.clear()
                self._gathering = False
                while data := self._together():
                    self._writer.write(data)
                    await self._writer.drain()
                    await asyncio.sleep(0)  # lines come first

    def _together(self) -> bytes:
        """The next messages, as many as fit together."""
        data = bytearray()
        while len(data) < TOGETHER and (message := self._next()) is not None:
            data += pack(message)
        return bytes(data)

    async def _flush(self) -> None:
        """Send the replies that wait, if the client still takes them."""
        with contextlib.suppress(OSError, TimeoutError):
            async with asyncio.timeout(0.2):
                while self._replies:
                    self._writer.write(pack(self._replies.popleft()))
                    await self._writer.drain()

    def _next(self) -> Response | None:
        return self._replies.popleft() if self._replies else self._backlog.take()
