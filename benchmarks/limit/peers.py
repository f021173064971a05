"""Others on the same wire: what the machine gives to a loop that does nothing else, and what a client library
reaches with its default settings.

``python -m benchmarks.limit.peers NAME`` takes one JSON object on standard input and runs until killed.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
import tty
from dataclasses import asdict, dataclass
from typing import Any

from benchmarks.limit.ideal import Block, best_blocks
from benchmarks.limit.measure import use_from
from benchmarks.limit.plant import REGISTERS, Plant
from benchmarks.limit.talk import ROOT
from benchmarks.wire.control import Wire
from benchmarks.wire.frames import READ, checked

SPIN = 100e-6
PATIENCE = 0.2

Row = dict[str, Any]


@dataclass(slots=True)
class Port:
    """What the bare loop knows of a line: reads to make, one after another, and the one on the wire."""

    reads: list[tuple[bytes, int]]
    free_at: float
    number: int = 0
    missing: int = 0
    until: float = 0.0

    def due(self) -> float:
        """When something is to be done, if nothing comes in."""
        return self.until if self.missing else self.free_at


def bare_loop(ports: list[str], baud: int, silence: float, units: list[int], blocks: list[Block]) -> None:
    """Reads as fast as Python can: nothing is decoded, checked, planned or told to anybody."""
    from gateway.core.loop import go_first, stay_awake

    go_first()
    stay_awake()
    gc.disable()
    reads = [(request(unit, block), 5 + 2 * block.count) for unit in units for block in blocks]
    lines: dict[int, Port] = {}
    for path in ports:
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(descriptor)
        lines[descriptor] = Port(reads, time.monotonic() + silence)
    while True:
        wait = min(port.due() for port in lines.values()) - time.monotonic() - SPIN
        ready, _, _ = select.select(list(lines), (), (), max(0.0, wait))
        for descriptor in ready:
            port = lines[descriptor]
            port.missing -= len(os.read(descriptor, 4096))
            port.free_at = time.monotonic() + silence
        for descriptor, port in lines.items():
            if time.monotonic() >= port.due():
                data, port.missing = port.reads[port.number % len(port.reads)]
                port.number += 1
                port.until = time.monotonic() + PATIENCE
                os.write(descriptor, data)


def pymodbus(ports: list[str], baud: int, silence: float, units: list[int], blocks: list[Block]) -> None:
    """The client of pymodbus, one thread per line, as its examples use it."""
    from pymodbus import ModbusException
    from pymodbus.client import ModbusSerialClient

    def poll(path: str) -> None:
        client = ModbusSerialClient(path, baudrate=baud)
        client.connect()
        while True:
            for unit in units:
                for block in blocks:
                    with contextlib.suppress(ModbusException):
                        client.read_holding_registers(block.address, count=block.count, device_id=unit)

    for path in ports[1:]:
        threading.Thread(target=poll, args=(path,), daemon=True).start()
    poll(ports[0])


def request(unit: int, block: Block) -> bytes:
    """The frame that asks for a block."""
    return checked(bytes((unit, READ)) + block.address.to_bytes(2, "big") + block.count.to_bytes(2, "big"))


PEERS = {"bare": bare_loop, "pymodbus": pymodbus}


def measure_peer(name: str, plant: Plant, settle: float, seconds: float) -> Row:
    """The use that a peer makes of the lines of a plant."""
    wires = [plant.wire(line) for line in plant.names]
    blocks = best_blocks(REGISTERS, wires[0])
    with Wire(wires) as wire:
        task = {
            "ports": list(wire.ports.values()),
            "baud": plant.baud,
            "silence": wires[0].silence,
            "units": wires[0].units,
            "blocks": [asdict(block) for block in blocks],
        }
        argv = [sys.executable, "-m", "benchmarks.limit.peers", name]
        with subprocess.Popen(argv, cwd=ROOT, stdin=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdin is not None
                process.stdin.write(json.dumps(task))
                process.stdin.close()
                time.sleep(settle)
                wire.count()
                time.sleep(seconds)
                used = asdict(use_from(plant, wire.tally()))
            finally:
                process.send_signal(signal.SIGKILL)
    return {**used, "wanted": "a peer", "reached": True}


if __name__ == "__main__":
    given = json.loads(sys.stdin.read())
    given["blocks"] = [Block(**block) for block in given["blocks"]]
    PEERS[sys.argv[1]](**given)
