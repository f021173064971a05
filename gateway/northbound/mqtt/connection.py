"""One MQTT connection from CONNECT to its end, on asyncio; never used twice.

paho's client does the protocol. Its thread, its reconnecting and its queue are not used: they lose the
order of messages, send before CONNACK, and die of exceptions in callbacks. Our callbacks only note what
happened; what follows from it is done after paho has returned.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import socket
import ssl
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, cast

from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion, MQTTProtocolVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode
from paho.mqtt.subscribeoptions import SubscribeOptions

from gateway.northbound.mqtt.message import Incoming, Message
from gateway.northbound.mqtt.settings import Broker
from gateway.northbound.mqtt.thread import in_thread
from gateway.tag import Instant

KEEPALIVE = 20
"""Seconds after which a silent broker is asked whether it lives; after twice that it is given up."""
CONNECT_TIMEOUT = 5.0
ANSWER_TIMEOUT = 10.0
"""Longest wait for CONNACK and SUBACK in seconds; a NATS cluster that elects a leader needs some."""
WINDOW = 50
"""Most messages sent and not yet confirmed; paho gets slower with more."""
LARGEST_INCOMING = 65_536
"""Bytes; an MQTT 5 broker keeps longer packets to itself."""
MISC_PERIOD = 1.0

Version = Literal[4, 5]
"""Protocol level: 4 is MQTT 3.1.1."""

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Answer:
    """What the broker said to CONNECT or SUBSCRIBE."""

    granted: bool
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
        self._answer: asyncio.Future[Answer] = self._loop.create_future()
        self._arrived: list[Incoming] = []
        self._confirmed = 0
        self._watched: int | None = None
        self._writing = False
        self._misc: asyncio.TimerHandle | None = None
        self._client = self._new_client(will)

    def _new_client(self, will: tuple[str, bytes]) -> paho.Client:
        client = paho.Client(
            CallbackAPIVersion.VERSION2,
            client_id=self.broker.client_id,
            clean_session=True if self.version == 4 else None,
            protocol=MQTTProtocolVersion(self.version),
            transport="websockets" if self.broker.websocket else "tcp",
            reconnect_on_failure=False,
        )
        client.suppress_exceptions = True
        client.connect_timeout = CONNECT_TIMEOUT
        client.max_inflight_messages_set(WINDOW)
        client.will_set(*will, qos=1, retain=True)
        if self.broker.websocket:
            client.ws_set_options(self.broker.path)
        client.on_connect = self._on_connect
        client.on_subscribe = self._on_subscribe
        client.on_message = self._on_message
        client.on_publish = self._on_publish
        client.on_disconnect = self._on_disconnect
        client.on_socket_open = self._on_socket_open
        client.on_socket_close = self._on_socket_close
        return client

    # ---- opening and closing

    async def open(self) -> None:
        """Connect and wait for CONNACK.

        Raises:
            RefusedError: by the broker.
            OSError: if there is no broker, or its certificate or our password file is not good.
            TimeoutError: if it does not answer.
        """
        await in_thread(self._connect, abandoned=self._client.disconnect)
        self._watch_socket()
        answer = await self._await_answer()
        if not answer.granted:
            raise RefusedError(answer)

    def _connect(self) -> None:
        """In a thread, because looking up a name, TCP's and TLS's handshakes all block."""
        if self.broker.user is not None:
            self._client.username_pw_set(self.broker.user, self.broker.password())
        if self.broker.tls:
            context = ssl.create_default_context(cafile=self.broker.ca_file)
            context.minimum_version = ssl.TLSVersion.TLSv1_2
            self._client.tls_set_context(context)
        new_session: dict[str, Any] = {}
        if self.version == 5:
            limits = _properties(
                PacketTypes.CONNECT, SessionExpiryInterval=0, MaximumPacketSize=LARGEST_INCOMING
            )
            new_session = {"clean_start": True, "properties": limits}
        self._client.connect(self.broker.host, self.broker.port, KEEPALIVE, **new_session)

    async def _await_answer(self) -> Answer:
        """The broker's answer to CONNECT or SUBSCRIBE, or word that it closed the connection."""
        async with asyncio.timeout(ANSWER_TIMEOUT):
            await asyncio.wait((self._answer, self.closed), return_when=asyncio.FIRST_COMPLETED)
        if self._answer.done():
            return self._answer.result()
        return Answer(granted=False, reason=f"no answer, {self.closed.result()}", silent=True)

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

    # ---- talking

    async def subscribe(self, topics: str) -> bool:
        """Subscribe with QoS 1; False when the broker refuses it.

        MQTT 5 is asked not to send what is retained and to keep the retain flag on what passes by.

        Raises:
            TimeoutError: if the broker does not answer.
        """
        self._answer = self._loop.create_future()
        if self.version == 5:
            options = SubscribeOptions(qos=1, retainAsPublished=True, retainHandling=2)
            self._client.subscribe(topics, options=options)
        else:
            self._client.subscribe(topics, qos=1)
        self._follow_up()
        return (await self._await_answer()).granted

    @property
    def room(self) -> bool:
        """True when another message may be published now."""
        return len(self.unconfirmed) < WINDOW and not self.closed.done()

    def publish(self, message: Message) -> None:
        """Hand a message over; it stays in ``unconfirmed`` until the broker confirms it."""
        properties = None
        if message.correlation is not None and self.version == 5:
            properties = _properties(PacketTypes.PUBLISH, CorrelationData=message.correlation)
        sent = self._client.publish(message.topic, message.payload, 1, message.retain, properties)
        self.unconfirmed[sent.mid] = message
        self._sync_writer()

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
        self._call(self._client.loop_read)
        sock: Any = self._client.socket()
        if sock is not None and hasattr(sock, "pending") and sock.pending():
            self._loop.call_soon(self._readable)  # TLS holds bytes that the selector cannot see

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
        confirmed, self._confirmed = self._confirmed, 0
        if confirmed:
            self.on_room()
        self._sync_writer()

    # ---- paho's callbacks

    def _on_connect(
        self, client: paho.Client, data: Any, flags: paho.ConnectFlags, code: ReasonCode, more: Any
    ) -> None:
        name = code.getName()
        version = name == "Unsupported protocol version"
        self._give_answer(Answer(not code.is_failure, f"broker refuses: {name}", version=version))

    def _on_subscribe(
        self, client: paho.Client, data: Any, mid: int, codes: list[ReasonCode], more: Any
    ) -> None:
        refused = [code.getName() for code in codes if code.is_failure]
        self._give_answer(Answer(not refused, ", ".join(refused)))

    def _give_answer(self, answer: Answer) -> None:
        if not self._answer.done():
            self._answer.set_result(answer)

    def _on_message(self, client: paho.Client, data: Any, message: paho.MQTTMessage) -> None:
        properties = message.properties
        self._arrived.append(
            Incoming(
                topic=message.topic,
                payload=bytes(message.payload),
                retain=message.retain,
                epoch=self.epoch,
                arrived=Instant(time.monotonic(), time.time_ns()),
                expiry=getattr(properties, "MessageExpiryInterval", None),
                response_topic=getattr(properties, "ResponseTopic", None),
                correlation=getattr(properties, "CorrelationData", None),
            )
        )

    def _on_publish(self, client: paho.Client, data: Any, mid: int, code: ReasonCode, more: Any) -> None:
        message = self.unconfirmed.pop(mid, None)
        self._confirmed += 1
        if code.is_failure and message is not None:
            log.warning("broker refuses %s: %s", message.topic, code.getName())

    def _on_disconnect(
        self, client: paho.Client, data: Any, flags: paho.DisconnectFlags, code: ReasonCode, more: Any
    ) -> None:
        who = "broker disconnects" if flags.is_disconnect_packet_from_server else "connection lost"
        self._loop.call_soon_threadsafe(self._end, f"{who}: {code.getName()}")

    def _on_socket_open(self, client: paho.Client, data: Any, sock: Any) -> None:
        """Without TCP_NODELAY a second small message waits 40 ms for the first one's acknowledgement."""
        with contextlib.suppress(OSError), socket.socket(fileno=os.dup(sock.fileno())) as same:
            same.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _on_socket_close(self, client: paho.Client, data: Any, sock: Any) -> None:
        """The descriptor must leave the selector before it is closed. (While connecting, in the thread,
        it is not there yet.)"""
        if self._watched is not None:
            self._unwatch()


def _properties(packet: int, **values: object) -> Properties:
    """MQTT 5 properties for a kind of packet."""
    properties: Properties = cast("Any", Properties)(packet)
    for name, value in values.items():
        setattr(properties, name, value)
    return properties
