"""One MQTT connection from CONNECT to its end, on asyncio; never used twice.

paho's client does the protocol. Its thread, its reconnecting and its queue are not used: they lose the
order of messages, send before CONNACK, and die of exceptions in callbacks. Our callbacks only note what
happened; what follows from it is done after paho has returned.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from paho.mqtt.client import Client, ConnectFlags, DisconnectFlags, MQTTMessage
from paho.mqtt.reasoncodes import ReasonCode

from gateway.northbound.mqtt import protocol
from gateway.northbound.mqtt.message import Incoming, Message
from gateway.northbound.mqtt.protocol import WINDOW, Version
from gateway.northbound.mqtt.settings import Broker
from gateway.northbound.mqtt.thread import in_thread
from gateway.tag import Instant

ANSWER_TIMEOUT = 10.0
"""Longest wait for CONNACK and SUBACK in seconds; a NATS cluster that elects a leader needs some."""
MISC_PERIOD = 1.0
"""Seconds between looks at the keep-alive."""
LARGEST_PACKET = 268_435_455
"""Bytes; what MQTT can express. MQTT 5 brokers tell their own limit."""
READ_AHEAD = 64
"""Packets that are read before anything else is done: a stop among many commands is to be found soon."""
HEADERS = 64
"""Bytes of a PUBLISH packet beside topic and payload, generously."""

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Answer:
    """What the broker said to CONNECT or SUBSCRIBE."""

    granted: bool
    refused: tuple[int, ...] = ()
    """Of a SUBSCRIBE that was answered, the filters that were refused."""
    reason: str = ""
    version: bool = False
    """It does not speak this version of MQTT."""
    silent: bool = False
    """It said nothing and closed the connection, as some do that do not know the version."""


class RefusedError(Exception):
    """The broker does not take the connection."""

    def __init__(self, answer: Answer) -> None:
        super().__init__(answer.reason)
        self.answer = answer


class Connection:
    """One connection. ``unconfirmed`` holds what the broker has not confirmed, by packet id; ``closed``
    gets the reason when the connection ends. All methods belong to the event loop's thread."""

    def __init__(self, broker: Broker, version: Version, epoch: str, will: tuple[str, bytes]) -> None:
        self._loop = asyncio.get_running_loop()
        self.broker = broker
        self.version = version
        self.epoch = epoch
        self.unconfirmed: dict[int, Message] = {}
        self.closed: asyncio.Future[str] = self._loop.create_future()
        self.on_message: Callable[[Incoming], None] = lambda message: None
        self.on_room: Callable[[], None] = lambda: None
        """Called when the broker has confirmed something."""
        self._window = WINDOW
        self._largest = LARGEST_PACKET
        self._answer: asyncio.Future[Answer] = self._loop.create_future()
        self._arrived: list[Incoming] = []
        self._confirmed = False
        self._told = 0
        """Packets of which paho told us."""
        self._watched: int | None = None
        self._writing = False
        self._misc: asyncio.TimerHandle | None = None
        self._client = protocol.new_client(broker, version, will)
        self._client.on_connect = self._on_connect
        self._client.on_subscribe = self._on_subscribe
        self._client.on_message = self._on_message
        self._client.on_publish = self._on_publish
        self._client.on_disconnect = self._on_disconnect
        self._client.on_socket_close = self._on_socket_close

    async def open(self) -> None:
        """Connect and wait for CONNACK.

        Raises:
            RefusedError: by the broker.
            OSError, SettingsError: as `protocol.connect`.
            TimeoutError: if it does not answer.
        """
        await in_thread(
            lambda: protocol.connect(self._client, self.broker, self.version),
            abandoned=self._client.disconnect,
        )
        self._watch_socket()
        answer = await self._await_answer()
        if not answer.granted:
            raise RefusedError(answer)

    async def subscribe(self, topics: Sequence[str]) -> list[str]:
        """Subscribe; the topics that the broker refuses.

        Raises:
            TimeoutError: if the broker does not answer.
        """
        refused: list[str] = []
        for first in range(0, len(topics), protocol.FILTERS):
            some = topics[first : first + protocol.FILTERS]
            self._answer = self._loop.create_future()
            protocol.subscribe(self._client, some, self.version)
            self._sync_writer()
            answer = await self._await_answer()
            refused += [some[i] for i in answer.refused] if answer.granted else some
        return refused

    @property
    def room(self) -> bool:
        """True when another message may be published now."""
        return len(self.unconfirmed) < self._window and not self.closed.done()

    def publish(self, message: Message) -> None:
        """Hand a message over; it stays in ``unconfirmed`` until the broker confirms it.

        One that is longer than the broker takes is left out: it would end the connection, again and again.
        """
        if len(message.payload) + len(message.topic.encode()) + HEADERS > self._largest:
            log.error("%s is left out: the broker takes %d bytes at most", message.topic, self._largest)
            return
        mid = protocol.publish(self._client, message, self.version)
        self.unconfirmed[mid] = message
        self._sync_writer()

    def close(self) -> None:
        """Say DISCONNECT if that is still possible, and let go of the socket."""
        self._client.disconnect()
        if (stuck := self._client.socket()) is not None:
            self._unwatch()
            stuck.close()
        self._end("closed by us")

    def _end(self, reason: str) -> None:
        self._unwatch()
        if not self.closed.done():
            self.closed.set_result(reason)

    async def _await_answer(self) -> Answer:
        """The broker's answer to CONNECT or SUBSCRIBE, or word that it closed the connection."""
        async with asyncio.timeout(ANSWER_TIMEOUT):
            await asyncio.wait((self._answer, self.closed), return_when=asyncio.FIRST_COMPLETED)
        if self._answer.done():
            return self._answer.result()
        return Answer(granted=False, reason=f"no answer, {self.closed.result()}", silent=True)

    # ---- the socket on our event loop

    def _watch_socket(self) -> None:
        sock = self._client.socket()
        if sock is None:
            self._end("closed while connecting")
            return
        self._watched = sock.fileno()
        self._loop.add_reader(self._watched, self._readable)
        self._sync_writer()
        self._misc = self._loop.call_later(MISC_PERIOD, self._keep_alive)

    def _unwatch(self) -> None:
        if self._misc is not None:
            self._misc.cancel()
        if self._watched is not None:
            self._loop.remove_reader(self._watched)
            self._loop.remove_writer(self._watched)
            self._watched = None

    def _readable(self) -> None:
        self._call(self._read)
        sock: Any = self._client.socket()
        if sock is not None and hasattr(sock, "pending") and sock.pending():
            self._loop.call_soon(self._readable)  # TLS holds bytes that the selector cannot see

    def _read(self) -> None:
        """Read packets while some are there. (paho does not say whether it found one, but calls us back.)"""
        for _ in range(READ_AHEAD):
            told = self._told
            self._client.loop_read()
            if self._told == told:
                return

    def _writable(self) -> None:
        self._call(self._client.loop_write)

    def _keep_alive(self) -> None:
        self._misc = self._loop.call_later(MISC_PERIOD, self._keep_alive)
        self._call(self._client.loop_misc)

    def _call(self, step: Callable[[], Any]) -> None:
        """Let paho do one step. It parses what a stranger sends, so anything may come out of it."""
        if self.closed.done():
            return
        try:
            step()
        except Exception as error:
            log.exception("MQTT client failed; the connection is given up")
            self._end(f"client failed: {error!r}")
        self._follow_up()

    def _sync_writer(self) -> None:
        """Watch for room in the socket exactly while paho has bytes left to write."""
        wanted = self._watched is not None and self._client.want_write()
        if self._watched is not None and wanted != self._writing:
            if wanted:
                self._loop.add_writer(self._watched, self._writable)
            else:
                self._loop.remove_writer(self._watched)
        self._writing = wanted

    def _follow_up(self) -> None:
        """What the callbacks noted, now that paho has returned."""
        arrived, self._arrived = self._arrived, []
        for message in arrived:
            self.on_message(message)
        if self._confirmed:
            self._confirmed = False
            self.on_room()
        self._sync_writer()

    # ---- paho's callbacks

    def _on_connect(
        self, client: Client, data: Any, flags: ConnectFlags, code: ReasonCode, more: Any
    ) -> None:
        name = code.getName()
        version = name == "Unsupported protocol version"
        self._window = min(WINDOW, getattr(more, "ReceiveMaximum", WINDOW))
        self._largest = getattr(more, "MaximumPacketSize", LARGEST_PACKET)
        self._give_answer(Answer(not code.is_failure, reason=f"broker refuses: {name}", version=version))

    def _on_subscribe(self, client: Client, data: Any, mid: int, codes: list[ReasonCode], more: Any) -> None:
        refused = tuple(index for index, code in enumerate(codes) if code.is_failure)
        self._give_answer(Answer(granted=True, refused=refused))

    def _give_answer(self, answer: Answer) -> None:
        if not self._answer.done():
            self._answer.set_result(answer)

    def _on_message(self, client: Client, data: Any, message: MQTTMessage) -> None:
        self._told += 1
        now = Instant(time.monotonic(), time.time_ns())
        self._arrived.append(protocol.incoming(message, self.epoch, now))

    def _on_publish(self, client: Client, data: Any, mid: int, code: ReasonCode, more: Any) -> None:
        self._told += 1
        message = self.unconfirmed.pop(mid, None)
        self._confirmed = True
        if code.is_failure and message is not None:
            log.warning("broker refuses %s: %s", message.topic, code.getName())

    def _on_disconnect(
        self, client: Client, data: Any, flags: DisconnectFlags, code: ReasonCode, more: Any
    ) -> None:
        """May come while connecting, from the thread that does it."""
        who = "broker disconnects" if flags.is_disconnect_packet_from_server else "connection lost"
        self._loop.call_soon_threadsafe(self._end, f"{who}: {code.getName()}")

    def _on_socket_close(self, client: Client, data: Any, sock: Any) -> None:
        """The descriptor must leave the selector before it is closed. (While connecting, in the thread,
        it is not there yet.)"""
        if self._watched is not None:
            self._unwatch()
