"""Times on the wire, against figures worked out by hand."""

import pytest

from gateway.mapping.profile import SerialFormat
from gateway.modbus.timing import timing_of

F8N2 = SerialFormat(8, "N", 2)


def test_rtu_at_9600() -> None:
    timing = timing_of("rtu", 9600, F8N2)
    assert timing.character == pytest.approx(11 / 9600)
    assert timing.gap == pytest.approx(3.5 * 11 / 9600)
    assert timing.duration(8) == pytest.approx(0.0091667, abs=1e-6)


def test_reading_16_registers_at_2400_takes_about_226_ms() -> None:
    timing = timing_of("rtu", 2400, F8N2)
    assert timing.transaction(8, 37, 0.0) == pytest.approx(0.2223, abs=1e-3)


def test_silence_is_fixed_above_19200() -> None:
    assert timing_of("rtu", 19200, F8N2).gap == pytest.approx(3.5 * 11 / 19200)
    assert timing_of("rtu", 38400, F8N2).gap == 0.00175


def test_the_longer_gap_counts() -> None:
    assert timing_of("rtu", 9600, F8N2, gap=0.01).gap == 0.01
    assert timing_of("rtu", 1200, F8N2, gap=0.01).gap > 0.03


def test_ascii_needs_no_silence_and_tcp_no_time() -> None:
    assert timing_of("ascii", 9600, SerialFormat(7, "E", 1)).gap == 0
    assert timing_of("tcp", 9600, F8N2).duration(100) == 0
