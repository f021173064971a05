"""What the link does with a connection that stands, without a broker."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import pytest
from paho.mqtt.client import Client
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.reasoncodes import ReasonCode

from gateway.northbound.mqtt import protocol
from gateway.northbound.mqtt.connection import Connection
from gateway.northbound.mqtt.link import Link
from gateway.northbound.mqtt.message import Lane, Message
from gateway.northbound.mqtt.outbox import LIMIT, Outbox
from gateway.northbound.mqtt.protocol import WINDOW
from gateway.northbound.mqtt.settings import settings_of
from gateway.northbound.mqtt.topics import Topics
from tests.mqtt.conftest import section


class Sink:
    """A connection that keeps what it is given; `confirm` makes room."""

    def __init__(self) -> None:
        self.sent: list[Message] = []
        self.unconfirmed: dict[int, Message] = {}

    @property
    def room(self) -> bool:
        return len(self.unconfirmed) < WINDOW

    def publish(self, message: Message) -> None:
        self.sent.append(message)
        self.unconfirmed[len(self.sent)] = message

    def confirm(self) -> None:
        self.unconfirmed.clear()


def link_with(sink: Sink, outbox: Outbox) -> Link:
    link: Any = Link(settings_of(section(1)).broker, Topics("plant7", "gw1"), outbox, "0", None)
    link._connection = sink
    return link


async def test_no_more_than_the_window_is_sent_and_the_rest_when_it_is_confirmed() -> None:
    sink, outbox = Sink(), Outbox()
    link = link_with(sink, outbox)
    outbox.connected(("birth", b"{}"))
    for number in range(2 * WINDOW):
        outbox.put(Message("e", str(number).encode(), Lane.ANSWER))
    assert len(sink.sent) == WINDOW
    sink.confirm()
    link.pump()
    assert len(sink.sent) == 2 * WINDOW
    assert [m.payload for m in sink.sent if m.topic == "e"][:60] == [str(n).encode() for n in range(60)]


async def test_what_was_dropped_is_told_once_the_broker_keeps_up() -> None:
    sink, outbox = Sink(), Outbox()
    link = link_with(sink, outbox)
    for number in range(LIMIT + 7):
        outbox.put(Message("e", str(number).encode(), Lane.ANSWER))
    outbox.connected(("birth", b"{}"))
    for _ in range(LIMIT):
        sink.confirm()
        link.pump()
    events = [json.loads(m.payload) for m in sink.sent if m.topic == "plant7/_gateway/gw1/event"]
    assert [(event["name"], event["v"]) for event in events] == [("messages_lost", 7)]


async def test_filters_that_the_broker_refuses_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    connection = Connection(settings_of(section(1)).broker, 5, "e", ("w", b""))
    asked: list[int] = []

    def answer(client: Client, topics: Sequence[str], version: int) -> None:
        asked.append(len(topics))
        names = ("Granted QoS 1" if topic != "b/3" else "Not authorized" for topic in topics)
        codes = [ReasonCode(PacketTypes.SUBACK, name) for name in names]
        connection._on_subscribe(client, None, 1, codes, None)

    monkeypatch.setattr(protocol, "subscribe", answer)
    filters = [f"a/{number}" for number in range(protocol.FILTERS)] + ["b/1", "b/2", "b/3"]
    assert await connection.subscribe(filters) == ["b/3"]
    assert asked == [protocol.FILTERS, 3]
    connection.close()


async def test_a_message_that_the_broker_would_not_take_is_left_out() -> None:
    broker = settings_of(section(1)).broker
    connection = Connection(broker, 5, "e", ("w", b""))
    connection._largest = 1000
    connection.publish(Message("t", b"x" * 2000, Lane.STATE))
    assert connection.unconfirmed == {}
    connection.close()
