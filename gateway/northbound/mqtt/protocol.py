"""paho's client set up as we use it, and everything in which MQTT 5 and 3.1.1 differ."""

from __future__ import annotations

import contextlib
import os
import socket
import ssl
from collections.abc import Sequence
from typing import Any, Literal, cast

from paho.mqtt.client import Client, MQTTMessage
from paho.mqtt.enums import CallbackAPIVersion, MQTTProtocolVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.subscribeoptions import SubscribeOptions

from gateway.northbound.mqtt.message import Incoming, Message
from gateway.northbound.mqtt.settings import Broker
from gateway.tag import Instant

KEEPALIVE = 20
"""Seconds after which a silent broker is asked whether it lives; after twice that it is given up."""
CONNECT_TIMEOUT = 5.0
WINDOW = 50
"""Most messages sent and not yet confirmed; paho gets slower with more."""
FILTERS = 8
"""Most filters in one SUBSCRIBE packet; some brokers take no more."""
LARGEST_INCOMING = 65_536
"""Bytes; an MQTT 5 broker keeps longer packets to itself."""

Version = Literal[4, 5]
"""Protocol level: 4 is MQTT 3.1.1."""


def new_client(broker: Broker, version: Version, will: tuple[str, bytes]) -> Client:
    """A client for one connection. It never reconnects, and survives exceptions in callbacks."""
    client = Client(
        CallbackAPIVersion.VERSION2,
        client_id=broker.client_id,
        clean_session=True if version == 4 else None,
        protocol=MQTTProtocolVersion(version),
        transport="websockets" if broker.websocket else "tcp",
        reconnect_on_failure=False,
    )
    client.suppress_exceptions = True
    client.connect_timeout = CONNECT_TIMEOUT
    client.max_inflight_messages_set(WINDOW)
    client.will_set(*will, qos=1, retain=True)
    if broker.websocket:
        client.ws_set_options(broker.path)
    client.on_socket_open = _no_delay
    return client


def connect(client: Client, broker: Broker, version: Version) -> None:
    """Connect and send CONNECT for a session that ends with the connection. Blocks: looking up a name,
    TCP's and TLS's handshakes.

    Raises:
        OSError: if there is no broker, or its certificate or our password file is not good.
        SettingsError: if the password file is open to everybody.
    """
    if broker.user is not None:
        client.username_pw_set(broker.user, broker.password())
    if broker.tls:
        context = ssl.create_default_context(cafile=broker.ca_file)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        context.sslsocket_class = _ClosingSocket
        client.tls_set_context(context)
    clean: dict[str, Any] = {}
    if version == 5:
        limits = _properties(PacketTypes.CONNECT, SessionExpiryInterval=0, MaximumPacketSize=LARGEST_INCOMING)
        clean = {"clean_start": True, "properties": limits}
    client.connect(broker.host, broker.port, KEEPALIVE, **clean)


def subscribe(client: Client, topics: Sequence[str], version: Version) -> None:
    """Subscribe to at most `FILTERS` topics with QoS 1. MQTT 5 is asked not to send what is retained, and to
    keep the retain flag on what passes by."""
    if version == 5:
        options = SubscribeOptions(qos=1, retainAsPublished=True, retainHandling=2)
        client.subscribe([(topic, options) for topic in topics])
    else:
        client.subscribe([(topic, 1) for topic in topics])


def publish(client: Client, message: Message, version: Version) -> int:
    """Publish with QoS 1; the packet id."""
    properties = None
    if message.correlation is not None and version == 5:
        properties = _properties(PacketTypes.PUBLISH, CorrelationData=message.correlation)
    return client.publish(message.topic, message.payload, 1, message.retain, properties).mid


def incoming(message: MQTTMessage, epoch: str, now: Instant) -> Incoming:
    """A received message in our own terms.

    Raises:
        UnicodeDecodeError: if its topic is not UTF-8.
    """
    properties = message.properties
    return Incoming(
        topic=message.topic,
        payload=bytes(message.payload),
        retain=message.retain,
        epoch=epoch,
        arrived=now,
        expiry=getattr(properties, "MessageExpiryInterval", None),
        response_topic=getattr(properties, "ResponseTopic", None),
        correlation=getattr(properties, "CorrelationData", None),
    )


class _ClosingSocket(ssl.SSLSocket):
    """paho forgets the socket of a handshake that failed; this one closes itself."""

    def do_handshake(self, block: bool = False) -> None:
        try:
            super().do_handshake(block)
        except OSError:
            self.close()
            raise


def _properties(packet: int, **values: object) -> Properties:
    """MQTT 5 properties for a kind of packet."""
    properties: Properties = cast("Any", Properties)(packet)
    for name, value in values.items():
        setattr(properties, name, value)
    return properties


def _no_delay(client: Client, data: Any, sock: Any) -> None:
    """Without TCP_NODELAY a second small message waits 40 ms for the first one's acknowledgement. (A
    duplicate descriptor reaches the socket's options through any wrapping.)"""
    with contextlib.suppress(OSError), socket.socket(fileno=os.dup(sock.fileno())) as same:
        same.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
