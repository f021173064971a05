"""Ports: how a tty is set up, and why one cannot be opened."""

from __future__ import annotations

import contextlib
import os
import pty
import socket
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest
import serial
from serial.rs485 import RS485Settings

from gateway.line.port import PortError, open_port, open_serial
from gateway.mapping.profile import SerialFormat
from gateway.mapping.site import LineConfig, Rs485

F8N2 = SerialFormat(8, "N", 2)


def config(port: str, form: SerialFormat = F8N2, baud: int = 9600, rs485: Rs485 | None = None) -> LineConfig:
    return LineConfig(
        name="north", port=port, framing="rtu", baud=baud, format=form, rs485=rs485 or Rs485(), drives=()
    )


@pytest.fixture
def near() -> Iterator[int]:
    """The near end of a pty."""
    far, near = pty.openpty()
    tty.setraw(near)
    yield near
    os.close(far)
    os.close(near)


class FakeSerial:
    """Takes what pyserial's `Serial` takes, and remembers it; its descriptor is a real tty."""

    near: ClassVar[int]
    refuses_rs485: ClassVar[bool] = False
    made: ClassVar[list[FakeSerial]] = []

    def __init__(self, **settings: Any) -> None:
        self.settings = settings
        self.direction: RS485Settings | None = None
        self.calls: list[str] = []
        self.made.append(self)

    @property
    def rs485_mode(self) -> RS485Settings | None:
        return self.direction

    @rs485_mode.setter
    def rs485_mode(self, mode: RS485Settings) -> None:
        if self.refuses_rs485:
            raise ValueError("Failed to set RS485 mode")
        self.direction = mode

    def fileno(self) -> int:
        return self.near

    def reset_input_buffer(self) -> None:
        self.calls.append("reset")

    def set_low_latency_mode(self, on: bool) -> None:
        self.calls.append(f"low latency {on}")

    def close(self) -> None:
        self.calls.append("close")


@pytest.fixture
def device(near: int, monkeypatch: pytest.MonkeyPatch) -> type[FakeSerial]:
    """The kind of device that opens from now on."""
    kind = type("Device", (FakeSerial,), {"near": near, "made": []})
    monkeypatch.setattr(serial, "Serial", kind)
    return kind


@pytest.mark.parametrize(
    "form", [SerialFormat(7, "E", 1), SerialFormat(7, "N", 2), SerialFormat(7, "O", 1), F8N2], ids=str
)
def test_speed_and_format_reach_the_device(device: type[FakeSerial], form: SerialFormat) -> None:
    open_serial(config("/dev/ttyUSB7", form, 19200))
    [made] = device.made
    assert made.settings == {
        "port": "/dev/ttyUSB7",
        "baudrate": 19200,
        "bytesize": form.data_bits,
        "parity": form.parity,
        "stopbits": form.stop_bits,
        "timeout": 0,
        "exclusive": True,
    }
    assert made.direction is None, "the driver's own choice unless the site says otherwise"
    assert made.calls == ["reset", "low latency True"]


@pytest.mark.parametrize("echo", [True, False])
@pytest.mark.parametrize(("rts", "sending"), [("send_high", True), ("send_low", False)])
def test_rts_modes(device: type[FakeSerial], rts: Any, sending: bool, echo: bool) -> None:
    open_serial(config("/dev/ttyS1", rs485=Rs485(echo=echo, rts=rts)))
    mode = device.made[0].direction
    assert mode is not None
    assert (mode.rts_level_for_tx, mode.rts_level_for_rx) == (sending, not sending)
    assert mode.loopback is echo


def test_a_device_that_refuses_rts_is_closed_again(device: type[FakeSerial]) -> None:
    device.refuses_rs485 = True
    with pytest.raises(PortError, match=r"/dev/ttyS1: this port cannot switch the direction by RTS"):
        open_serial(config("/dev/ttyS1", rs485=Rs485(rts="send_high")))
    assert device.made[0].calls == ["close"]


def test_a_pty_refuses_rts(near: int) -> None:
    with pytest.raises(PortError, match="cannot switch the direction by RTS"):
        open_serial(config(os.ttyname(near), rs485=Rs485(rts="send_low")))
    open_serial(config(os.ttyname(near))).close()


@pytest.mark.parametrize(
    "form", [SerialFormat(7, "E", 1), SerialFormat(8, "E", 1), SerialFormat(8, "O", 1)], ids=str
)
async def test_any_character_format_opens_on_a_simulated_line(near: int, form: SerialFormat) -> None:
    (await open_port(config(os.ttyname(near), form))).close()


async def test_a_simulated_line_with_parity_opens_again_and_again(near: int) -> None:
    for _ in range(3):
        (await open_port(config(os.ttyname(near), SerialFormat(7, "E", 1)))).close()


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


def test_why_a_port_cannot_be_opened_is_said_once() -> None:
    with pytest.raises(PortError, match=r"^/dev/nothing-there: No such file or directory$"):
        open_serial(config("/dev/nothing-there"))


def test_a_port_that_somebody_else_has_is_busy(near: int) -> None:
    name = os.ttyname(near)
    with contextlib.closing(open_serial(config(name))), pytest.raises(PortError, match=f"^{name}: busy"):
        open_serial(config(name))
