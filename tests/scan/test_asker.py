"""The port of a scan, on simulated lines in real time: silences, echo, strangers, other speeds."""

from __future__ import annotations

import asyncio
import os
import socket
import threading
from pathlib import Path

import pytest

from gateway.line.port import PortError
from gateway.scan.asker import Asker
from gateway.scan.order import Narrowed, Plan, PortKind, make_plan
from gateway.scan.search import Found, Report, search
from gateway.simulator import SimulatedLine
from gateway.simulator.faults import CorruptByte
from gateway.simulator.wire import WireFrame
from tests.scan.lines import line_of, profiles


def plan(
    *units: int, bauds: tuple[int, ...] = (9600,), port: PortKind = "pseudo", patience: float = 1.0
) -> Plan:
    return make_plan(profiles(), Narrowed(("rtu",), bauds, (), units), patience, port)


async def scanned(path: str | Path, whole: Plan) -> tuple[Report, list[Found], Asker]:
    report, told, asker = Report(), [], Asker(str(path))
    await asker.run(search(whole, report), told.append, lambda: None)
    return report, told, asker


def spoiled(line: SimulatedLine) -> list[WireFrame]:
    return [frame for frame in line.log if frame.note]


async def test_drives_are_found_and_every_silence_is_kept(tmp_path: Path) -> None:
    with SimulatedLine(line_of("9600 8N2", [("teco-7200gs", 2), ("teco-7200gs", 3)]), tmp_path) as line:
        report, told, asker = await scanned(line.path, plan(1, 2, 3))
        assert spoiled(line) == []
    assert [(found.unit, found.likely[0].profile.name) for found in told] == [
        (2, "teco-7200gs"),
        (3, "teco-7200gs"),
    ]
    assert told == report.found
    assert all(0.004 <= found.answer.seconds < 1.0 for found in told)
    assert asker.strangers == 0


async def test_the_right_speed_is_found(tmp_path: Path) -> None:
    with SimulatedLine(line_of("4800 8N1", [("s2000", 1)]), tmp_path) as line:
        report, _, _ = await scanned(line.path, plan(1, bauds=(9600, 4800, 2400)))
    assert [(found.setting.baud, found.likely[0].profile.name) for found in report.found] == [(4800, "s2000")]


async def test_an_adapter_that_echoes_finds_nobody_who_is_not_there(tmp_path: Path) -> None:
    """A loop-back's request looks like its reply: our own echo must not be taken for a drive."""
    with SimulatedLine(line_of("9600 8N2", [("shihlin-sl3", 2)], echo=True), tmp_path) as line:
        report, _, _ = await scanned(line.path, plan(1, 2, 3))
    assert [(found.unit, found.likely[0].profile.name) for found in report.found] == [(2, "shihlin-sl3")]
    assert report.unclear == []


async def test_a_damaged_reply_is_unclear(tmp_path: Path) -> None:
    with SimulatedLine(line_of("9600 8N2", [("teco-7200gs", 2)]), tmp_path) as line:
        line.drives["drive-2"].faults.inject(CorruptByte(), times=None)
        report, _, _ = await scanned(line.path, plan(2))
    assert {unit for _, unit in report.unclear} == {2}


async def test_strangers_are_noticed_and_waited_for(tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    os.set_blocking(ours, False)
    stop = threading.Event()

    def babble() -> None:
        while not stop.wait(0.002):
            os.write(ours, b"\x55")

    talker = threading.Thread(target=babble)
    talker.start()
    try:
        report, _, asker = await scanned(os.ttyname(theirs), plan(1, patience=0.05))
    finally:
        stop.set()
        talker.join()
        os.close(ours)
        os.close(theirs)
    assert report.found == []
    assert asker.strangers > 10


async def test_a_port_that_vanishes_is_told(tmp_path: Path) -> None:
    line = SimulatedLine(line_of("9600 8N2", [("teco-7200gs", 1)]), tmp_path)
    line.start()
    whole, report, asker = plan(7, 8, 9, patience=1.0), Report(), Asker(str(line.path))
    scan = asyncio.create_task(asker.run(search(whole, report), lambda found: None, lambda: None))
    async with asyncio.timeout(10):
        while report.asked < 1:
            await asyncio.sleep(0.01)
        line.close()
        with pytest.raises(PortError, match="is gone: "):
            await scan


async def test_units_behind_a_network_port(tmp_path: Path) -> None:
    """A serial server: RTU frames over TCP, the drives of a pty behind it."""
    with SimulatedLine(line_of("9600 8N2", [("teco-7200gs", 2)]), tmp_path) as line:
        server = await asyncio.start_server(lambda r, w: pump(line, r, w), "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        report, _, _ = await scanned(
            f"tcp://127.0.0.1:{port}", make_plan(profiles(), Narrowed(("rtu",), units=(1, 2)), 0.5, "network")
        )
        server.close()
    assert [(f.unit, str(f.setting), f.likely[0].profile.name) for f in report.found] == [
        (2, "rtu", "teco-7200gs")
    ]


async def pump(line: SimulatedLine, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Pass bytes between a connection and a line."""
    fd = os.open(line.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    loop = asyncio.get_running_loop()
    loop.add_reader(fd, lambda: writer.write(os.read(fd, 256)))
    try:
        while data := await reader.read(256):
            os.write(fd, data)
    finally:
        loop.remove_reader(fd)
        os.close(fd)
        writer.close()


async def test_nobody_listens_at_a_network_port() -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
        with pytest.raises(PortError):
            await scanned(f"modbus://127.0.0.1:{port}", make_plan(profiles(), Narrowed(), 0.5, "modbus"))
