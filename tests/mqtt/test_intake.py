"""A stop overtakes what waits in the adapter, and nothing that it overtook follows it."""

from __future__ import annotations

import asyncio
import json
import time
from typing import Any

import msgspec
import pytest

from gateway.northbound.mqtt import commander as commanders
from gateway.northbound.mqtt.commander import Commander
from gateway.northbound.mqtt.intake import MOST, Intake
from gateway.northbound.mqtt.message import Incoming, Lane
from gateway.northbound.mqtt.outbox import Outbox
from gateway.northbound.mqtt.runner import Runner
from gateway.northbound.mqtt.topics import Topics
from gateway.tag import Instant, Role
from tests.fakes import FakeBridge, small_catalogue
from tests.mqtt.brokers import free_port
from tests.mqtt.conftest import adapter, section

EPOCH = "e" * 16
LINE = "plant7/_gateway/gw1/lines/north"
FLOOD = 1000


class Desk:
    """An intake with its commander, on a bridge with two drives of one line."""

    def __init__(self) -> None:
        catalogue = small_catalogue()
        other = msgspec.structs.replace(catalogue.drives[0], name="fan-2", unit=2)
        self.bridge = FakeBridge(msgspec.structs.replace(catalogue, drives=(*catalogue.drives, other)))
        self.outbox = Outbox()
        self.runner = Runner(self.bridge, Role.OPERATOR, "mqtt://b:1883")
        known = self.bridge.catalogue
        topics = Topics("plant7", "gw1", known.drives, known.lines)
        clock = lambda: Instant(self.at, 0)  # noqa: E731
        self.commander = Commander(topics, known.owners, self.runner, self.outbox, clock)
        self.intake = Intake(self.commander.receive, self.commander.urgent)
        self.at = 100.0

    def put(self, what: str, id: int = 0, value: float | None = None, to: str = "plant7/fan-1") -> None:
        """A message, a little later than the one before."""
        self.at += 1e-4
        document: dict[str, Any] = {"id": id, "epoch": EPOCH}
        document |= {} if value is None else {"v": value}
        self.intake.put(
            Incoming(
                topic=f"{to}/cmd/{what}",
                payload=json.dumps(document).encode(),
                retain=False,
                epoch=EPOCH,
                arrived=Instant(self.at, 0),
            )
        )

    async def answers(self) -> list[tuple[str, Any, str]]:
        """What was answered when nothing waits any more: topic, id and verdict."""
        for _ in range(2 * FLOOD):
            await asyncio.sleep(0)
        await self.runner.finish(5.0)
        self.outbox.connected(("birth", b"{}"))
        messages = [m for m in iter(self.outbox.take, None) if m.lane is Lane.ANSWER]
        told = [(m.topic.removeprefix("plant7/"), json.loads(m.payload)) for m in messages]
        return [(topic, answer["id"], answer["verdict"]) for topic, answer in told]


@pytest.mark.parametrize("stop", [("stop", "plant7/fan-1"), ("stop_all", LINE)])
async def test_a_stop_overtakes_a_thousand_writes_and_none_of_them_follows_it(stop: tuple[str, str]) -> None:
    desk = Desk()
    for number in range(FLOOD):
        desk.put("frequency_command", number, 30.0)
    desk.put(stop[0], 5000, to=stop[1])
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert [command[1] for command in desk.bridge.commands] == [stop[0]]
    answers = await desk.answers()
    assert len(desk.bridge.writes) == 1, "the one that was begun before the stop came"
    assert [verdict for _, _, verdict in answers].count("superseded") >= 990, "of 1000 that may wait"
    assert len(desk.bridge.turned) == FLOOD - 1, "all of it is on record"


async def test_what_a_stop_overtook_stays_undone_when_it_is_sent_again() -> None:
    desk = Desk()
    desk.put("input_5", 1, True)
    desk.put("frequency_command", 2, 30.0)
    desk.put("stop", 3)
    await desk.answers()
    desk.put("frequency_command", 2, 30.0)
    answers = await desk.answers()
    assert ("fan-1/ack/frequency_command", 2, "superseded") in answers
    assert [write[0] for write in desk.bridge.writes] == ["fan-1.input_5"]


async def test_a_stop_takes_nothing_from_another_drive_nor_what_comes_after_it() -> None:
    desk = Desk()
    desk.put("input_5", 1, True)
    desk.put("frequency_command", 2, 30.0, to="plant7/fan-2")
    desk.put("run_forward_all", 3, to=LINE)
    desk.put("stop", 4)
    desk.put("frequency_command", 5, 20.0)
    await desk.answers()
    assert [(write[0], write[1]) for write in desk.bridge.writes] == [
        ("fan-1.input_5", True),
        ("fan-2.frequency_command", 30.0),
        ("fan-1.frequency_command", 20.0),
    ]
    assert [command[1] for command in desk.bridge.commands] == ["stop"], "run_forward_all concerns fan-1 too"


async def test_time_in_the_queue_is_taken_off_what_a_command_may_wait() -> None:
    desk = Desk()
    desk.put("input_5", 1, True)
    desk.put("frequency_command", 2, 30.0)
    desk.at += 2.0
    await desk.answers()
    assert [write[3] for write in desk.bridge.writes] == pytest.approx([5.0, 3.0])


async def test_what_waits_is_bounded_and_nothing_is_lost() -> None:
    seen: list[int] = []
    now = Instant(0.0, 0)
    intake = Intake(lambda incoming: seen.append(int(incoming.topic)), lambda incoming: False)
    for number in range(MOST + 100):
        intake.put(Incoming(topic=str(number), payload=b"", retain=False, epoch="", arrived=now))
    assert len(seen) == 100, "beyond what may wait, one is taken for each that comes"
    while len(seen) < MOST + 100:
        await asyncio.sleep(0)
    assert seen == sorted(seen)


def packet(kind: int, body: bytes) -> bytes:
    """An MQTT 3.1.1 packet."""
    length, size = b"", len(body)
    while True:
        size, digit = divmod(size, 128)
        length += bytes([digit | (128 if size else 0)])
        if not size:
            return bytes([kind]) + length + body


def publication(topic: str, document: dict[str, Any], number: int) -> bytes:
    name = topic.encode()
    body = len(name).to_bytes(2, "big") + name + number.to_bytes(2, "big")
    return packet(0x32, body + json.dumps(document).encode())


class OneWrite:
    """A broker that takes any connection, and has a thousand writes and a stop ready in one piece."""

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while True:
                kind = (await reader.readexactly(1))[0] & 0xF0
                body = await reader.readexactly(await self._length(reader))
                if kind == 0x10 and body[6] == 5:
                    writer.write(packet(0x20, b"\x00\x84\x00"))
                elif kind == 0x10:
                    writer.write(packet(0x20, b"\x00\x00"))
                elif kind == 0x80:
                    writer.write(packet(0x90, body[:2] + bytes(body.count(b"/cmd/#"))))
                    writer.write(self._flood())
        except asyncio.IncompleteReadError:
            writer.close()

    async def _length(self, reader: asyncio.StreamReader) -> int:
        length = shift = 0
        while True:
            digit = (await reader.readexactly(1))[0]
            length, shift = length | (digit & 127) << shift, shift + 7
            if digit < 128:
                return length

    def _flood(self) -> bytes:
        end = time.time() + 30
        writes = [
            publication("plant7/fan-1/cmd/frequency_command", {"id": number, "v": 30.0, "exp": end}, number)
            for number in range(1, FLOOD + 1)
        ]
        return b"".join([*writes, publication("plant7/fan-1/cmd/stop", {}, FLOOD + 1)])


async def test_a_stop_is_found_behind_a_thousand_writes_in_the_socket(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    taken: list[str] = []
    receive = commanders.Commander.receive

    def noting(self: Commander, incoming: Incoming) -> None:
        taken.append(incoming.topic.rpartition("/")[2])
        receive(self, incoming)

    monkeypatch.setattr(commanders.Commander, "receive", noting)
    port = free_port()
    broker = OneWrite()
    server = await asyncio.start_server(broker.serve, "127.0.0.1", port)
    bridge = FakeBridge(section=section(port))
    async with adapter(bridge), asyncio.timeout(10):
        while not bridge.commands:
            await asyncio.sleep(0.01)
    server.close()
    assert taken.index("stop") < FLOOD / 10
