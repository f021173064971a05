"""Every frame that the SI-M manual prints, byte for byte (sections 8 and 11)."""

from __future__ import annotations

import pytest

from gateway.simulator import frame, rtu
from tests.simulator.master import Master
from tests.simulator.plant import drive

PRINTED = [
    "05 03 00 01 00 01 D4 4E",
    "05 03 02 00 01 88 44",
    "05 83 01 C1 31",
    "05 10 00 01 00 01 02 00 01 54 81",
    "05 10 00 01 00 01 51 8D",
    "05 90 06 8D C3",
    "05 10 00 01 00 02 04 00 01 17 70 78 87",
    "05 10 00 01 00 02 11 8C",
    "05 10 00 01 00 02 04 00 01 0B B8 71 D1",
    "05 10 00 01 00 02 04 00 03 0B B8 D0 11",
    "05 10 00 01 00 01 02 00 00 95 41",
]


def hexed(text: str) -> bytes:
    return bytes.fromhex(text)


@pytest.mark.parametrize("printed", PRINTED)
def test_check_value(printed: str) -> None:
    assert rtu.seal(hexed(printed)[:-2]) == hexed(printed)


@pytest.fixture
def master() -> Master:
    return Master(drive())


def test_section_8_write_then_read(master: Master) -> None:
    assert master.send(hexed("05 10 00 01 00 01 02 00 01 54 81")) == hexed("05 10 00 01 00 01 51 8D")
    assert master.send(hexed("05 03 00 01 00 01 D4 4E")) == hexed("05 03 02 00 01 88 44")


def test_section_8_error_replies() -> None:
    assert rtu.seal(frame.error_reply(5, 0x03, 0x01)) == hexed("05 83 01 C1 31")
    assert rtu.seal(frame.error_reply(5, 0x10, 0x06)) == hexed("05 90 06 8D C3")


def test_section_11(master: Master) -> None:
    """Forward at 60 Hz, forward at 30 Hz, reverse at 30 Hz, stop; the curve that the manual draws."""
    steps = [
        ("05 10 00 01 00 02 04 00 01 17 70 78 87", "05 10 00 01 00 02 11 8C", 60.0),
        ("05 10 00 01 00 02 04 00 01 0B B8 71 D1", "05 10 00 01 00 02 11 8C", 30.0),
        ("05 10 00 01 00 02 04 00 03 0B B8 D0 11", "05 10 00 01 00 02 11 8C", -30.0),
        ("05 10 00 01 00 01 02 00 00 95 41", "05 10 00 01 00 01 51 8D", 0.0),
    ]
    for request, reply, frequency in steps:
        assert master.send(hexed(request)) == hexed(reply)
        master.wait(5)
        assert master.drive.state.frequency == frequency
        assert master.word(0x0024) == abs(frequency) * 100
