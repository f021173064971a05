"""The SL3 on the wire, in ASCII and RTU: the printed frames, when a frame ends, what is damaged, and time."""

from __future__ import annotations

import os
import select
from dataclasses import replace
from pathlib import Path
from time import monotonic

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.mapping.profile import SerialFormat
from gateway.mapping.site import LineConfig
from gateway.simulator import SimulatedLine, UnsupportedError
from gateway.simulator.ascii import seal, unseal
from gateway.simulator.build import build_drives, wire_timing
from gateway.simulator.frame import DamagedError
from gateway.simulator.line import Line
from tests.simulator.makes import line_of, s2000, sl3

TAKE = b":010610000000E9\r\n"
ASK, ANSWER = b":010300A2000159\r\n", b":010302FFFFFC\r\n"
RTU_ASK = bytes.fromhex("01 03 00 A2 00 01 25 E8")
RTU_ANSWER = bytes.fromhex("01 03 02 FF FF B9 F4")
TURNAROUND = 0.005
GAP = 0.010
ASCII_CHARACTER, RTU_CHARACTER = 10 / 9600, 11 / 9600
"""7E1 and 8E1."""


class Wire:
    """A line with a hand on the clock."""

    def __init__(self, framing: str = "ascii", config: LineConfig | None = None) -> None:
        config = config or line_of(sl3(), framing=framing)
        self.drives = build_drives(config, {})
        self.line = Line(wire_timing(config), self.drives.values())
        self.now = 100.0
        self.got = b""
        self.last_at = 0.0

    def send(self, data: bytes) -> float:
        self.line.receive(data, self.now)
        return self.now

    def wait(self, seconds: float) -> None:
        end = self.now + seconds
        while (due := self.line.due()) <= end:
            self._look(max(due, self.now))
        self._look(end)

    def exchange(self, data: bytes) -> bytes:
        """What comes within half a second."""
        self.got = b""
        self.send(data)
        self.wait(0.5)
        return self.got

    def _look(self, moment: float) -> None:
        self.now = moment
        if data := self.line.advance(moment):
            self.got += data
            self.last_at = moment


@pytest.fixture
def wire() -> Wire:
    return Wire()


@pytest.mark.parametrize("frame", [TAKE, ASK, ANSWER])
def test_printed_check_values(frame: bytes) -> None:
    assert seal(bytes.fromhex(frame[1:-4].decode())) == frame


def test_printed_exchanges(wire: Wire) -> None:
    assert wire.exchange(TAKE) == TAKE
    assert wire.exchange(ASK) == ANSWER
    rtu = Wire("rtu")
    assert rtu.exchange(bytes.fromhex("01 06 10 00 00 00 8D 0A")) == bytes.fromhex("01 06 10 00 00 00 8D 0A")
    assert rtu.exchange(RTU_ASK) == RTU_ANSWER


def test_an_error_reply(wire: Wire) -> None:
    assert wire.exchange(seal(b"\x01\x03\x00\xa3\x00\x01")) == seal(b"\x01\x83\x02")


def test_an_ascii_exchange_takes_its_true_time(wire: Wire) -> None:
    """CR LF ends the request; no silence is waited for."""
    start = wire.send(ASK)
    wire.wait(0.5)
    expected = start + (len(ASK) + len(ANSWER)) * ASCII_CHARACTER + TURNAROUND
    assert wire.last_at == pytest.approx(expected)


def test_an_rtu_exchange_keeps_the_gap_of_the_profile() -> None:
    wire = Wire("rtu")
    start = wire.send(RTU_ASK)
    wire.wait(0.5)
    expected = start + (len(RTU_ASK) + len(RTU_ANSWER)) * RTU_CHARACTER + GAP
    assert wire.last_at == pytest.approx(expected)


@pytest.mark.parametrize(("share", "answered"), [(0.5, False), (0.95, False), (1.01, True)])
def test_ten_milliseconds_before_an_rtu_request(share: float, answered: bool) -> None:
    wire = Wire("rtu")
    wire.send(RTU_ASK)
    while wire.got != RTU_ANSWER:
        wire.wait(0.0001)
    wire.wait(share * GAP)
    assert (wire.exchange(RTU_ASK) == RTU_ANSWER) is answered


def test_an_ascii_request_may_follow_at_once(wire: Wire) -> None:
    wire.send(ASK)
    while wire.got != ANSWER:
        wire.wait(0.0005)
    assert wire.exchange(ASK) == ANSWER


def test_an_ascii_request_may_come_in_pieces(wire: Wire) -> None:
    wire.send(ASK[:6])
    wire.wait(0.9)
    assert wire.exchange(ASK[6:]) == ANSWER


def test_an_ascii_request_with_too_long_a_pause_is_none(wire: Wire) -> None:
    wire.send(ASK[:6])
    wire.wait(1.1)
    assert wire.exchange(ASK[6:]) == b""
    assert wire.exchange(ASK) == ANSWER


def test_a_colon_begins_again(wire: Wire) -> None:
    assert wire.exchange(b":0103\x00junk" + ASK) == ANSWER


@pytest.mark.parametrize(
    "damaged",
    [
        b":010300A2000158\r\n",
        b":010300A2000159\n",
        b"010300A2000159\r\n",
        b":010300a2000159\r\n",
        b":010300A200015\r\n",
        b":010300A2000G59\r\n",
        b":\r\n",
        b"\r\n",
        b":020300A2000158\r\n",
        RTU_ASK,
    ],
)
def test_damaged_ascii_is_not_answered(wire: Wire, damaged: bytes) -> None:
    assert wire.exchange(damaged) == b""
    wire.wait(2)
    assert wire.exchange(ASK) == ANSWER


@settings(deadline=None, max_examples=60)
@given(st.integers(0, len(TAKE) - 1), st.integers(0, 0xFF))
def test_no_single_changed_character_is_obeyed(at: int, byte: int) -> None:
    wire = Wire()
    changed = TAKE[:at] + bytes((byte,)) + TAKE[at + 1 :]
    if changed != TAKE:
        assert wire.exchange(changed) == b""
        assert wire.drives["drive-1"].registers[0x1000] == 8


@settings(deadline=None, max_examples=60)
@given(st.binary(max_size=60))
def test_content_comes_back(content: bytes) -> None:
    if len(content) >= 2:
        request = unseal(seal(content))
        assert bytes((request.unit, request.function)) + request.data == content
    else:
        with pytest.raises(DamagedError):
            unseal(seal(content))


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(st.binary(max_size=30), st.floats(0, 1.2)), max_size=8))
def test_no_traffic_upsets_it(traffic: list[tuple[bytes, float]]) -> None:
    wire = Wire()
    for data, pause in traffic:
        wire.send(data)
        wire.wait(pause)
    wire.wait(2)
    assert wire.exchange(ASK) == ANSWER


def test_a_line_has_one_framing() -> None:
    ascii_line = line_of(sl3(), units=[1], framing="ascii")
    other = line_of(s2000(), units=[2])
    both = replace(ascii_line, drives=(*ascii_line.drives, *other.drives))
    with pytest.raises(
        UnsupportedError, match="drive drive-2: line line speaks ASCII, but s2000 speaks RTU only"
    ):
        build_drives(both, {})


def test_two_makes_on_one_rtu_line() -> None:
    one, two = line_of(sl3(), units=[1]), line_of(s2000(), units=[2])
    wire = Wire(config=replace(one, drives=(*one.drives, *two.drives)))
    assert wire.exchange(RTU_ASK) == RTU_ANSWER
    assert wire.exchange(bytes.fromhex("02 03 01 00 00 04 45 C6")) == bytes.fromhex(
        "02 03 08 00 01 00 02 00 00 00 00 F3 93"
    )


@pytest.mark.parametrize("form", [SerialFormat(7, "N", 2), SerialFormat(7, "O", 1)])
def test_ascii_on_a_pty(tmp_path: Path, form: SerialFormat) -> None:
    with SimulatedLine(line_of(sl3(), framing="ascii", form=form), tmp_path) as line:
        port = os.open(line.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        os.write(port, ASK)
        got, end = b"", monotonic() + 5
        while len(got) < len(ANSWER) and monotonic() < end:
            if select.select([port], [], [], 0.1)[0]:
                got += os.read(port, 64)
        os.close(port)
    assert got == ANSWER
