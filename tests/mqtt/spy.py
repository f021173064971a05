"""An MQTT client for tests that sees everything below the site: paho with its own thread."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion, MQTTProtocolVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.subscribeoptions import SubscribeOptions


@dataclass(frozen=True)
class Seen:
    """One message as the client got it."""

    topic: str
    payload: bytes
    retain: bool
    qos: int
    correlation: bytes | None

    @property
    def json(self) -> Any:
        return json.loads(self.payload)


class Spy:
    """Use as an async context manager; `until` waits for a message."""

    def __init__(self, port: int, version: int, *topics: str) -> None:
        self.seen: list[Seen] = []
        self._port = port
        self._version = version
        self._topics = topics or ("plant7/#",)
        self._new = asyncio.Event()
        self._subscribed = asyncio.Event()
        self._loop = asyncio.get_running_loop()
        self._client = paho.Client(
            CallbackAPIVersion.VERSION2, client_id="", protocol=MQTTProtocolVersion(version)
        )
        self._client.on_connect = self._on_connect
        self._client.on_subscribe = lambda *_: self._loop.call_soon_threadsafe(self._subscribed.set)
        self._client.on_message = self._on_message
        self._client.on_socket_open = lambda _, __, sock: sock.setsockopt(
            socket.IPPROTO_TCP, socket.TCP_NODELAY, 1
        )

    async def __aenter__(self) -> Spy:
        await asyncio.to_thread(self._client.connect, "127.0.0.1", self._port)
        self._client.loop_start()
        async with asyncio.timeout(10):
            await self._subscribed.wait()
        return self

    async def __aexit__(self, *_: object) -> None:
        self._client.disconnect()
        await asyncio.to_thread(self._client.loop_stop)

    def _on_connect(self, client: paho.Client, *_: object) -> None:
        if self._version == 5:
            options = SubscribeOptions(qos=1, retainAsPublished=True)
            client.subscribe([(topic, options) for topic in self._topics])
        else:
            client.subscribe([(topic, 1) for topic in self._topics])

    def _on_message(self, client: paho.Client, data: object, message: paho.MQTTMessage) -> None:
        correlation = getattr(message.properties, "CorrelationData", None)
        seen = Seen(message.topic, bytes(message.payload), message.retain, message.qos, correlation)
        self._loop.call_soon_threadsafe(self._note, seen)

    def _note(self, seen: Seen) -> None:
        self.seen.append(seen)
        self._new.set()

    async def until(self, topic: str, test: Callable[[Any], bool] = lambda _: True) -> Seen:
        """The first message on the topic, past or to come, whose JSON passes the test."""
        return (await self.several(1, topic, test))[0]

    async def several(
        self, count: int, topic: str, test: Callable[[Any], bool] = lambda _: True
    ) -> list[Seen]:
        """So many messages on the topic that pass the test."""
        try:
            async with asyncio.timeout(15):
                while len(found := self._find(topic, test)) < count:
                    self._new.clear()
                    await self._new.wait()
        except TimeoutError:
            raise AssertionError(
                f"{topic}: not seen in {[m for m in self.seen if m.topic == topic]}"
            ) from None
        return found

    def _find(self, topic: str, test: Callable[[Any], bool]) -> list[Seen]:
        return [m for m in self.seen if m.topic == topic and m.payload and test(m.json)]

    def send(self, topic: str, document: object, *, retain: bool = False, **properties: object) -> None:
        """Publish JSON (or bytes as they are) with QoS 1; MQTT 5 properties by their names in paho."""
        payload = document if isinstance(document, bytes) else json.dumps(document).encode()
        extra: Any = None
        if properties:
            extra = Properties(PacketTypes.PUBLISH)
            for name, value in properties.items():
                setattr(extra, name, value)
        self._client.publish(topic, payload, qos=1, retain=retain, properties=extra)
