"""The twin of the S2000, byte for byte as its sheet prints and rule by rule as it states."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.simulator import Cured, Options, PowerCycle, Trip
from tests.simulator.bus import Bus
from tests.simulator.makes import S2000_SETTINGS, line_of, s2000
from tests.simulator.master import framed, read, write

RUN, FREQUENCY, SELECTION, STATUS = 0x0000, 0x0001, 0x000F, 0x0010
EEPROM, RAM = 0xFFFD, 0xFFDD


@pytest.fixture
def bus() -> Bus:
    return Bus(line_of(s2000()))


@pytest.mark.parametrize(
    ("unit", "request_", "reply"),
    [
        (2, "02 03 01 00 00 04 45 C6", "02 03 08 00 01 00 02 00 00 00 00 F3 93"),
        (1, "01 10 02 80 00 02 04 02 58 01 F4 62 D3", "01 10 02 80 00 02 41 98"),
        (1, "01 08 00 00 A5 37 DA 8D", "01 08 00 00 A5 37 DA 8D"),
        # printed with the check bytes BB D2 and 38 BA, which no drive would take
        (1, "01 10 FF FD 00 01 02 00 00 BC B2", "01 10 FF FD 00 01 A0 2D"),
        (1, "01 10 FF DD 00 01 02 00 00 BB D2", "01 10 FF DD 00 01 A1 E7"),
    ],
)
def test_printed_exchanges(unit: int, request_: str, reply: str) -> None:
    Bus(line_of(s2000(), units=[unit])).says(request_, reply)


@pytest.mark.parametrize("misprint", ["01 10 FF FD 00 01 02 00 00 BB D2", "01 10 FF DD 00 01 02 00 00 38 BA"])
def test_misprinted_frames_are_not_answered(bus: Bus, misprint: str) -> None:
    bus.says(misprint, None)


def test_printed_refusals(bus: Bus) -> None:
    """Too many registers, no such register, and a loop-back with another test code; the last one is
    printed with the check bytes 86 50."""
    two = Bus(line_of(s2000(), units=[2]))
    assert two.send(read(0x0100, 17, unit=2)) == bytes.fromhex("02 83 03 F1 31")
    assert bus.send(write(0x0300, 1, unit=1)) == bytes.fromhex("01 90 02 CD C1")
    assert bus.send(framed(0x01, 0x08, 0, 1, 0xA5, 0x37)) == bytes.fromhex("01 88 01 87 C0")


@given(st.integers(0, 0xFFFF))
@settings(deadline=None, max_examples=30)
def test_any_data_loops_back(data: int) -> None:
    frame = framed(1, 0x08, 0, 0, data >> 8, data & 0xFF)
    assert Bus(line_of(s2000())).send(frame) == frame


@pytest.mark.parametrize("function", [0x01, 0x04, 0x06, 0x0F, 0x2B])
def test_other_functions(bus: Bus, function: int) -> None:
    assert bus.send(framed(1, function, 0, 0, 0, 1)) == framed(1, function | 0x80, 0x01)


# -- run and frequency --


@pytest.mark.parametrize("shift", [0, 1])
def test_forward_reverse_stop(shift: int) -> None:
    bus = Bus(line_of(s2000(shift)))
    bus.write(RUN + shift, 1, 500)
    bus.wait(5)
    assert (bus.drive.state.frequency, bus.word(STATUS)) == (50, 0b11_0001)
    bus.write(RUN + shift, 2)
    bus.wait(10)
    assert (bus.drive.state.frequency, bus.word(STATUS)) == (-50, 0b11_0101)
    bus.write(RUN + shift, 0)
    bus.wait(5)
    assert (bus.drive.state.running, bus.word(STATUS)) == (False, 0b10_0010)


def test_the_other_firmware_has_nothing_at_the_lower_address() -> None:
    bus = Bus(line_of(s2000(1)))
    assert bus.code(RUN, 1) == 0x02
    assert bus.read_code(RUN) == 0x02


@pytest.mark.parametrize(("word", "code"), [(3, 0x21), (0x0100, 0x21)])
def test_run_words_that_do_not_exist(bus: Bus, word: int, code: int) -> None:
    assert bus.code(RUN, word) == code
    assert bus.word(RUN) == 0


@pytest.mark.parametrize(
    ("g1_03", "selection", "raw"),
    [(0, 0, 250), (0, 1, 2500), (1, 1, 5000), (2, 1, 1500), (4, 1, 750), (39, 0, 250)],
)
def test_25_hz_in_every_unit(g1_03: int, selection: int, raw: int) -> None:
    """With G1-03 = 2 to 39 it counts r/min = 120 x Hz / G1-03, as the sheet has it."""
    bus = Bus(line_of(s2000(), settings=S2000_SETTINGS | {"g1_03": Fraction(g1_03)}))
    bus.write(SELECTION, selection)
    bus.write(FREQUENCY, raw)
    bus.write(RUN, 1)
    bus.wait(3)
    assert bus.drive.state.frequency == pytest.approx(25)


def test_the_same_count_means_another_frequency_after_a_change_of_unit(bus: Bus) -> None:
    bus.write(RUN, 1, 500)
    bus.wait(3)
    assert bus.code(SELECTION, 1) == 0x22
    bus.write(RUN, 0)
    bus.wait(5)
    bus.write(SELECTION, 1)
    bus.write(RUN, 1)
    bus.wait(3)
    assert bus.drive.state.frequency == 5


@pytest.mark.parametrize(("selection", "highest"), [(0, 500), (1, 5000)])
def test_limits_follow_the_unit(bus: Bus, selection: int, highest: int) -> None:
    bus.write(SELECTION, selection)
    bus.write(FREQUENCY, highest)
    assert bus.code(FREQUENCY, highest + 1) == 0x21
    assert bus.word(FREQUENCY) == highest


def test_signed_outputs(bus: Bus) -> None:
    bus.write(0x0007, 726, 0x10000 - 726)
    assert bus.read(0x0007, 2) == [726, 0x10000 - 726]
    assert [bus.code(0x0007, 727), bus.code(0x0008, 0x10000 - 727)] == [0x21, 0x21]


def test_spare_and_read_only_registers(bus: Bus) -> None:
    assert [bus.code(at, 0) for at in (0x0002, 0x0006, 0x000A, 0x000E, 0x0013)] == [0x02] * 5
    assert [bus.code(at, 0) for at in (0x0010, 0x0014, 0x0019)] == [0x22] * 3
    assert bus.code(0x000F, 0x0002) == 0x21


# -- parameters and ENTER --


def test_a_parameter_counts_only_after_enter() -> None:
    """The written value is there to be read, acts after ENTER to RAM, and stays after ENTER to EEPROM."""
    facts = replace(s2000().simulate, max_frequency="preset_frequency_1", factory={0x0280: 5000})  # type: ignore[type-var]
    bus = Bus(line_of(replace(s2000(), simulate=facts)))
    bus.write(0x0280, 1000)
    assert bus.word(0x0280) == 1000
    bus.write(FREQUENCY, 500)
    bus.write(RAM, 0)
    assert bus.code(FREQUENCY, 500) == 0x21
    bus.drive.post(PowerCycle())
    bus.wait(1)
    assert bus.word(0x0280) == 5000
    bus.write(0x0280, 1000)
    bus.write(EEPROM, 0)
    bus.drive.post(PowerCycle())
    bus.wait(1)
    assert bus.word(0x0280) == 1000
    assert bus.code(FREQUENCY, 500) == 0x21


def test_a_parameter_without_enter_is_lost(bus: Bus) -> None:
    bus.write(0x0280, 600)
    bus.drive.post(PowerCycle())
    bus.wait(1)
    assert bus.word(0x0280) == 0


def test_only_enter_to_eeprom_wears(bus: Bus) -> None:
    for _ in range(3):
        bus.write(0x0280, 600)
        bus.write(RAM, 0)
    assert bus.drive.state.saves == 0
    for expected in (1, 2):
        bus.write(EEPROM, 0)
        bus.wait(1)
        assert bus.drive.state.saves == expected


def test_enter_cannot_be_read(bus: Bus) -> None:
    assert [bus.read_code(EEPROM), bus.read_code(RAM)] == [0x02, 0x02]


def test_busy_while_saving(bus: Bus) -> None:
    bus.write(EEPROM, 0)
    assert [bus.code(0x0280, 1), bus.code(RUN, 0)] == [0x24, 0x24]
    bus.word(STATUS)
    bus.wait(0.19)
    assert bus.code(0x0280, 1) == 0x24
    bus.wait(0.02)
    bus.write(0x0280, 1)


def test_no_busy_after_enter_to_ram(bus: Bus) -> None:
    bus.write(RAM, 0)
    bus.write(0x0280, 1)


def test_parameters_are_locked_while_running(bus: Bus) -> None:
    bus.write(RUN, 1, 500)
    assert bus.code(0x0280, 600) == 0x22
    bus.write(FREQUENCY, 400)


def test_nothing_is_written_at_undervoltage(bus: Bus) -> None:
    bus.drive.post(Trip("warning_uv"))
    bus.wait(0.1)
    assert [bus.code(0x0280, 1), bus.code(RUN, 1)] == [0x23, 0x23]
    assert bus.word(STATUS) & 0b1100_0000 == 0b0100_0000
    bus.drive.post(Cured("warning_uv"))
    bus.wait(0.1)
    bus.write(0x0280, 1)
    assert bus.word(STATUS) & 0b1100_0000 == 0


# -- faults --


def test_a_fault_stops_and_terminal_4_resets(bus: Bus) -> None:
    bus.write(RUN, 1, 500)
    bus.wait(3)
    bus.drive.post(Trip("fault_oc"))
    bus.wait(0.1)
    assert (bus.word(0x0014), bus.word(STATUS)) == (1 << 6, 0b1000_0010)
    bus.write(RUN, 0)
    bus.write(RUN, 0b1000)
    assert bus.word(STATUS) == 0b0010_1010
    assert bus.word(0x0014) == 0


@pytest.mark.parametrize(
    ("detection", "action", "after_half_a_second"),
    [(1, 0, 50.0), (0, 3, 50.0), (0, 2, 0.0), (0, 0, 50 - 50 / 6), (0, 1, 25.0)],
)
def test_loss_of_the_line(detection: int, action: int, after_half_a_second: float) -> None:
    """The factory setting goes on without a word; F5-05 = 0 obeys F5-04."""
    own = {"f5_04": Fraction(action), "f5_05": Fraction(detection)}
    bus = Bus(line_of(s2000(), settings=S2000_SETTINGS | own))
    bus.write(RUN, 1, 500)
    bus.wait(1.5)
    bus.word(STATUS)
    bus.wait(1.9)
    assert bus.drive.state.frequency == 50
    bus.wait(0.6)
    assert bus.drive.state.frequency == pytest.approx(after_half_a_second)
    assert bus.drive.state.communication_lost is (detection == 0)
    assert bus.drive.registers[0x0016] == (1 - detection)


# -- to all drives --


@pytest.fixture
def three() -> Bus:
    return Bus(line_of(s2000(), units=[1, 2, 3]))


def frequencies(bus: Bus) -> list[float]:
    return [drive.state.frequency for drive in bus.drives.values()]


def test_a_broadcast_runs_all_drives(three: Bus) -> None:
    three.broadcast(0x0001, 1, 15000)
    three.wait(3)
    assert frequencies(three) == [25, 25, 25]
    assert [three.read(RUN, 2, unit) for unit in (1, 2, 3)] == [[1, 250]] * 3
    three.broadcast(0x0001, 0b11)
    three.wait(5)
    assert frequencies(three) == [-25, -25, -25]
    three.broadcast(0x0002, 30000)
    three.wait(3)
    assert frequencies(three) == [-50, -50, -50]
    three.broadcast(0x0001, 0)
    three.wait(5)
    assert frequencies(three) == [0, 0, 0]


def test_the_unit_of_a_broadcast_is_fixed(three: Bus) -> None:
    three.write(SELECTION, 1, unit=2)
    three.broadcast(0x0001, 1, 30000)
    three.wait(5)
    assert frequencies(three) == [50, 50, 50]
    assert [three.word(FREQUENCY, unit) for unit in (1, 2, 3)] == [500, 5000, 500]


@pytest.mark.parametrize(
    "frame",
    [
        framed(0, 0x03, 0, 1, 0, 1),
        framed(0, 0x08, 0, 0, 0xA5, 0x37),
        write(0x0000, 1, unit=0),
        write(0x0001, 1, 15000, 0, unit=0),
        write(0x0280, 600, unit=0),
        write(EEPROM, 0, unit=0),
        write(0x0001, 1, 30001, unit=0),
        framed(0, 0x10, 0, 1, 0, 1, 4, 0, 1, 0, 1),
        framed(0, 0x10, 0, 1, 0, 1, 2, 0),
    ],
)
def test_everything_else_to_all_is_ignored(three: Bus, frame: bytes) -> None:
    assert three.send(frame) is None
    three.wait(1)
    assert frequencies(three) == [0, 0, 0]
    assert three.read(RUN, 2) == [0, 0]
    assert three.drive.state.saves == 0


def test_a_broadcast_terminal_must_be_armed(three: Bus) -> None:
    three.write(SELECTION, 0x1000, unit=2)
    three.broadcast(0x0001, 0x3000)
    assert [three.word(RUN, unit) for unit in (1, 2, 3)] == [0, 0b1_0000, 0]
    three.broadcast(0x0001, 0)
    assert three.word(RUN, 2) == 0


def test_an_external_fault_to_all_and_its_reset(three: Bus) -> None:
    three.broadcast(0x0001, 1, 30000)
    three.wait(3)
    three.broadcast(0x0001, 0b1_0001)
    three.wait(0.1)
    assert frequencies(three) == [0, 0, 0]
    assert [three.word(0x0015, unit) for unit in (1, 2, 3)] == [1, 1, 1]
    three.broadcast(0x0001, 0b11_0000)
    assert three.word(0x0015) == 1
    three.broadcast(0x0001, 0)
    three.broadcast(0x0001, 0b10_0000)
    assert [three.word(STATUS, unit) & 0x80 for unit in (1, 2, 3)] == [0, 0, 0]


def test_a_drive_that_is_saving_misses_a_broadcast(three: Bus) -> None:
    three.write(EEPROM, 0, unit=2)
    three.broadcast(0x0001, 1, 30000)
    three.wait(5)
    assert frequencies(three) == [50, 0, 50]


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(st.sampled_from([0, 1, 2, 8, 16]), st.binary(min_size=1, max_size=24)), max_size=8))
def test_no_traffic_upsets_it(frames: list[tuple[int, bytes]]) -> None:
    """Sound frames of any content: answered soundly by the one that is meant, or by nobody."""
    bus = Bus(line_of(s2000(), units=[1, 2]), {"drive-1": Options(speed=10)})
    for unit, body in frames:
        reply = bus.send(framed(unit, *body))
        assert reply is None or (unit in (1, 2) and reply[0] == unit and framed(*reply[:-2]) == reply)
        bus.wait(0.3)
    assert len(bus.read(STATUS)) == 1
