"""A line on real ttys and sockets: what virtual time cannot show."""

from __future__ import annotations

import asyncio
import contextlib
import os
import pty
import socket
import struct
import tty
from collections.abc import AsyncIterator, Callable, Sequence
from pathlib import Path

import pytest

from gateway.line.interface import (
    Action,
    Answered,
    BlockRead,
    Job,
    JobDone,
    LineSettings,
    Priority,
    Unsent,
    Want,
    Write,
)
from gateway.line.line import Line
from gateway.line.master import LineMaster
from gateway.line.port import Port, PortError, open_port
from gateway.mapping.profile import SerialFormat
from gateway.mapping.site import LineConfig, Rs485
from tests.line.bench import FakeUnit, facts

PATIENCE = 20.0
F8N2 = SerialFormat(8, "N", 2)
WANT = Want(5, 0x24, 1, 0.05)


def config(port: str, form: SerialFormat = F8N2, framing: str = "rtu") -> LineConfig:
    return LineConfig(
        name="north",
        port=port,
        framing=framing,
        baud=9600,
        format=form,
        rs485=Rs485(),
        drives=(),  # type: ignore[arg-type]
    )


class Drive:
    """A drive on the far end of a pty, reached by a link that stays the same when it is plugged anew."""

    def __init__(self, link: Path) -> None:
        self.unit = FakeUnit(registers={0x24: 6000})
        self.link = link
        self._buffer = b""
        self._far = -1

    def plug(self) -> None:
        self._far, near = pty.openpty()
        tty.setraw(near)
        os.set_blocking(self._far, False)
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(os.ttyname(near))
        os.close(near)
        asyncio.get_running_loop().add_reader(self._far, self._readable)

    def unplug(self) -> None:
        if self._far >= 0:
            asyncio.get_running_loop().remove_reader(self._far)
            os.close(self._far)
            self.link.unlink()
            self._far = -1

    def _readable(self) -> None:
        try:
            self._buffer += os.read(self._far, 4096)
        except BlockingIOError:
            return
        except OSError:  # nobody has the near end open
            asyncio.get_running_loop().remove_reader(self._far)
            asyncio.get_running_loop().call_later(0.01, self._watch_again)
            return
        self._answer()

    def _watch_again(self) -> None:
        if self._far >= 0:
            asyncio.get_running_loop().add_reader(self._far, self._readable)

    def _answer(self) -> None:
        for end in range(4, len(self._buffer) + 1):
            if (reply := self.unit.answer(self._buffer[:end])) is not None:
                self._buffer = self._buffer[end:]
                os.write(self._far, reply)
                return


class Listener:
    """Collects actions; `until` waits for a condition on them."""

    def __init__(self) -> None:
        self.actions: list[Action] = []
        self._changed = asyncio.Event()

    def __call__(self, actions: Sequence[Action]) -> None:
        self.actions += actions
        self._changed.set()

    def reads(self) -> int:
        return sum(isinstance(action, BlockRead) for action in self.actions)

    def result(self, job_id: int) -> object:
        return next((a.result for a in self.actions if isinstance(a, JobDone) and a.id == job_id), None)

    async def until(self, condition: Callable[[], object]) -> None:
        async with asyncio.timeout(PATIENCE):
            while not condition():
                self._changed.clear()
                await self._changed.wait()


@pytest.fixture
async def drive(tmp_path: Path) -> AsyncIterator[Drive]:
    drive = Drive(tmp_path / "tty")
    drive.plug()
    yield drive
    drive.unplug()


def settings(framing: str = "rtu") -> LineSettings:
    return LineSettings(name="north", framing=framing, baud=9600, format=F8N2)  # type: ignore[arg-type]


@contextlib.asynccontextmanager
async def running(port: str, framing: str = "rtu") -> AsyncIterator[tuple[LineMaster, Listener]]:
    listener = Listener()
    master = LineMaster(Line(settings(framing), [facts()]), lambda: open_port(config(port)), listener)
    master.demand([WANT])
    master.start()
    try:
        yield master, listener
    finally:
        master.stop()


async def test_reads_and_writes_on_a_tty(drive: Drive) -> None:
    async with running(str(drive.link)) as (master, heard):
        await heard.until(lambda: heard.reads() >= 3)
        assert {a.words for a in heard.actions if isinstance(a, BlockRead)} == {(6000,)}
        master.ask(Job(1, Write(5, 1, (1, 3000)), Priority.COMMAND))
        await heard.until(lambda: heard.result(1))
        assert heard.result(1) == Answered()
        assert drive.unit.writes == [(1, (1, 3000))]


async def test_unplugged_and_plugged_again(drive: Drive) -> None:
    async with running(str(drive.link)) as (master, heard):
        await heard.until(lambda: heard.reads() >= 2)
        drive.unplug()
        await heard.until(lambda: not master.line.is_open)
        assert master.line.down_reason
        master.ask(Job(1, Write(5, 1, (0,)), Priority.STOP))
        assert heard.result(1) == Unsent("line_down")
        drive.plug()
        before = heard.reads()
        await heard.until(lambda: heard.reads() >= before + 3)
        assert master.line.is_open
        assert drive.unit.writes == []


async def test_a_port_that_is_not_there_is_tried_again(tmp_path: Path) -> None:
    drive = Drive(tmp_path / "tty")
    async with running(str(drive.link)) as (master, heard):
        await heard.until(lambda: "tty" in master.line.down_reason)
        drive.plug()
        await heard.until(lambda: heard.reads() >= 2)
    drive.unplug()


async def test_stop_gives_the_port_back(drive: Drive) -> None:
    async with running(str(drive.link)) as (master, heard):
        await heard.until(lambda: heard.reads() >= 1)
        with pytest.raises(PortError, match="lock"):
            await open_port(config(str(drive.link)))
        master.stop()
        (await open_port(config(str(drive.link)))).close()
        reads = heard.reads()
        await asyncio.sleep(0.15)
        assert heard.reads() == reads


@pytest.mark.parametrize(
    "form", [SerialFormat(7, "E", 1), SerialFormat(8, "E", 1), SerialFormat(8, "O", 1)], ids=str
)
async def test_any_character_format_opens_on_a_simulated_line(drive: Drive, form: SerialFormat) -> None:
    (await open_port(config(str(drive.link), form))).close()


async def test_withdraw_and_stop_tell_everyone(drive: Drive) -> None:
    async with running(str(drive.link)) as (master, heard):
        await heard.until(lambda: heard.reads() >= 1)
        drive.unit.on = False
        for job_id in (1, 2, 3):
            master.ask(Job(job_id, Write(5, 1, (0,)), Priority.COMMAND))
        assert master.withdraw(3) is True
        master.stop()
        assert heard.result(1) is not None
        assert heard.result(2) == Unsent("line_down")
        assert heard.result(3) is None


async def test_an_open_that_hangs_stalls_nothing() -> None:
    never: asyncio.Future[Port] = asyncio.get_running_loop().create_future()

    async def hang() -> Port:
        return await never

    listener = Listener()
    master = LineMaster(Line(settings(), [facts()]), hang, listener)
    master.start()
    await asyncio.sleep(0)
    master.ask(Job(1, Write(5, 1, (0,)), Priority.STOP))
    assert listener.result(1) == Unsent("line_down")
    master.stop()
    await asyncio.sleep(0)
    assert never.cancelled()


class Server:
    """A TCP server on a free port whose connections are all closed at the end."""

    def __init__(self, size: int, answer: Callable[[bytes], bytes]) -> None:
        self._size = size
        self._answer = answer
        self._writers: list[asyncio.StreamWriter] = []
        self.port = 0

    async def __aenter__(self) -> Server:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def __aexit__(self, *_: object) -> None:
        self._server.close()
        await self.drop()

    async def drop(self) -> None:
        """Close all connections."""
        for writer in self._writers:
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()
        self._writers.clear()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.append(writer)
        with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
            while True:
                writer.write(self._answer(await reader.readexactly(self._size)))


def modbus_tcp_reply(request: bytes) -> bytes:
    number, _, _, unit, function, _, count = struct.unpack(">HHHBBHH", request)
    head = struct.pack(">HHHBBB", number, 0, 3 + 2 * count, unit, function, 2 * count)
    return head + bytes((0, 7)) * count


async def test_rtu_over_tcp() -> None:
    unit = FakeUnit(registers={0x24: 50})
    server = Server(8, lambda request: unit.answer(request) or b"")
    async with server, running(f"tcp://127.0.0.1:{server.port}") as (_, heard):
        await heard.until(lambda: heard.reads() >= 3)
        assert {a.words for a in heard.actions if isinstance(a, BlockRead)} == {(50,)}


async def test_modbus_tcp_and_a_server_that_goes_away() -> None:
    server = Server(12, modbus_tcp_reply)
    async with server, running(f"modbus://127.0.0.1:{server.port}", "tcp") as (master, heard):
        await heard.until(lambda: heard.reads() >= 2)
        await server.drop()
        await heard.until(lambda: not master.line.is_open)
        before = heard.reads()
        await heard.until(lambda: heard.reads() > before)
        assert {a.words for a in heard.actions if isinstance(a, BlockRead)} == {(7,)}


async def test_refusals_say_why(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        closed = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(PortError, match="refused"):
            await open_port(config(closed))
    with pytest.raises(PortError, match="--line"):
        await open_port(config("simulated:"))
    plain = tmp_path / "file"
    plain.write_text("")
    with pytest.raises(PortError, match="file"):
        await open_port(config(str(plain)))
