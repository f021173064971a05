"""The line on a pty, in real time, talked to with plain file operations."""

from __future__ import annotations

import os
import select
import termios
from collections.abc import Iterator
from pathlib import Path
from time import monotonic

import pytest

from gateway.simulator import CorruptByte, Options, SimulatedLine, Trip
from tests.simulator.master import read, write
from tests.simulator.plant import FORMATS, line_config

TURNAROUND = 0.005
READ = read(0x0020, 5)
REPLY_LENGTH = 15
PATIENCE = 5.0
"""Seconds after which a test gives up on bytes that should have come long ago."""


class Port:
    """The master's end of the pty."""

    def __init__(self, path: Path) -> None:
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def close(self) -> None:
        os.close(self.fd)

    def collect(self, length: int, patience: float = PATIENCE) -> bytes:
        """As many bytes, or what came until patience ran out."""
        data, end = b"", monotonic() + patience
        while len(data) < length:
            readable, _, _ = select.select([self.fd], [], [], max(0.0, end - monotonic()))
            if not readable:
                break
            data += os.read(self.fd, 256)
        return data

    def exchange(self, request: bytes, length: int) -> tuple[bytes, float]:
        """The reply, and the seconds from before the write until its last byte."""
        start = monotonic()
        os.write(self.fd, request)
        reply = self.collect(length)
        return reply, monotonic() - start


def rest(line: SimulatedLine) -> None:
    """Keep the mandatory silence, whatever this machine does meanwhile."""
    line_free_at = line.log[-1].end if line.log else 0.0
    while monotonic() < line_free_at + 4 * line.silence:
        select.select([], [], [], 0.001)


@pytest.fixture
def line(tmp_path: Path) -> Iterator[SimulatedLine]:
    with SimulatedLine(line_config(units=(5, 6)), tmp_path) as running:
        yield running


@pytest.fixture
def port(line: SimulatedLine) -> Iterator[Port]:
    opened = Port(line.path)
    yield opened
    opened.close()


@pytest.mark.parametrize("form", ["8N1", "8N2", "8E1"])
@pytest.mark.parametrize("baud", [2400, 9600, 115200])
def test_replies_take_their_true_time(baud: int, form: str, tmp_path: Path) -> None:
    """Never faster than physics; and, when the machine lets it, no more than 2 ms slower."""
    character = FORMATS[form].bits_per_character / baud
    least = (len(READ) + REPLY_LENGTH) * character + max(TURNAROUND, 3.5 * character)
    taken = []
    with SimulatedLine(line_config(baud=baud, form=form), tmp_path) as line:
        port = Port(line.path)
        while len(taken) < 3 or (min(taken) > least + 0.002 and len(taken) < 20):
            reply, seconds = port.exchange(READ, REPLY_LENGTH)
            assert len(reply) == REPLY_LENGTH
            taken.append(seconds)
            rest(line)
        port.close()
    assert min(taken) >= least
    assert min(taken) <= least + 0.002


def test_section_11_on_the_wire(line: SimulatedLine, port: Port) -> None:
    request = bytes.fromhex("05 10 00 01 00 02 04 00 01 17 70 78 87")
    reply, _ = port.exchange(request, 8)
    assert reply == bytes.fromhex("05 10 00 01 00 02 11 8C")
    assert [str(frame) for frame in line.log] == [
        ">> 05 10 00 01 00 02 04 00 01 17 70 78 87",
        "<< 05 10 00 01 00 02 11 8C",
    ]
    assert line.drives["fan-5"].registers[0x0002] == 6000


def test_the_state_moves_while_nobody_asks(line: SimulatedLine, port: Port) -> None:
    port.exchange(write(0x0001, 1, 6000), 8)
    drive = line.drives["fan-5"]
    end = monotonic() + PATIENCE
    seen = set()
    while len(seen) < 4 and monotonic() < end:
        seen.add(drive.state.frequency)
    assert sorted(seen)[-1] > 0


def test_faults_can_be_injected_while_it_runs(line: SimulatedLine, port: Port) -> None:
    good, _ = port.exchange(read(0x0040, 1), 7)
    line.drives["fan-5"].faults.inject(CorruptByte(0, 0xFF))
    line.drives["fan-5"].post(Trip("fault_overcurrent"))
    rest(line)
    bad, _ = port.exchange(read(0x0040, 1), 7)
    assert bad == bytes((good[0] ^ 0xFF,)) + good[1:]
    rest(line)
    status, _ = port.exchange(read(0x0021, 1), 7)
    assert status[3:5] == b"\x00\x01"


def test_a_request_too_early_is_not_answered(tmp_path: Path) -> None:
    """At 600 baud the mandatory silence is 64 ms; only a machine that stalls that long must try again."""
    with SimulatedLine(line_config(baud=600), tmp_path) as line:
        port = Port(line.path)
        for _ in range(10):
            assert len(port.exchange(read(0x0040, 1), 7)[0]) == 7
            os.write(port.fd, read(0x0040, 1))
            late = port.collect(7, patience=0.6)
            if line.log[-1].direction == ">>":
                break
            rest(line)
        assert late == b""
        assert "ms of silence before it" in line.log[-1].note
        port.close()


def test_unplugged_and_plugged_in_again(tmp_path: Path) -> None:
    with SimulatedLine(line_config(), tmp_path) as line:
        port = Port(line.path)
        port.exchange(write(0x0002, 1234), 8)
        rest(line)
        line.close()
        assert not line.path.exists()
        with pytest.raises(OSError, match="Input/output error"):
            os.write(port.fd, READ)
        port.close()
        line.start()
        port = Port(line.path)
        reply, _ = port.exchange(read(0x0002, 1), 7)
        assert reply[3:5] == (1234).to_bytes(2, "big")
        port.close()
    assert not line.path.is_symlink()


def test_a_reader_that_never_comes_does_not_block_the_line(tmp_path: Path) -> None:
    """More replies than the terminal holds: the last request is answered on the wire like the first."""
    exchanges = 150
    with SimulatedLine(line_config(baud=115200), tmp_path, options={"fan-5": Options(turnaround=0)}) as line:
        port = Port(line.path)
        for count in range(1, exchanges + 1):
            os.write(port.fd, read(0x0200, 16))
            end = monotonic() + PATIENCE
            while len(line.log) < 2 * count and monotonic() < end:
                select.select([], [], [], 0.002)
            rest(line)
        assert len(line.log) == 2 * exchanges
        assert sum(len(frame.data) for frame in line.log if frame.direction == "<<") > 4096
        port.close()


def test_nothing_but_a_link_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "north").symlink_to(tmp_path / "gone")
    with SimulatedLine(line_config(), tmp_path) as line:
        assert line.path.exists()
    (tmp_path / "north").write_text("a file of yours")
    with pytest.raises(FileExistsError, match="no symbolic link"):
        SimulatedLine(line_config(), tmp_path).start()
    assert (tmp_path / "north").read_text() == "a file of yours"


def set_speed(fd: int, speed: int) -> None:
    settings = termios.tcgetattr(fd)
    settings[4] = settings[5] = speed
    termios.tcsetattr(fd, termios.TCSANOW, settings)


def test_no_drive_understands_another_speed(line: SimulatedLine, port: Port) -> None:
    set_speed(port.fd, termios.B19200)
    os.write(port.fd, READ)
    assert port.collect(1, patience=0.1) == b""
    assert line.log[-1].data != READ
    set_speed(port.fd, termios.B9600)
    rest(line)
    assert len(port.exchange(READ, REPLY_LENGTH)[0]) == REPLY_LENGTH


def test_a_line_that_is_not_strict_hears_any_speed(tmp_path: Path) -> None:
    with SimulatedLine(line_config(), tmp_path, strict=False) as line:
        port = Port(line.path)
        set_speed(port.fd, termios.B19200)
        assert len(port.exchange(READ, REPLY_LENGTH)[0]) == REPLY_LENGTH
        port.close()
