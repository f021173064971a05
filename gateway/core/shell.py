"""Around the pure core: clock, ports, journal and clients, on one asyncio loop. Shell."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import math
import secrets
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import structlog

from gateway import __version__
from gateway.bridge.api import API_VERSION, BridgeError
from gateway.bridge.messages import Call, Response, Welcome
from gateway.core.core import RELEASE_SECONDS, Core
from gateway.core.events import (
    Action,
    Asked,
    Close,
    Event,
    Joined,
    Left,
    Open,
    PortLost,
    PortOpened,
    Received,
    Record,
    Recorded,
    Started,
    Stopping,
    Tell,
    Ticked,
    Transmit,
)
from gateway.core.journal import Journal
from gateway.core.runs import Boot
from gateway.line.port import Port, open_port
from gateway.mapping.site import LineConfig, Site
from gateway.tag import Instant, Role

log = structlog.get_logger(__name__)

ENDING = 2 * RELEASE_SECONDS
"""Seconds after which the ports are closed even if the core has not ended."""

BOOT_ID = Path("/proc/sys/kernel/random/boot_id")

Deliver = Callable[[Response], None]
"""How a client is told something; must not block."""


def now() -> Instant:
    """The present moment on both clocks."""
    return Instant(time.monotonic(), time.time_ns())


def together() -> Instant:
    """As `now`, with as little time as can be between the looks at both clocks: what is told of the past
    is counted from here."""
    return min((now() for _ in range(9)), key=lambda instant: instant.wall - instant.mono * 1e9)


def this_boot() -> Boot:
    """A new id for this start, and the kernel's for that of the machine."""
    try:
        machine = BOOT_ID.read_text().strip()
    except OSError:
        machine = ""
    return Boot(id=secrets.token_hex(8), machine=machine)


class Shell:
    """Feeds the core with events and carries out its actions.

    Args:
        site: the configuration.
        line_ports: ports to use instead of those of the site, by line.
    """

    def __init__(self, site: Site, line_ports: Mapping[str, str]) -> None:
        self.core = Core(site, __version__)
        self._configs = {
            config.name: dataclasses.replace(config, port=line_ports.get(config.name, config.port))
            for config in site.lines
        }
        self._loop = asyncio.get_running_loop()
        self._ports: dict[str, Port] = {}
        self._opening: dict[str, asyncio.Task[None]] = {}
        self._clients: dict[int, Deliver] = {}
        self._last_session = 0
        self._timer: asyncio.TimerHandle | None = None
        self._armed_for: float | None = None
        self._ended = asyncio.Event()
        site.data.mkdir(parents=True, exist_ok=True)
        self._journal = Journal(site.data, self._recorded)

    def start(self) -> None:
        """Read back the journal, open the ports and begin.

        Raises:
            BridgeError: if the journal cannot be read: what it remembers must not be forgotten.
        """
        try:
            found = self._journal.start()
        except OSError as error:
            raise BridgeError(f"the journal cannot be read: {error}") from error
        self._step(Started(found.memory, this_boot(), found.broken, found.cut), together())

    async def ports_tried(self, seconds: float) -> None:
        """Wait until every port was opened or found to be in trouble, at most so long."""
        await asyncio.wait(list(self._opening.values()), timeout=seconds)

    async def stop(self) -> None:
        """End what is under way, close the ports, write the journal out."""
        self.feed(Stopping())
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(ENDING):
                await self._ended.wait()
        if self._timer is not None:
            self._timer.cancel()
        for task in self._opening.values():
            task.cancel()
        for port in self._ports.values():
            port.close()
        await asyncio.to_thread(self._journal.close)

    # -- clients

    def join(self, name: str, ceiling: Role, deliver: Deliver, section: Mapping[str, Any]) -> int:
        """Take in a client, welcome it, and return its session."""
        self._last_session += 1
        self._clients[self._last_session] = deliver
        deliver(Welcome(API_VERSION, section, self.core.catalogue))
        self.feed(Joined(self._last_session, name, ceiling))
        return self._last_session

    def leave(self, session: int) -> None:
        """A client is gone."""
        if self._clients.pop(session, None) is not None:
            self.feed(Left(session))

    def ask(self, session: int, request: Call, came: float = math.inf) -> None:
        """A client asks for something; it ``came`` in at that instant."""
        self.feed(Asked(session, request, came))

    # -- the loop

    def feed(self, event: Event) -> None:
        """Take the core one step further."""
        self._step(event, now())

    def _step(self, event: Event, at: Instant, sent: Sequence[Transmit] = ()) -> None:
        """``sent``: what is on the wire already of the actions that this step will bring."""
        for action in self.core.step(event, at):
            if action not in sent:
                self._carry_out(action)
        if self.core.ended:
            self._ended.set()
        self._arm()

    def _arm(self) -> None:
        """One timer, for the core's next instant."""
        wake = self.core.wake()
        if wake == self._armed_for:
            return
        if self._timer is not None:
            self._timer.cancel()
        self._armed_for = wake
        self._timer = None
        if wake is not None:
            self._timer = self._loop.call_at(wake, self._tick)

    def _tick(self) -> None:
        """The instant has come. Of planned reads is known what the core will decide: first the bytes, then
        the decision."""
        ahead = self.core.look_ahead(time.monotonic())
        for action in ahead:
            self._carry_out(action)
        self._timer = self._armed_for = None
        self._step(Ticked(), now(), ahead)

    def _carry_out(self, action: Action) -> None:
        match action:
            case Transmit(line, data):
                self._transmit(line, data)
            case Tell(session, message):
                if session in self._clients:
                    self._clients[session](message)
            case Record():
                self._journal.append(action)
            case Open(line):
                self._opening[line] = self._loop.create_task(self._open(self._configs[line]))
            case Close(line):
                self._close(line)

    def _transmit(self, line: str, data: bytes) -> None:
        port = self._ports.get(line)
        if port is None:
            return
        at = time.monotonic()
        try:
            port.write(data)
        except OSError as error:
            self._loop.call_soon(self._lost, line, error.strerror or str(error))
        self.core.transmitting(line, at)

    def _recorded(self, events: Sequence[Recorded]) -> None:
        """Called from the journal's thread."""
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody waits any more
            self._loop.call_soon_threadsafe(self._feed_all, events)

    def _feed_all(self, events: Sequence[Recorded]) -> None:
        for event in events:
            self.feed(event)

    # -- ports

    async def _open(self, config: LineConfig) -> None:
        line, where = config.name, config.port
        try:
            port = await open_port(config)
        except OSError as error:
            log.warning("port not opened", line=line, port=where, reason=str(error))
            self.feed(PortLost(line, str(error)))
            return
        self._ports[line] = port
        port.attach(lambda data, at: self._received(line, data, at), lambda reason: self._lost(line, reason))
        log.info("port open", line=line, port=where)
        self.feed(PortOpened(line))

    def _received(self, line: str, data: bytes, at: float) -> None:
        self.feed(Received(line, data, at))

    def _lost(self, line: str, reason: str) -> None:
        if line in self._ports:
            self._close(line)
            log.warning("port lost", line=line, reason=reason)
            self.feed(PortLost(line, reason))

    def _close(self, line: str) -> None:
        task = self._opening.pop(line, None)
        if task is not None:
            task.cancel()
        port = self._ports.pop(line, None)
        if port is not None:
            port.close()
