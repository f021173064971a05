"""Ramps, direction, sources of command, and what the monitor registers show of it."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.simulator import Options, Panel, PanelSets, PowerCycle
from gateway.simulator.motor import Motor
from tests.simulator.master import Master, read
from tests.simulator.plant import drive

FORWARD_60 = (0x0001, 6000)
REVERSE_30 = (0x0003, 3000)


@pytest.fixture
def master() -> Master:
    return Master(drive())


def test_ramp_reaches_60_hz_in_the_acceleration_time(master: Master) -> None:
    master.write(0x0001, *FORWARD_60)
    master.wait(1.5)
    assert master.word(0x0024) == 3000
    master.wait(1.49)
    assert master.word(0x0024) == 5980
    master.wait(0.02)
    assert master.word(0x0024) == 6000


def test_a_new_speed_leaves_the_run_bit(master: Master) -> None:
    master.write(0x0001, *FORWARD_60)
    master.wait(4)
    master.write(0x0002, 1500)
    assert master.word(0x0001) == 1
    master.wait(4)
    assert master.drive.state.frequency == 15.0


def test_reverse_goes_through_zero(master: Master) -> None:
    master.write(0x0001, *FORWARD_60)
    master.wait(3)
    master.write(0x0001, *REVERSE_30)
    master.wait(2.9)
    assert master.drive.state.frequency == pytest.approx(2.0)
    assert master.word(0x0020) & 0b11 == 0b01
    master.wait(0.2)
    assert master.drive.state.frequency == pytest.approx(-2.0)
    assert master.word(0x0020) & 0b11 == 0b11
    master.wait(2)
    assert master.drive.state.frequency == -30.0
    assert master.word(0x0024) == 3000


def test_stop_decelerates_and_running_ends_at_rest(master: Master) -> None:
    master.write(0x0001, *FORWARD_60)
    master.wait(3)
    master.write(0x0001, 0)
    master.wait(1)
    assert master.word(0x0020) & 1
    assert master.drive.state.frequency == pytest.approx(40.0)
    master.wait(2.01)
    assert master.word(0x0020) == 0b100
    assert master.word(0x0024) == 0


def test_coasting_stop_by_sn_04(master: Master) -> None:
    master.write(0x0103, 0b0111)
    master.write(0x0001, *FORWARD_60)
    master.wait(3)
    master.write(0x0001, 0)
    master.wait(0.01)
    assert master.word(0x0024) == 0


def test_ramp_times_are_registers(master: Master) -> None:
    master.write(0x0500, 100, 50)
    master.write(0x0001, *FORWARD_60)
    master.wait(5)
    assert master.drive.state.frequency == pytest.approx(30.0)
    master.write(0x0001, 0)
    master.wait(1)
    assert master.drive.state.frequency == pytest.approx(18.0)


def test_speed_option_shortens_ramps() -> None:
    master = Master(drive(Options(speed=10)))
    master.write(0x0001, *FORWARD_60)
    master.wait(0.31)
    assert master.drive.state.frequency == 60.0


def test_forbidden_reverse_stands_still(master: Master) -> None:
    master.write(0x0104, 0b0010)
    master.write(0x0001, *REVERSE_30)
    master.wait(3)
    assert master.drive.state.frequency == 0.0
    assert master.word(0x0020) & 0b10 == 0


def test_run_from_the_line_is_ignored_when_sn_08_says_so(master: Master) -> None:
    master.write(0x0107, 0b0010)
    master.write(0x0001, *FORWARD_60)
    master.wait(3)
    assert master.word(0x0001) == 1
    assert master.word(0x0020) & 1 == 0
    master.drive.post(Panel(run=True))
    master.wait(3)
    assert master.drive.state.frequency == 60.0
    assert master.word(0x002C) & 0x600 == 0x400


def test_frequency_from_an_01_when_sn_08_says_so(master: Master) -> None:
    master.write(0x0400, 2000)
    master.write(0x0107, 0b0001)
    master.write(0x0001, *FORWARD_60)
    master.wait(3)
    assert master.word(0x0023) == 2000
    assert master.drive.state.frequency == 20.0


def test_frequency_from_unwired_terminals_is_zero(master: Master) -> None:
    master.write(0x0103, 0b0010)
    master.write(0x0107, 0b0001)
    master.write(0x0001, *FORWARD_60)
    master.wait(3)
    assert master.drive.state.frequency == 0.0


def test_status_words_follow(master: Master) -> None:
    assert master.word(0x0020) == 0b0100
    assert master.word(0x002C) == 0b0100_0010
    master.write(0x0009, 0b101)
    master.write(0x0001, *FORWARD_60)
    master.wait(4)
    assert master.word(0x0020) == 0b1010_0101
    assert master.word(0x002C) == 0b0100_0101
    assert master.word(0x002D) == 0b101


def test_electrical_values_follow_the_speed(master: Master) -> None:
    at_rest = master.read(0x0027, 2), master.word(0x0031), master.word(0x0032)
    assert at_rest == ([0, 0], 297, 0)
    master.write(0x0001, *FORWARD_60)
    master.wait(1.5)
    accelerating = master.word(0x0027)
    master.wait(2)
    current, voltage = master.read(0x0027, 2)
    assert voltage == 220
    assert 40 <= current <= 60
    assert accelerating > 30
    assert master.word(0x0031) < 297
    assert 10 <= master.word(0x0032) <= 20
    master.write(0x0002, 0)
    master.wait(0.5)
    assert master.word(0x0031) > 297


def test_power_cycle_forgets_commands_and_keeps_parameters(master: Master) -> None:
    master.write(0x0501, 40)
    master.write(0x0001, *FORWARD_60)
    master.wait(2)
    master.drive.post(PowerCycle())
    master.wait(0.1)
    assert master.read(0x0001, 2) == [0, 0]
    assert master.word(0x0501) == 40
    assert master.word(0x0020) == 0b0100
    assert master.word(0x0040) & 0x1F == 5


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.floats(-400, 400), st.floats(0, 20)), max_size=20),
    st.floats(0.1, 1000),
    st.floats(0.1, 1000),
)
def test_ramp_never_overshoots_nor_exceeds_its_rate(
    moves: list[tuple[float, float]], up: float, down: float
) -> None:
    motor = Motor()
    for target, seconds in moves:
        before = motor.frequency
        motor.ramp(target, up, down, seconds)
        assert min(before, target) <= motor.frequency <= max(before, target)
        assert abs(motor.frequency - before) <= max(up, down) * seconds * (1 + 1e-9) + 1e-9


@settings(deadline=None)
@given(st.floats(-60, 60), st.floats(-60, 60), st.lists(st.floats(0.001, 1), min_size=1, max_size=30))
def test_ramp_does_not_depend_on_how_often_it_is_looked_at(
    start: float, target: float, pieces: list[float]
) -> None:
    once, often = Motor(frequency=start), Motor(frequency=start)
    once.ramp(target, 20, 10, sum(pieces))
    for piece in pieces:
        often.ramp(target, 20, 10, piece)
    assert often.frequency == pytest.approx(once.frequency, abs=1e-6)


def test_a_loss_of_the_mains_takes_commands_and_keeps_parameters(master: Master) -> None:
    master.write(0x0401, 700)
    master.write(0x0001, *FORWARD_60)
    master.wait(4)
    master.drive.post(PowerCycle(away=2.0))
    master.wait(1, polling=False)
    assert master.send(read(0x0001, 1)) is None
    master.wait(2, polling=False)
    assert (master.word(0x0001), master.word(0x0002), master.word(0x0401)) == (0, 0, 700)
    assert not master.drive.state.running


def test_a_drive_that_latches_its_run_starts_again_by_itself(master: Master) -> None:
    master.write(0x0001, *FORWARD_60)
    master.wait(4)
    master.drive.post(PowerCycle(latched=True))
    master.wait(4)
    assert (master.word(0x0001), master.word(0x0020) & 1) == (0, 1)
    assert master.drive.state.frequency == 60.0
    master.write(0x0001, 0)
    master.wait(4)
    assert not master.drive.state.running


def test_a_hand_on_the_panel_changes_a_parameter(master: Master) -> None:
    master.drive.post(PanelSets("run_source", 1))
    master.wait(1)
    assert master.word(0x0107) == 0b0010
