"""The whole gateway on emulated lines (supervisor, core, adapters, broker), and its clients."""

from __future__ import annotations

import contextlib
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.limit.plant import PASSWORD, PERIOD, SITE, USER, Plant, points, write_site
from benchmarks.limit.talk import ROOT, Client
from benchmarks.wire.control import Wire
from gateway.broker import EmbeddedBroker

ITEMS = 2000
START_SECONDS = 300.0


@dataclass(slots=True)
class Running:
    """A gateway at work, its wire and its clients."""

    plant: Plant
    wire: Wire
    opcua: Client
    mqtt: Client
    process: int


@contextlib.contextmanager
def running(plant: Plant, keep: Path | None = None) -> Iterator[Running]:
    """Run the gateway of a plant until the context ends; ``keep`` is a folder for its files and log."""
    with contextlib.ExitStack() as stack:
        folder = keep or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="line-limit-")))
        wire = stack.enter_context(Wire([plant.wire(name) for name in plant.names]))
        opcua, mqtt = free_port(), free_port()
        broker = EmbeddedBroker(port=mqtt, folder=folder / "broker")
        stack.enter_context(program(broker.command(), folder / "broker.log"))
        wait_for(mqtt)
        site = write_site(folder, plant, opcua, f"mqtt://127.0.0.1:{mqtt}")
        ports = [word for name, port in wire.ports.items() for word in ("--line", f"{name}={port}")]
        argv = [sys.executable, "-m", "gateway", "run", str(site), *ports]
        process = stack.enter_context(program(argv, folder / "gateway.log"))
        wait_for(opcua, process, folder / "gateway.log")
        items = stack.enter_context(
            Client(
                "opcua_client",
                url=f"opc.tcp://127.0.0.1:{opcua}",
                user=USER,
                password=PASSWORD,
                tags=items_of(plant),
                interval=PERIOD * 1000,
            )
        )
        spy = stack.enter_context(Client("mqtt_client", site=SITE, port=mqtt))
        items.hear()
        spy.hear()
        yield Running(plant, wire, items, spy, process.pid)


def items_of(plant: Plant) -> list[str]:
    """Tags for the monitored items: all drives alike, tags more than once where there are too few."""
    tags = [f"{drive}.{point}" for point in points() for drive in plant.all_drives]
    return [tags[number % len(tags)] for number in range(ITEMS)]


@contextlib.contextmanager
def program(argv: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A program that is ended in order."""
    with log.open("wb") as file, subprocess.Popen(argv, cwd=ROOT, stderr=file, stdout=file) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()


def free_port() -> int:
    """A port of loopback that is free at this moment."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for(port: int, program: subprocess.Popen[bytes] | None = None, log: Path | None = None) -> None:
    """Return when somebody listens. Raises `TimeoutError`; `RuntimeError` with the log when the program ended
    that was to listen."""
    limit = time.monotonic() + START_SECONDS
    while time.monotonic() < limit:
        if program is not None and program.poll() is not None:
            raise RuntimeError(log.read_text(encoding="utf-8") if log else "it ended")
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
            return
        time.sleep(0.05)
    raise TimeoutError(f"nobody listens on port {port}")
