"""A whole gateway in this process: core, OPC UA server, MQTT adapter and command line, each as it is; and a
client of each protocol that asks for the same thing and tells what it was answered."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

from asyncua import Client, ua
from typer.testing import CliRunner

from gateway.bridge.place import socket_path
from gateway.cli import app
from gateway.core.direct import DirectBridge
from gateway.core.lock import data_lock
from gateway.core.server import Server
from gateway.core.shell import Shell
from gateway.mapping.load import load_site
from gateway.northbound.mqtt.service import serve
from gateway.northbound.opcua.server import listening
from gateway.simulator.happening import Options
from gateway.simulator.live import SimulatedLine
from gateway.tag import Role, Value
from gateway.users import add_user
from tests.mqtt.brokers import BrokerProcess
from tests.mqtt.spy import Spy

PASSWORD = "correct horse"
CHEAP = 10
"""Logarithm of scrypt's N for the password."""

SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: lines/north
    serial: 9600 8N2
    drives:
      fan-1: {{profile: teco-7200gs, unit: 5, control: {{lease: off}}}}
      fan-2: {{profile: teco-7200gs, unit: 6, control: {{ttl: 60s, on_expiry: hold}}}}
      fan-3: {{profile: teco-7200gs, unit: 7, control: {{lease: off}}}}
writes: {{enabled: {writes}}}
opcua: {{endpoint: "opc.tcp://127.0.0.1:0", security: [none], anonymous: read}}
mqtt:
  - {{broker: "mqtt://127.0.0.1:{mqtt}", commands: {{role: {role}}}}}
data: ./data
"""


class Asked(NamedTuple):
    """What somebody wants of a drive: a value for a point, or arguments for a command."""

    drive: str
    name: str
    value: Value = None
    args: Mapping[str, Value] | None = None

    @property
    def what(self) -> str:
        return f"{self.drive}.{self.name}"


class Told(NamedTuple):
    """An outcome in words."""

    verdict: str
    cause: str
    reason: str


@dataclass
class Inside:
    """A gateway that runs in this process, and its clients."""

    site: Path
    line: SimulatedLine
    bridge: DirectBridge
    opcua: Client
    mqtt: Spy
    through: Mapping[str, Any] = field(init=False)

    def __post_init__(self) -> None:
        self.through = {"opcua": self.by_opcua, "mqtt": self.by_mqtt, "cli": self.by_command_line}

    async def by_opcua(self, asked: Asked) -> tuple[Any, ...]:
        """The StatusCode; for a command also verdict and reason."""
        node = ua.NodeId(asked.what, 2)
        if asked.args is None:
            wanted = ua.WriteValue(node, ua.AttributeIds.Value, Value=ua.DataValue(_variant(asked.value)))
            [code] = await self.opcua.uaclient.write(ua.WriteParameters(NodesToWrite=[wanted]))
            return (code.name,)
        given = [_variant(value) for value in asked.args.values()]
        request = ua.CallMethodRequest(ua.NodeId(asked.drive, 2), node, given)
        [result] = await self.opcua.uaclient.call([request])
        return result.StatusCode.name, *(output.Value for output in result.OutputArguments)

    async def by_mqtt(self, asked: Asked) -> Told:
        """What the answer says."""
        id = f"{time.monotonic_ns()}"
        body = {"v": asked.value} if asked.args is None else {"args": dict(asked.args)}
        topic = f"plant7/{asked.drive}"
        self.mqtt.send(f"{topic}/cmd/{asked.name}", {"id": id, "exp": time.time() + 5, "by": "anna"} | body)
        answer = await self.mqtt.until(f"{topic}/ack/{asked.name}", lambda d: d["id"] == id)
        return Told(answer.json["verdict"], answer.json.get("cause", ""), answer.json.get("reason", ""))

    async def by_command_line(self, asked: Asked) -> Told:
        """What is printed for programs."""
        if asked.args is None:
            words = ["write", str(self.site), f"{asked.what}={asked.value}"]
        else:
            given = [f"{name}={value}" for name, value in asked.args.items()]
            words = ["command", str(self.site), asked.drive, asked.name, *given]
        printed = await asyncio.to_thread(run, [*words, "--json"])
        return Told(printed["verdict"], printed["cause"], printed["reason"])

    async def recorded(self, through: str, after: int) -> list[dict[str, Any]]:
        """What is on record of attempts through a protocol, behind so many of all: at least one."""
        async with asyncio.timeout(10):
            while not (found := [e for e in self.records()[after:] if e["by"]["through"] == through]):
                await asyncio.sleep(0.005)
        return found

    def records(self) -> list[dict[str, Any]]:
        """What is on record of attempts, oldest first."""
        files = sorted((self.site.parent / "data").glob("journal-*.jsonl"))
        entries = [json.loads(line) for file in files for line in file.read_bytes().splitlines()]
        return [entry for entry in entries if entry["kind"] in ("outcome", "turned away", "late outcome")]


def run(words: Sequence[str]) -> dict[str, Any]:
    """What the command line prints."""
    ran = CliRunner().invoke(app, list(words))
    printed = [line for line in ran.stdout.splitlines() if line.startswith("{")]
    assert len(printed) == 1, (words, ran.output, ran.exception)
    found: dict[str, Any] = json.loads(printed[0])
    return found


def _variant(value: Value) -> ua.Variant:
    return ua.Variant(value, ua.VariantType.Double if isinstance(value, float) else None)


@contextlib.asynccontextmanager
async def inside(folder: Path, role: Role, writes: bool = True) -> AsyncIterator[Inside]:
    """A gateway with a simulated line, whose clients are of this role."""
    broker = BrokerProcess("nats", folder)
    broker.start()
    path = folder / "site.yaml"
    path.write_text(
        SITE.format(mqtt=broker.port, role=role.value, writes=str(writes).lower()),
        encoding="utf-8",
    )
    (folder / "data").mkdir()
    (folder / "lines").mkdir()
    with patch("gateway.users.COST", CHEAP):
        add_user(folder / "data" / "users.yaml", "anna", role, PASSWORD)
    site, findings = load_site(path)
    assert site is not None, [str(finding) for finding in findings]
    options = {drive.name: Options(speed=50.0) for drive in site.drives}
    line = SimulatedLine(site.lines[0], folder / "lines", options=options)
    async with contextlib.AsyncExitStack() as stack:
        stack.callback(broker.kill)
        # The command line need not read the same files again and again.
        stack.enter_context(patch("gateway.terminal.sites.load", lambda path: site))
        stack.enter_context(line)
        stack.enter_context(data_lock(site.data))
        shell = Shell(site, {})
        server = Server(shell)
        await server.listen(socket_path(site.data))
        stack.push_async_callback(server.close)
        shell.start()
        stack.push_async_callback(shell.stop)
        await shell.ports_tried(3.0)
        opcua = await stack.enter_async_context(
            listening(DirectBridge(shell, "opcua", Role.ADMIN, site.opcua))
        )
        stop = asyncio.Event()
        mqtt_bridge = DirectBridge(shell, "mqtt", role, site.mqtt[0])
        parts = [serve(mqtt_bridge, stop), opcua.follow(), opcua.keep_demands(), opcua.keep_leases()]
        tasks = [asyncio.create_task(part) for part in parts]

        async def end() -> None:
            stop.set()
            await tasks[0]
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

        stack.push_async_callback(end)
        mqtt = await stack.enter_async_context(Spy(broker.port, broker.version))
        await mqtt.until("plant7/_gateway/gw1/status", lambda d: d["status"] == "online")
        client = Client(opcua.url, timeout=20)
        client.set_user("anna")
        client.set_password(PASSWORD)
        bridge = DirectBridge(shell, "test", Role.ADMIN)
        yield Inside(path, line, bridge, await stack.enter_async_context(client), mqtt)


__all__ = ["Asked", "Inside", "Told", "inside"]
