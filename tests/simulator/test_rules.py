"""What a 7200GS refuses, with which code, and what it does not answer at all (sections 7, 9 and 10)."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.simulator import Trip
from tests.simulator.master import UNIT, Master, framed, read, refused, write
from tests.simulator.plant import drive

HOLES = [(0x0025, 0x0026), (0x002E, 0x0030), (0x0034, 0x003C), (0x0117, 0x0117)]
OUTSIDE = [0x0000, 0x0003, 0x0008, 0x000A, 0x001F, 0x0041, 0x00FF, 0x011C, 0x022A, 0x0409, 0x050C, 0xFFFF]
DEFINED = [
    *range(0x0001, 0x0003),
    0x0009,
    *range(0x0020, 0x0025),
    *range(0x0027, 0x002E),
    *range(0x0031, 0x0034),
    *range(0x003D, 0x0041),
    *range(0x0100, 0x0117),
    *range(0x0118, 0x011C),
    *range(0x0200, 0x022A),
    *range(0x0400, 0x0409),
    *range(0x0500, 0x050C),
]


@pytest.fixture
def master() -> Master:
    return Master(drive())


@pytest.fixture
def running() -> Master:
    master = Master(drive())
    master.write(0x0001, 1, 6000)
    master.wait(4)
    return master


def test_every_documented_register_can_be_read(master: Master) -> None:
    for address in DEFINED:
        master.word(address)


def test_all_other_addresses_are_refused(master: Master) -> None:
    for address in sorted(set(range(0x0700)) - set(DEFINED)):
        assert master.send(read(address, 1)) == refused(0x03, 0x02)


@pytest.mark.parametrize("address", OUTSIDE + [low for low, _ in HOLES])
def test_writing_where_nothing_is(master: Master, address: int) -> None:
    assert master.code(address, 0) == 0x02


@pytest.mark.parametrize(
    ("address", "count"), [(0x0024, 2), (0x0020, 8), (0x0116, 3), (0x0002, 2), (0xFFFF, 2)]
)
def test_no_block_passes_over_a_hole(master: Master, address: int, count: int) -> None:
    assert master.send(read(address, count)) == refused(0x03, 0x02)


@pytest.mark.parametrize("function", [0x01, 0x02, 0x04, 0x05, 0x06, 0x08, 0x0F, 0x17, 0x2B, 0x41])
def test_other_functions(master: Master, function: int) -> None:
    assert master.send(framed(UNIT, function, 0, 1, 0, 1)) == refused(function, 0x01)


@pytest.mark.parametrize("count", [0, 17, 255, 0xFFFF])
def test_counts(master: Master, count: int) -> None:
    assert master.send(read(0x0200, count)) == refused(0x03, 0x03)


def test_sixteen_registers_are_allowed(master: Master) -> None:
    assert len(master.read(0x0200, 16)) == 16
    master.write(0x0208, *master.read(0x0208, 16))


@pytest.mark.parametrize(
    ("count", "words"),
    [(0, 0), (17, 17), (1, 2), (2, 1), (3, 0)],
    ids=["0", "17", "1 for 2", "2 for 1", "3 for 0"],
)
def test_counts_of_writes(master: Master, count: int, words: int) -> None:
    frame = framed(UNIT, 0x10, 0x02, 0x08, 0, count, 2 * words, *[0] * (2 * words))
    assert master.send(frame) == refused(0x10, 0x03)


def test_an_odd_byte_count_is_refused(master: Master) -> None:
    assert master.send(framed(UNIT, 0x10, 0, 2, 0, 1, 3, 0, 1, 2)) == refused(0x10, 0x03)


@pytest.mark.parametrize("address", [0x0020, 0x0024, 0x0031, 0x003D, 0x0040])
def test_monitor_registers_are_read_only(master: Master, address: int) -> None:
    assert master.code(address, 0) == 0x22


@pytest.mark.parametrize("address", [0x0100, 0x0107, 0x011B, 0x0208, 0x0229])
def test_sn_and_cn_are_locked_while_running(running: Master, address: int) -> None:
    assert running.code(address, 0) == 0x22
    running.write(0x0001, 0)
    running.wait(1)
    assert running.code(address, 0) == 0x22
    running.wait(3)
    running.write(address, 0)


@pytest.mark.parametrize("address", [0x0400, 0x0408, 0x0500, 0x050B])
def test_an_and_bn_stay_open_while_running(running: Master, address: int) -> None:
    running.write(address, 40)
    assert running.word(address) == 40


@pytest.mark.parametrize("address", range(0x0201, 0x0208))
def test_the_v_f_pattern_needs_sn_02(master: Master, address: int) -> None:
    assert master.code(address, 500) == 0x22
    for pattern in (0x0F, 0xFF):
        master.write(0x0101, pattern)
        master.write(address, 500)
    assert master.word(address) == 500


def test_parameters_are_locked_at_undervoltage(master: Master) -> None:
    master.drive.post(Trip("fault_low_voltage"))
    master.wait(0.1)
    assert [master.code(at, 0) for at in (0x0100, 0x0208, 0x0400, 0x0500)] == [0x22] * 4
    master.write(0x0001, 0)


def test_sn_03_can_lock_all_but_an(master: Master) -> None:
    master.write(0x0102, 0b0101)
    assert [master.code(at, 0) for at in (0x0100, 0x0208, 0x0500)] == [0x22] * 3
    master.write(0x0400, 0)
    master.write(0x0102, 0)
    master.write(0x0500, 0)


@pytest.mark.parametrize("code", [0b1110, 0b1111])
def test_sn_03_can_initialise_the_drive(master: Master, code: int) -> None:
    before = master.word(0x0208)
    master.write(0x0208, before + 1)
    master.write(0x0107, 0b1111)
    master.write(0x0102, code)
    assert (master.word(0x0208), master.word(0x0107), master.word(0x0102)) == (before, 0, 0)


@pytest.mark.parametrize(
    ("address", "value"),
    [(0x0002, 6001), (0x0002, 0xFFFF), (0x0400, 6001), (0x0001, 0x0100), (0x0009, 8), (0x0107, 16)],
)
def test_values_out_of_range(master: Master, address: int, value: int) -> None:
    before = master.word(address)
    assert master.code(address, value) == 0x21
    assert master.word(address) == before


def test_a_refused_write_changes_nothing(master: Master) -> None:
    assert master.code(0x0001, 1, 6001) == 0x21
    assert master.read(0x0001, 2) == [0, 0]
    assert master.drive.state.running is False


def test_0022h_tells_why_a_write_was_refused(master: Master) -> None:
    expected = [(0x0020, 0, 0b0010), (0x0025, 0, 0b0100), (0x0002, 6001, 0b1000)]
    for address, value, bits in expected:
        master.code(address, value)
        assert master.word(0x0022) == bits
    master.write(0x0002, 0)
    assert master.word(0x0022) == 0


@pytest.mark.parametrize("unit", [0, 4, 6, 255])
def test_other_units_get_silence(master: Master, unit: int) -> None:
    assert master.send(read(0x0020, 1, unit=unit)) is None
    assert master.send(write(0x0001, 1, unit=unit)) is None
    assert master.word(0x0001) == 0


@pytest.mark.parametrize(
    ("damage", "bit"),
    [
        (lambda frame: frame[:-1] + bytes((frame[-1] ^ 1,)), 0),
        (lambda frame: b"\x04" + frame[1:], 0),
        (lambda frame: frame[:3], 1),
        (lambda frame: framed(*frame[:-2], 0), 1),
        (lambda frame: framed(*frame[:-3]), 1),
    ],
    ids=["check value", "first byte", "three bytes", "too long", "too short"],
)
def test_damaged_frames_get_silence(master: Master, damage: Callable[[bytes], bytes], bit: int) -> None:
    for frame in (read(0x0020, 1), write(0x0001, 1)):
        assert master.send(damage(frame)) is None
    assert master.word(0x003D) == 1 << bit
    assert master.word(0x0001) == 0


@settings(deadline=None)
@given(st.binary(max_size=300))
def test_no_bytes_crash_it_and_none_unsealed_are_answered(data: bytes) -> None:
    assert Master(drive()).send(data) is None or framed(*data[:-2]) == data


@settings(deadline=None)
@given(st.binary(min_size=1, max_size=60).map(lambda body: framed(UNIT, *body)))
def test_any_sound_frame_is_answered_soundly_or_not_at_all(data: bytes) -> None:
    master = Master(drive())
    reply = master.send(data)
    if reply is not None:
        assert reply[0] == UNIT and reply[1] in (data[1], data[1] | 0x80)
        assert framed(*reply[:-2]) == reply
    assert master.word(0x0040) & 0x1F == UNIT


@settings(deadline=None)
@given(st.sampled_from([read(0x0020, 5), write(0x0001, 1, 6000)]), st.data())
def test_a_frame_with_turned_bits_is_never_answered(frame: bytes, data: st.DataObject) -> None:
    """CRC-16 finds every error burst of up to 16 bits."""
    at = data.draw(st.integers(0, len(frame) - 2))
    mask = data.draw(st.integers(1, 0xFFFF))
    turned = int.from_bytes(frame[at : at + 2], "big") ^ mask
    damaged = frame[:at] + turned.to_bytes(2, "big") + frame[at + 2 :]
    master = Master(drive())
    assert master.send(damaged) is None
    assert master.read(0x0001, 2) == [0, 0]


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from([*DEFINED, *OUTSIDE]), st.lists(st.integers(0, 0xFFFF), max_size=17)),
        max_size=12,
    )
)
def test_any_sequence_of_writes_leaves_a_drive_that_answers(
    writes: list[tuple[int, list[int]]],
) -> None:
    master = Master(drive())
    for address, words in writes:
        master.send(write(address, *words))
        master.wait(0.3)
    assert master.word(0x0024) <= 65535
    assert all(0 <= word <= 0xFFFF for word in master.drive.registers.values())
