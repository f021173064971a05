"""Ports: bytes in, bytes out. A tty, or a network connection to one (or to a Modbus TCP device).

Opening may block (a USB adapter that hangs, a host that is not there) and is done off the event loop.
Nothing here waits for silence or counts time: `gateway.line.line` does.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import socket
import termios
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, runtime_checkable
from urllib.parse import urlsplit

import serial
from serial.rs485 import RS485Settings

from gateway.mapping.site import LineConfig, Rs485

CONNECT_TIMEOUT = 3.0
"""Seconds until a host that does not answer is given up."""
CHUNK = 4096

Received = Callable[[bytes, float], None]
"""Told what came in, and when (monotonic, seconds) it was there at the latest."""
Lost = Callable[[str], None]


class PortError(OSError):
    """The port cannot be opened; the message says why."""


class Port(Protocol):
    """An open port."""

    def attach(self, received: Received, lost: Lost) -> None:
        """Tell what comes in, and once when the port vanishes; on the running loop."""
        ...

    def write(self, data: bytes) -> None:
        """Hand bytes to the wire without waiting. Raises `OSError` when they are not all taken."""
        ...

    def close(self) -> None:
        """Give the port back. Nothing is told any more."""
        ...


@runtime_checkable
class Prompt(Protocol):
    """A loop that lets a file be read as soon as it wakes, before the turn of its callback comes."""

    def read_at_once(self, descriptor: int, read: Callable[[], None] | None) -> None:
        """Call ``read`` whenever the file is readable, until told None."""
        ...


class FilePort:
    """A port behind a file descriptor that never blocks.

    A line is silent from when the last byte came in. On a `Prompt` loop that is noted at once, and what the
    loop has to do before our turn comes does not make the silence longer.
    """

    def __init__(self, descriptor: int, close: Callable[[], None]) -> None:
        self._descriptor = descriptor
        self._close = close
        self._loop: asyncio.AbstractEventLoop | None = None
        self._came: deque[tuple[bytes | OSError, float]] = deque()

    def attach(self, received: Received, lost: Lost) -> None:
        """Watch the descriptor on the running loop."""
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._descriptor, self._readable, received, lost)
        if isinstance(self._loop, Prompt):
            self._loop.read_at_once(self._descriptor, self._read)

    def write(self, data: bytes) -> None:
        """Write all or raise: the rest of a frame after a pause would be another frame."""
        if os.write(self._descriptor, data) != len(data):
            raise PortError("the port does not take a whole frame")

    def close(self) -> None:
        """Stop watching and close."""
        self._ignore()
        self._close()

    def _read(self) -> None:
        came: bytes | OSError
        try:
            came = os.read(self._descriptor, CHUNK)
        except BlockingIOError:
            return
        except OSError as error:
            came = error
        self._came.append((came, time.monotonic()))

    def _readable(self, received: Received, lost: Lost) -> None:
        if not self._came:
            self._read()
        while self._came and self._loop is not None:
            came, at = self._came.popleft()
            if isinstance(came, OSError):
                self._vanished(lost, came.strerror or str(came))
            elif came:
                received(came, at)
            else:
                self._vanished(lost, "the other side hung up")

    def _vanished(self, lost: Lost, reason: str) -> None:
        self._ignore()
        lost(reason)

    def _ignore(self) -> None:
        if self._loop is not None:
            self._loop.remove_reader(self._descriptor)
            if isinstance(self._loop, Prompt):
                self._loop.read_at_once(self._descriptor, None)
            self._loop = None


async def open_port(line: LineConfig) -> Port:
    """Open a line's port. Raises `PortError`, which says what is in the way."""
    scheme = urlsplit(line.port).scheme
    if scheme in ("tcp", "modbus"):
        return await _in_thread(lambda: open_tcp(line.port))
    if scheme == "simulated":
        raise PortError("a simulated line has no port of its own: give it one with --line, or run the demo")
    return await _in_thread(lambda: open_serial(line))


def open_serial(line: LineConfig) -> FilePort:
    """Open a tty for this gateway alone and set it up. Blocks as long as the driver does."""
    try:
        device = _configured(line)
    except (serial.SerialException, termios.error, ValueError, OSError) as error:
        raise PortError(f"{line.port}: {_plainly(error)}") from error
    with contextlib.suppress(ValueError):  # only some drivers have it, and it only makes things faster
        device.set_low_latency_mode(True)
    return FilePort(device.fileno(), device.close)


def _plainly(error: Exception) -> str:
    """What went wrong, once: some errors name the port and the reason again in their text."""
    number = error.errno if isinstance(error, OSError) else None
    if number in (errno.EAGAIN, errno.EBUSY):
        return "busy: another program has it open"
    return str(error) if number is None or number < 0 else os.strerror(number)


def open_tcp(url: str) -> FilePort:
    """Connect to ``tcp://host:port`` or ``modbus://host:port``. Blocks up to `CONNECT_TIMEOUT`."""
    parts = urlsplit(url)
    try:
        address = parts.hostname or "", parts.port or 502
        connection = socket.create_connection(address, CONNECT_TIMEOUT)
    except (OSError, ValueError) as error:
        raise PortError(f"{url}: {_plainly(error)}") from error
    connection.setblocking(False)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    return FilePort(connection.fileno(), connection.close)


def _configured(line: LineConfig) -> serial.Serial:
    # a pseudo terminal has no characters of 7 bits and no parity, and the second one to ask is refused
    plain = is_pseudo_terminal(line.port)
    device = serial.Serial(
        port=line.port,
        baudrate=line.baud,
        bytesize=8 if plain else line.format.data_bits,
        parity="N" if plain else line.format.parity,
        stopbits=line.format.stop_bits,
        timeout=0,
        exclusive=True,
    )
    try:
        if line.rs485.rts != "none":
            _switch_direction(device, line.rs485)
        _tell_hang_up_from_silence(device.fileno())
        device.reset_input_buffer()
    except BaseException:
        device.close()
        raise
    return device


def _switch_direction(device: serial.Serial, rs485: Rs485) -> None:
    """Let the driver raise or lower RTS while it sends."""
    try:
        device.rs485_mode = RS485Settings(
            rts_level_for_tx=rs485.rts == "send_high",
            rts_level_for_rx=rs485.rts == "send_low",
            loopback=rs485.echo,
        )
    except (OSError, ValueError) as error:
        raise ValueError(
            "this port cannot switch the direction by RTS; an adapter that does it by itself needs no "
            "`rs485: {rts: ...}`"
        ) from error


def is_pseudo_terminal(path: str) -> bool:
    """Simulated lines are pseudo terminals: they carry whole bytes and refuse to be set to fewer bits."""
    return Path(path).resolve().is_relative_to("/dev/pts")


def _tell_hang_up_from_silence(descriptor: int) -> None:
    """With VMIN 1 an empty read means that the device is gone; with 0 it may mean that nothing came."""
    settings = termios.tcgetattr(descriptor)
    settings[6][termios.VMIN] = 1
    termios.tcsetattr(descriptor, termios.TCSANOW, settings)


async def _in_thread(opening: Callable[[], FilePort]) -> Port:
    """Run a blocking open in a thread of its own, which an open that hangs may keep for ever.

    Not an executor: leaving the program would wait for its threads.
    """
    loop = asyncio.get_running_loop()
    done: asyncio.Future[Port] = loop.create_future()

    def deliver(port: FilePort | None, error: BaseException | None) -> None:
        if done.cancelled():
            if port is not None:
                port.close()
        elif port is not None:
            done.set_result(port)
        elif error is not None:
            done.set_exception(error)

    def work() -> None:
        port, failure = None, None
        try:
            port = opening()
        except Exception as error:
            failure = error
        try:
            loop.call_soon_threadsafe(deliver, port, failure)
        except RuntimeError:  # the loop is gone; so is whoever wanted the port
            if port is not None:
                port.close()

    threading.Thread(target=work, name="open port", daemon=True).start()
    return await done
