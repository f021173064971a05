"""Faults of the drive, their reset, and the loss of the line."""

from __future__ import annotations

import pytest

from gateway.simulator import Options, Panel, Trip, UnsupportedError
from tests.simulator.master import Master, read
from tests.simulator.plant import drive

RUN, EXTERNAL, RESET = 0b0001, 0b0100, 0b1000


def running(options: Options | None = None) -> Master:
    """A master whose drive runs at 60 Hz."""
    master = Master(drive(options))
    master.write(0x0001, RUN, 6000)
    master.wait(4)
    return master


@pytest.fixture
def master() -> Master:
    return running()


def test_trip_stops_at_once_and_shows(master: Master) -> None:
    master.drive.post(Trip("fault_overcurrent"))
    master.wait(0.1)
    assert master.word(0x0020) == 0b1000
    assert master.word(0x0021) == 0b0001
    assert master.word(0x002C) == 1 << 0xE | 0b10
    assert master.word(0x0024) == 0
    assert master.drive.state.faults == {"fault_overcurrent"}


def test_external_fault_bit_is_a_major_fault(master: Master) -> None:
    master.write(0x0001, RUN | EXTERNAL)
    master.wait(0.1)
    assert master.word(0x0020) == 0b1000
    assert master.word(0x0021) == 1 << 7


@pytest.mark.parametrize(("sn_12", "after_half_a_second"), [(0b0000, 50.0), (0b0100, 0.0), (0b1000, 30.0)])
def test_external_fault_stops_as_sn_12_says(sn_12: int, after_half_a_second: float) -> None:
    master = Master(drive())
    master.write(0x010B, sn_12)
    master.write(0x0001, RUN, 6000)
    master.wait(4)
    master.write(0x0001, RUN | EXTERNAL)
    master.wait(0.5)
    assert master.drive.state.frequency == pytest.approx(after_half_a_second)
    assert master.word(0x0020) & 0b1000


def test_external_fault_may_leave_the_motor_running() -> None:
    master = Master(drive())
    master.write(0x010B, 0b1100)
    master.write(0x0001, RUN, 6000)
    master.wait(4)
    master.write(0x0001, RUN | EXTERNAL)
    master.wait(4)
    assert master.word(0x0020) == 0b0101
    assert master.word(0x0021) == 1 << 7


def test_a_fault_stays_until_the_reset_bit_rises(master: Master) -> None:
    master.drive.post(Trip("fault_overcurrent"))
    master.wait(1)
    master.write(0x0001, 0)
    master.write(0x0001, RUN)
    master.wait(1)
    assert master.word(0x0020) == 0b1000
    master.write(0x0001, RESET)
    assert master.word(0x0020) == 0b0100
    assert master.word(0x0021) == 0


def test_only_the_edge_of_the_reset_bit_counts(master: Master) -> None:
    master.write(0x0001, RUN | RESET)
    master.drive.post(Trip("fault_overcurrent"))
    master.wait(0.1)
    master.write(0x0001, RUN | RESET)
    assert master.word(0x0020) & 0b1000
    master.write(0x0001, RUN)
    master.write(0x0001, RUN | RESET)
    assert master.word(0x0020) & 0b1000 == 0


def test_reset_with_a_standing_run_bit_starts_again(master: Master) -> None:
    master.drive.post(Trip("fault_overcurrent"))
    master.wait(0.1)
    master.write(0x0001, RUN | RESET)
    master.wait(4)
    assert master.drive.state.frequency == 60.0


def test_a_drive_may_be_set_up_to_want_a_new_run_command() -> None:
    master = running(Options(restart=False))
    master.drive.post(Trip("fault_overcurrent"))
    master.wait(0.1)
    master.write(0x0001, RUN | RESET)
    master.wait(1)
    assert master.word(0x0020) == 0b0100
    master.write(0x0001, 0)
    master.write(0x0001, RUN)
    master.wait(4)
    assert master.drive.state.frequency == 60.0


def test_no_reset_while_the_external_fault_is_demanded(master: Master) -> None:
    master.write(0x0001, RUN | EXTERNAL)
    master.write(0x0001, RUN | EXTERNAL | RESET)
    assert master.word(0x0020) & 0b1000
    master.write(0x0001, RUN)
    master.write(0x0001, RUN | RESET)
    assert master.word(0x0021) == 0


def test_history_keeps_four_faults(master: Master) -> None:
    for fault in ("fault_overcurrent", "fault_external", "fault_low_voltage"):
        master.drive.post(Trip(fault))
        master.wait(0.1)
    assert master.word(0x0033) == 0x018D
    master.write(0x0001, RESET)
    assert master.word(0x0033) == 0x018D


def test_unknown_faults_cannot_be_injected(master: Master) -> None:
    with pytest.raises(UnsupportedError, match="fault_of_mine"):
        master.drive.post(Trip("fault_of_mine"))


@pytest.mark.parametrize(
    ("sn_08", "after_half_a_second", "fault"),
    [(0b0000, 50.0, True), (0b0100, 0.0, True), (0b1000, 30.0, True), (0b1100, 60.0, False)],
)
def test_loss_of_the_line(sn_08: int, after_half_a_second: float, fault: bool) -> None:
    """After 2 s without a sound request the drive does what Sn-08 says, at that very moment."""
    master = Master(drive())
    master.write(0x0107, sn_08)
    master.write(0x0001, RUN, 6000)
    master.wait(4)
    master.word(0x0020)
    master.wait(1.99, polling=False)
    assert not master.drive.state.communication_lost
    master.wait(0.51, polling=False)
    assert master.drive.state.communication_lost
    assert master.drive.state.frequency == pytest.approx(after_half_a_second)
    assert master.drive.state.fault is fault
    assert master.drive.registers[0x002C] & 0x8000
    assert master.drive.registers[0x003D] & 0x40


def test_a_fault_of_the_line_lasts_until_reset(master: Master) -> None:
    master.wait(6, polling=False)
    assert master.word(0x0020) == 0b1000
    assert master.word(0x002C) & 0xC000 == 0xC000
    assert master.word(0x0033) == 0xE
    master.write(0x0001, RESET)
    assert master.word(0x0020) == 0b0100
    assert master.word(0x002C) & 0xC000 == 0


def test_an_alarm_of_the_line_ends_with_the_next_request() -> None:
    master = Master(drive())
    master.write(0x0107, 0b1100)
    master.write(0x0001, RUN, 6000)
    master.wait(4, polling=False)
    assert master.drive.state.communication_lost
    master.word(0x0024)
    master.wait(0.1)
    assert not master.drive.state.communication_lost
    assert master.drive.state.frequency == 60.0


@pytest.mark.parametrize("damage", [b"\x00", b"\xff\xff\xff"])
def test_damaged_frames_do_not_keep_the_line_alive(master: Master, damage: bytes) -> None:
    for _ in range(30):
        assert master.send(read(0x0020, 1)[:-1] + damage) is None
        master.wait(0.1, polling=False)
    assert master.drive.state.communication_lost


def test_requests_to_others_do_not_keep_the_line_alive(master: Master) -> None:
    for _ in range(30):
        assert master.send(read(0x0020, 1, unit=6)) is None
        master.wait(0.1, polling=False)
    assert master.drive.state.communication_lost


def test_a_stopped_drive_does_not_mind_silence() -> None:
    master = Master(drive())
    master.word(0x0020)
    master.wait(100, polling=False)
    assert master.word(0x0020) == 0b0100


def test_a_drive_that_listens_to_its_panel_does_not_mind_silence() -> None:
    master = Master(drive())
    master.write(0x0400, 2000)
    master.write(0x0107, 0b0011)
    master.drive.post(Panel(run=True))
    master.wait(100, polling=False)
    assert master.drive.state.frequency == 20.0
    assert not master.drive.state.communication_lost


@pytest.mark.parametrize("sn_08", [0b0000, 0b1100])
def test_one_silence_is_one_fault(sn_08: int) -> None:
    master = Master(drive())
    master.write(0x0107, sn_08)
    master.write(0x0001, RUN, 6000)
    for _ in range(40):
        master.wait(0.25, polling=False)
    assert master.drive.registers[0x0033] == 0xE


def test_line_errors_stay_unless_switch_s1_7_deletes_them() -> None:
    for delete, left in ((False, 0b1), (True, 0)):
        master = Master(drive(Options(delete_errors=delete)))
        assert master.send(b"\x05\x03\x00\x20\x00\x01\x00\x00") is None
        assert master.word(0x003D) == 0b1
        master.write(0x0001, RESET)
        assert master.word(0x003D) == left
        assert bool(master.word(0x0040) & 0x40) is delete
