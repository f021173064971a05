"""Drives on real ports, for tests of the whole way from a client to the wire: a pty, or a TCP server.

The drives answer as `tests.line.bench.FakeUnit` does; framings are told here from the standards.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import pty
import struct
import tty
from collections.abc import Callable
from pathlib import Path

from tests.line.asciiunit import ascii_content, ascii_frame
from tests.line.bench import FakeUnit, frame

PROFILE = """\
profile: bench
title: Bench drive
maker: Nobody
models: [B]
version: 1
documents: {m: manual}
serial: {baud: [9600], rtu: [8N2, 8E1], ascii: [7E1, 7N2, 7O1], source: m, reply: 5ms..1s}
modbus: {functions: [03H, 06H, 10H], read_max: 16, write_max: 16, source: m}
groups:
  monitor:
    kind: measurement
    source: m
    rate: fast
    points:
      output_frequency: {at: 0024H, unit: 0.01 Hz}
  control:
    kind: setpoint
    source: m
    points:
      frequency_command: {at: 0002H, unit: 0.01 Hz, range: 0..60}
"""


def write_site(folder: Path, port: str, more: str = "framing: rtu, serial: 9600 8N2") -> Path:
    """A site with one bench drive at unit 5 on this port."""
    (folder / "bench.yaml").write_text(PROFILE)
    path = folder / "site.yaml"
    path.write_text(
        f"site: plant7\ngateway: gw1\nlines:\n  north: {{port: '{port}', {more}, drives: "
        f"{{fan-1: {{profile: bench, unit: 5, control: {{lease: off}}}}}}}}\n"
        "rates: {fast: 50ms}\nwrites: {enabled: true}\ndata: data\n"
    )
    return path


def rtu(unit: FakeUnit, data: bytes) -> tuple[bytes, bytes]:
    """The answer to the first request in ``data``, and what follows it."""
    for end in range(8, len(data) + 1):
        if frame(data[: end - 2]) == data[:end]:
            return unit.answer(data[:end]) or b"", data[end:]
    return b"", data


def ascii_(unit: FakeUnit, data: bytes) -> tuple[bytes, bytes]:
    """As `rtu`, for frames that end with CR LF."""
    line, end, rest = data.partition(b"\r\n")
    if not end:
        return b"", data
    reply = unit.answer(frame(ascii_content(line + end)))
    return (ascii_frame(reply[:-2]) if reply else b""), rest


def modbus_tcp(unit: FakeUnit, data: bytes) -> tuple[bytes, bytes]:
    """As `rtu`, for frames with the header of Modbus TCP."""
    if len(data) < 6 or len(data) < 6 + int.from_bytes(data[4:6], "big"):
        return b"", data
    number, protocol, length = struct.unpack(">HHH", data[:6])
    assert protocol == 0
    reply = unit.answer(frame(data[6 : 6 + length]))
    body = reply[:-2] if reply else b""
    head = struct.pack(">HHH", number, 0, len(body)) if body else b""
    return head + body, data[6 + length :]


Framing = Callable[[FakeUnit, bytes], tuple[bytes, bytes]]


class PtyDrive:
    """A drive on the far end of a pty, reached by a link that stays the same when it is plugged anew."""

    def __init__(self, link: Path, framing: Framing = rtu, echo: bool = False) -> None:
        self.unit = FakeUnit(registers={0x24: 6000}, functions=(3, 6, 16))
        self.link = link
        self.heard = b""
        """Every byte that came in."""
        self._framing = framing
        self._echo = echo
        self._buffer = b""
        self._far = -1

    def plug(self) -> None:
        """The drive is there."""
        self._far, near = pty.openpty()
        tty.setraw(near)
        os.set_blocking(self._far, False)
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(os.ttyname(near))
        os.close(near)
        asyncio.get_running_loop().add_reader(self._far, self._readable)

    def unplug(self) -> None:
        """It is gone, and the port with it."""
        if self._far >= 0:
            asyncio.get_running_loop().remove_reader(self._far)
            os.close(self._far)
            self.link.unlink()
            self._far = -1

    def _readable(self) -> None:
        try:
            data = os.read(self._far, 4096)
        except BlockingIOError:
            return
        except OSError:  # nobody has the near end open
            asyncio.get_running_loop().remove_reader(self._far)
            asyncio.get_running_loop().call_later(0.01, self._watch_again)
            return
        self.heard += data
        if self._echo:
            os.write(self._far, data)
        self._buffer += data
        reply, self._buffer = self._framing(self.unit, self._buffer)
        if reply:
            os.write(self._far, reply)

    def _watch_again(self) -> None:
        if self._far >= 0:
            asyncio.get_running_loop().add_reader(self._far, self._readable)


class TcpDrive:
    """A drive behind a TCP server on a free port; ``async with`` runs it."""

    def __init__(self, framing: Framing) -> None:
        self.unit = FakeUnit(registers={0x24: 6000}, functions=(3, 6, 16))
        self.port = 0
        self._framing = framing
        self._writers: list[asyncio.StreamWriter] = []

    async def __aenter__(self) -> TcpDrive:
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
        buffer = b""
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(4096):
                reply, buffer = self._framing(self.unit, buffer + data)
                writer.write(reply)
