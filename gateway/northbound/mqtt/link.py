"""Keeps a connection to the broker, whatever happens, and empties the outbox through it."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import random
import secrets
import time
from collections.abc import Callable

from gateway.northbound.mqtt import payload
from gateway.northbound.mqtt.connection import Answer, Connection, RefusedError
from gateway.northbound.mqtt.message import Incoming, Lane, Message
from gateway.northbound.mqtt.outbox import Outbox
from gateway.northbound.mqtt.protocol import Version
from gateway.northbound.mqtt.settings import Broker, SettingsError
from gateway.northbound.mqtt.topics import Topics

FIRST_PAUSE, LONGEST_PAUSE = 1.0, 30.0
"""Seconds between attempts to connect; they double, and vary by up to a quarter."""
STEADY = 10.0
"""A connection that lived so many seconds starts the pauses over. (Two gateways under one client id throw
each other out; they must not do so at full speed.)"""

log = logging.getLogger(__name__)


class Link:
    """The way to one broker. ``receive`` gets the commands; None means that none are taken."""

    def __init__(
        self,
        broker: Broker,
        topics: Topics,
        outbox: Outbox,
        version: str,
        receive: Callable[[Incoming], None] | None,
    ) -> None:
        self._broker = broker
        self._topics = topics
        self._outbox = outbox
        self._software = version
        self._receive = receive
        self._started = time.time_ns()
        self._newest: Version = 5
        self._version: Version = 5
        self._connection: Connection | None = None
        self._idle = asyncio.Event()
        self._told_lost = outbox.dropped
        outbox.on_put = self.pump

    async def run(self) -> None:
        """Connect, and connect again, until cancelled."""
        pause = FIRST_PAUSE
        while True:
            began = time.monotonic()
            version = self._version
            reason = await self._attempt()
            if self._version < version:
                continue
            if time.monotonic() - began > STEADY:
                pause = FIRST_PAUSE
            log.warning("no MQTT at %s for %.0f s: %s", self._broker.address, pause, reason)
            await asyncio.sleep(pause * random.uniform(0.75, 1.25))
            pause = min(2 * pause, LONGEST_PAUSE)

    async def _attempt(self) -> str:
        """One connection from beginning to end; the reason of its end."""
        try:
            return await self._live()
        except RefusedError as error:
            self._choose_version(error.answer)
            return str(error)
        except TimeoutError:
            return "no answer"
        except (OSError, ValueError, SettingsError) as error:
            return str(error)

    def _choose_version(self, refusal: Answer) -> None:
        """The version for the next attempt: the other one after "unsupported", which is remembered, or
        after a close without a word, which may have had another reason."""
        if refusal.version or refusal.silent:
            self._version = 4 if self._version == 5 else 5
        if refusal.version:
            self._newest = self._version

    async def _live(self) -> str:
        epoch = secrets.token_hex(8)
        will = (self._topics.gateway_status, payload.offline("connection lost"))
        connection = Connection(self._broker, self._version, epoch, will)
        try:
            await connection.open()
            log.info("connected to %s, MQTT %s", self._broker.address, "5" if self._version == 5 else "3.1.1")
            commands = await self._subscribe(connection)
            self._begin(connection, commands)
            reason = await connection.closed
            self._version = self._newest
            return reason
        finally:
            self._connection = None
            connection.close()
            self._outbox.disconnected(connection.unconfirmed.values())

    async def _subscribe(self, connection: Connection) -> bool:
        """Ask for commands, if any are taken; the birth tells whether the broker lets us have them."""
        if self._receive is None:
            return False
        connection.on_message = self._receive
        wanted = self._topics.commands
        refused = await connection.subscribe(wanted)
        for topic in refused:
            log.error("broker refuses the subscription to %s: no commands come in from there", topic)
        return len(refused) < len(wanted)

    def _begin(self, connection: Connection, commands: bool) -> None:
        """Publish what is retained, the birth last: who sees it knows that all the rest is current."""
        self._connection = connection
        connection.on_room = self.pump
        status = self._topics.gateway_status
        self._outbox.connected(
            last=(
                status,
                payload.birth(connection.epoch, self._started, self._software, commands, time.time_ns()),
            )
        )

    def pump(self) -> None:
        """Publish what waits, as far as the broker keeps up."""
        connection = self._connection
        while connection is not None and connection.room and (message := self._outbox.take()):
            connection.publish(message)
        if connection is not None and not connection.unconfirmed and not len(self._outbox):
            self._idle.set()
            self._tell_losses()

    def _tell_losses(self) -> None:
        """Once the broker keeps up again, say how many messages it never got."""
        lost, self._told_lost = self._outbox.dropped - self._told_lost, self._outbox.dropped
        if lost:
            event = payload.messages_lost(lost, time.time_ns())
            self._outbox.put(Message(self._topics.event(""), event, Lane.ANSWER))

    async def drain(self, seconds: float) -> None:
        """Wait until all is sent and confirmed, at most so long."""
        self._idle.clear()
        self.pump()
        if self._connection is not None:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(seconds):
                    await self._idle.wait()
