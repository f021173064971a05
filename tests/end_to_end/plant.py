"""A whole gateway as a process, with a simulated drive, an OPC UA server and a broker; and what it did."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gateway.tag import Role
from gateway.users import add_user
from tests.cli.program import GATEWAY, gateway
from tests.mqtt.brokers import BrokerProcess, free_port

PASSWORD = "correct horse"
TTL = 3.0

SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: "simulated:"
    serial: 9600 8N2
    drives:
      fan-1: {{profile: teco-7200gs, unit: 5, control: {{ttl: {ttl}s, on_expiry: stop}}}}
writes: {{enabled: true}}
opcua: {{endpoint: "opc.tcp://127.0.0.1:{opcua}", security: [none], anonymous: read}}
mqtt:
  - {{broker: "mqtt://127.0.0.1:{mqtt}", commands: {{role: operator}}}}
data: ./data
"""


@dataclass
class Plant:
    """A gateway that runs."""

    folder: Path
    process: subprocess.Popen[bytes]
    opcua: int
    broker: BrokerProcess

    @property
    def site(self) -> Path:
        return self.folder / "site.yaml"

    @property
    def url(self) -> str:
        return f"opc.tcp://127.0.0.1:{self.opcua}"

    def journal(self, kind: str) -> list[dict[str, Any]]:
        """The entries of a kind, oldest first."""
        files = sorted((self.folder / "data").glob("journal-*.jsonl"))
        lines = [line for file in files for line in file.read_bytes().splitlines()]
        found = []
        for line in lines:
            with contextlib.suppress(ValueError):
                found.append(json.loads(line))
        return [entry for entry in found if entry.get("kind") == kind]

    def own_stops(self) -> list[dict[str, Any]]:
        """Stops that the gateway gave by itself."""
        outcomes = self.journal("outcome")
        return [e for e in outcomes if e["what"] == "fan-1.stop" and e["by"]["through"] == "core"]

    def kill_core(self) -> None:
        """kill -9 of the core process alone; the supervisor starts another."""
        [core] = [pid for pid in children(self.process.pid) if "gateway.core" in command_of(pid)]
        os.kill(core, signal.SIGKILL)

    def wait_until(self, condition: Callable[[], bool], seconds: float = 30.0) -> None:
        """Fail unless it holds in time."""
        limit = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < limit, "did not happen in time"
            time.sleep(0.05)

    def wait_until_up(self) -> None:
        """The drive answers, and both servers are there."""
        self.wait_until(lambda: "drive fan-1: up" in gateway("health", self.site).out, 60.0)
        self.wait_until(self._listens, 30.0)
        self.wait_until(lambda: "mqtt" in gateway("health", self.site, "--json").out, 30.0)

    def _listens(self) -> bool:
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", self.opcua)) == 0

    def running(self) -> bool:
        """The motor runs."""
        ran = gateway("read", self.site, "fan-1.running", "--json")
        return ran.code == 0 and bool(ran.objects[0]["value"])


@contextlib.contextmanager
def plant(folder: Path) -> Iterator[Plant]:
    """A gateway with its broker, until the block ends."""
    broker = BrokerProcess("nats", folder)
    broker.start()
    opcua = free_port()
    (folder / "site.yaml").write_text(SITE.format(ttl=TTL, opcua=opcua, mqtt=broker.port), encoding="utf-8")
    users = folder / "data" / "users.yaml"
    users.parent.mkdir()
    add_user(users, "anna", Role.OPERATOR, PASSWORD)
    add_user(users, "erika", Role.ENGINEER, PASSWORD)
    with (
        (folder / "log").open("wb") as log,
        subprocess.Popen([*GATEWAY, "run", str(folder / "site.yaml")], stderr=log) as process,
    ):
        made = Plant(folder, process, opcua, broker)
        try:
            made.wait_until_up()
            yield made
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(20)
            broker.kill()


def children(pid: int) -> list[int]:
    """The processes that a process started, theirs included."""
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        for word in (task / "children").read_text().split():
            found += [int(word), *children(int(word))]
    return found


def command_of(pid: int) -> str:
    """How a process was started."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")
    return ""


RUNNER = """
import asyncio, sys
from asyncua import Client

async def main():
    client = Client(sys.argv[1], timeout=10)
    client.set_user("anna")
    client.set_password(sys.argv[2])
    async with client:
        methods = client.get_node("ns=2;s=fan-1/MethodSet")
        print(await methods.call_method("2:run_forward", 30.0), flush=True)
        await asyncio.sleep(600)

asyncio.run(main())
"""


@contextlib.contextmanager
def running_client(plant: Plant) -> Iterator[subprocess.Popen[str]]:
    """A process of its own that logs in over OPC UA, runs the motor and stays."""
    with subprocess.Popen(
        [sys.executable, "-c", RUNNER, plant.url, PASSWORD], stdout=subprocess.PIPE, text=True
    ) as client:
        try:
            assert client.stdout is not None
            assert "confirmed" in client.stdout.readline()
            yield client
        finally:
            client.kill()
