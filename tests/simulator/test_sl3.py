"""The twin of the SL3: the frames of its manual's page, and the rules of its sister series."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.simulator import Options, PowerCycle, Trip
from tests.simulator.bus import Bus
from tests.simulator.makes import line_of, sl3
from tests.simulator.master import framed, read

MODE, COMMAND, FREQUENCY, OUTPUT, STORED = 0x1000, 0x1001, 0x1002, 0x1003, 0x1009
SELECTED, SELECTOR, RESET, P_37, P_162 = 0x1012, 0x1013, 0x1101, 0x0025, 0x00A2
FORWARD, REVERSE = 0b010, 0b100


def one(address: int, word: int) -> bytes:
    """A request of function 06H, which is its own reply."""
    return framed(1, 0x06, address >> 8, address & 0xFF, word >> 8, word & 0xFF)


@pytest.fixture
def bus() -> Bus:
    return Bus(line_of(sl3()))


@pytest.fixture
def running(bus: Bus) -> Bus:
    bus.write(MODE, 0)
    bus.write(COMMAND, FORWARD, 3000)
    bus.wait(5)
    return bus


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        ("01 06 10 00 00 00 8D 0A", "01 06 10 00 00 00 8D 0A"),
        ("01 03 00 A2 00 01 25 E8", "01 03 02 FF FF B9 F4"),
    ],
)
def test_printed_exchanges(bus: Bus, request_: str, reply: str) -> None:
    bus.says(request_, reply)


def test_loop_back(bus: Bus) -> None:
    frame = framed(1, 0x08, 0, 0, 0x12, 0x34)
    assert bus.send(frame) == frame


def test_function_06_writes_one_register(bus: Bus) -> None:
    assert bus.send(one(MODE, 0)) == one(MODE, 0)
    assert bus.send(one(FREQUENCY, 5000)) == one(FREQUENCY, 5000)
    assert bus.word(FREQUENCY) == 5000


@pytest.mark.parametrize("data", [(), (0,), (0x10, 0, 0), (0x10, 0, 0, 0, 0)])
def test_function_06_has_one_length(bus: Bus, data: tuple[int, ...]) -> None:
    assert bus.send(framed(1, 0x06, *data)) is None


# -- the mode of operation --


@pytest.mark.parametrize("mode", [1, 2, 8])
def test_in_another_mode_the_line_commands_nothing(bus: Bus, mode: int) -> None:
    bus.write(MODE, mode)
    assert [bus.code(COMMAND, FORWARD), bus.code(FREQUENCY, 3000)] == [0x03, 0x03]
    bus.write(MODE, 0)
    bus.write(COMMAND, FORWARD, 3000)


def test_it_leaves_the_factory_in_another_mode(bus: Bus) -> None:
    assert bus.word(MODE) == 8
    assert bus.code(COMMAND, FORWARD) == 0x03


def test_a_change_of_mode_stops_the_motor(running: Bus) -> None:
    running.write(MODE, 8)
    running.wait(5)
    assert running.drive.state.running is False


def test_modes_that_do_not_exist(bus: Bus) -> None:
    assert bus.code(MODE, 9) == 0x03


# -- one address, two meanings --


def test_1001h_reads_as_status_and_is_written_as_command(running: Bus) -> None:
    assert running.word(COMMAND) == 0b011
    running.write(COMMAND, REVERSE)
    assert running.word(COMMAND) == 0b011
    running.wait(10)
    assert running.word(COMMAND) == 0b101
    running.write(COMMAND, 0)
    running.wait(5)
    assert running.word(COMMAND) == 0


def test_both_directions_are_no_command(running: Bus) -> None:
    assert running.code(COMMAND, FORWARD | REVERSE) == 0x03
    assert running.code(COMMAND, FORWARD | 1) == 0x03
    assert running.drive.state.frequency == 30


@pytest.mark.parametrize(("p_37", "raw"), [(0, 3000), (4, 300)])
def test_decimals_of_the_output_frequency(running: Bus, p_37: int, raw: int) -> None:
    running.write(P_37, p_37)
    running.wait(0.1)
    assert running.word(OUTPUT) == raw


# -- refusals, which know only 01, 02 and 03 --


def test_read_only_is_02(bus: Bus) -> None:
    assert [bus.code(OUTPUT, 0), bus.code(0x1007, 0), bus.code(SELECTED, 0)] == [0x02] * 3


def test_out_of_range_is_03(bus: Bus) -> None:
    bus.write(MODE, 0)
    bus.write(FREQUENCY, 65000)
    assert [bus.code(FREQUENCY, 65001), bus.code(STORED, 0xFFFF)] == [0x03, 0x03]


def test_counts(bus: Bus) -> None:
    assert len(bus.read(MODE, 20)) == 20
    assert [bus.read_code(MODE, 21), bus.read_code(MODE, 0)] == [0x03, 0x03]


def test_blocks_may_pass_over_reserved_registers(bus: Bus) -> None:
    assert bus.read(P_162 - 2, 4) == [0, 0, 0xFFFF, 0]
    assert bus.read_code(P_162 + 1) == 0x02
    assert bus.read_code(0x2000, 4) == 0x02


def test_what_is_only_written_cannot_be_read(bus: Bus) -> None:
    assert bus.read_code(RESET) == 0x02


def test_no_broadcast(running: Bus) -> None:
    running.broadcast(COMMAND, 0)
    running.wait(1)
    assert running.drive.state.running


# -- RAM and EEPROM --


def test_1002h_is_ram_and_1009h_wears(bus: Bus) -> None:
    bus.write(MODE, 0)
    for hz in (1000, 2000, 3000):
        bus.write(FREQUENCY, hz)
    assert (bus.drive.state.saves, bus.word(STORED)) == (0, 0)
    bus.write(STORED, 4000)
    assert (bus.drive.state.saves, bus.word(FREQUENCY), bus.word(STORED)) == (1, 4000, 4000)


def test_only_the_stored_frequency_survives(bus: Bus) -> None:
    bus.write(STORED, 4000)
    bus.drive.post(PowerCycle())
    bus.wait(1)
    assert (bus.word(STORED), bus.word(MODE)) == (4000, 8)


# -- selector, faults, restart --


def test_a_selector_chooses_the_monitor(running: Bus) -> None:
    running.write(SELECTOR, 5)
    assert 250 < running.word(SELECTED) < 320
    running.write(SELECTOR, 6)
    assert running.word(SELECTED) == 110
    running.write(SELECTOR, 99)
    assert running.word(SELECTED) == 0


def test_alarms_are_packed_two_in_a_register(running: Bus) -> None:
    for fault in ("overcurrent", "overvoltage", "overcurrent"):
        running.drive.post(Trip(fault))
        running.wait(0.1)
    assert running.read(0x1007, 2) == [0x2010, 0x0010]
    assert running.word(COMMAND) & 0x80


def test_a_restart_is_not_answered_and_takes_its_time(running: Bus) -> None:
    running.drive.post(Trip("overcurrent"))
    running.wait(0.1)
    assert running.send(one(RESET, 0x9696)) is None
    running.wait(0.9)
    assert running.send(read(MODE, 1, unit=1)) is None
    running.wait(0.2)
    assert (running.word(MODE), running.word(COMMAND)) == (8, 0)
    running.write(MODE, 0)
    running.write(COMMAND, FORWARD)
    running.wait(1)
    assert running.drive.state.fault is False


@pytest.mark.parametrize("word", [0, 1, 0x9697, 0xFFFF])
def test_other_reset_words_are_refused(bus: Bus, word: int) -> None:
    assert bus.code(RESET, word) == 0x03


def test_silence_does_not_stop_it(running: Bus) -> None:
    running.wait(600)
    assert running.drive.state.frequency == 30


@settings(deadline=None, max_examples=60)
@given(st.lists(st.binary(min_size=1, max_size=24), max_size=8))
def test_no_traffic_upsets_it(bodies: list[bytes]) -> None:
    bus = Bus(line_of(sl3()), {"drive-1": Options(speed=10)})
    for body in bodies:
        reply = bus.send(framed(1, *body))
        assert reply is None or framed(*reply[:-2]) == reply
        bus.wait(0.3)
    bus.wait(2)
    assert len(bus.read(MODE)) == 1
