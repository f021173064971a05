"""T3 on a simulated drive: steps too big are refused, setpoints are ramped, what comes too soon waits."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bridge.api import ControlState
from gateway.core.pacing import towards
from gateway.mapping.profile import Pace
from gateway.simulator.faults import DropReply
from gateway.tag import Cause, Outcome, Verdict
from tests.core.world import ENGINEER, OPERATOR, World, make_site

SPEED = "fan-1.frequency_command"


def paced(**pace: object) -> World:
    world = World(make_site(limits={"frequency_command": Pace(**pace)}))  # type: ignore[arg-type]
    world.run(1.0)
    return world


def steps(world: World) -> list[tuple[float, Fraction]]:
    """When each frame that carries a frequency left, and which: 0002H holds it in 0.01 Hz."""
    found = []
    for at, frame in world.wire:
        data = bytes.fromhex(frame)
        if data[1] != 0x10:
            continue
        first, count = int.from_bytes(data[2:4]), int.from_bytes(data[4:6])
        if first <= 2 < first + count:
            word = data[7 + 2 * (2 - first) : 9 + 2 * (2 - first)]
            found.append((at, Fraction(int.from_bytes(word), 100)))
    return found


def check_rate(found: list[tuple[float, Fraction]], slew: Fraction, base: Fraction = Fraction(0)) -> None:
    """No frame changes more than the rate allows for the time since the one before it."""
    before = base
    for index, (at, value) in enumerate(found):
        apart = 0.5 if index == 0 else at - found[index - 1][0]
        assert abs(value - before) <= slew * Fraction(max(apart, 0.5)) + Fraction(1, 10**6)
        assert index == 0 or apart >= 0.5
        before = value


def test_t3_a_step_too_big_is_refused_and_nothing_is_sent() -> None:
    world = paced(step=Fraction(10))
    assert world.write(SPEED, 10.0).verdict is Verdict.CONFIRMED
    outcome = world.write(SPEED, 20.01)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.STEP)
    assert "10.01 Hz from the present 10" in outcome.reason
    assert [value for _, value in steps(world)] == [10]
    assert world.write(SPEED, 0.5).verdict is Verdict.CONFIRMED


def test_t3_a_setpoint_is_ramped_and_confirmed_with_its_last_value() -> None:
    world = paced(slew=Fraction(2))
    begun = world.now
    outcome = world.write(SPEED, 7.3)
    assert (outcome.verdict, outcome.value) == (Verdict.CONFIRMED, 7.3)
    found = steps(world)
    assert [float(value) for _, value in found] == [1, 2, 3, 4, 5, 6, 7, 7.3]
    check_rate(found, Fraction(2))
    assert 3.4 < world.now - begun < 4.5


def test_t3_a_ramp_is_shown_while_it_lasts() -> None:
    world = paced(slew=Fraction(2))
    world.watch({SPEED: 0.2})
    asked = world.ask_write(SPEED, 7.0)
    world.run(1.5)
    shown = [m.ramps for m in world.told[world.session] if isinstance(m, ControlState)]
    assert shown[-1] == {"frequency_command": 7.0}
    assert asked() is None
    world.until(asked, 10.0)
    shown = [m.ramps for m in world.told[world.session] if isinstance(m, ControlState)]
    assert shown[-1] == {}
    values = [s.value for s in world.samples(SPEED)]
    assert values == sorted(values, key=lambda v: v or 0)
    assert len(set(values)) > 4, "each step shows"


def test_t3_the_newest_target_wins_and_never_faster_than_allowed() -> None:
    world = paced(slew=Fraction(2))
    first = world.ask_write(SPEED, 10.0)
    world.run(1.6)
    second = world.ask_write(SPEED, 20.0)
    world.run(0.1)
    third = world.ask_write(SPEED, 6.0)
    outcome = world.until(third, 10.0)
    assert outcome.verdict is Verdict.CONFIRMED
    for asked in (first, second):
        told = asked()
        assert told is not None and told.verdict is Verdict.SUPERSEDED
    found = steps(world)
    assert found[-1][1] == 6
    check_rate(found, Fraction(2))


def test_t3_a_ramp_that_was_overtaken_does_not_go_on_when_the_newer_one_is_done_first() -> None:
    world = paced(slew=Fraction(7))
    older = world.ask_write(SPEED, 10.8)
    world.run(1.5)
    newer = world.ask_write(SPEED, 7.0)
    assert world.until(newer, 10.0).verdict is Verdict.CONFIRMED
    world.run(5.0)
    told = older()
    assert told is not None and told.verdict is Verdict.SUPERSEDED
    assert steps(world)[-1][1] == 7, "the newest target stands"
    check_rate(steps(world), Fraction(7))


def test_t3_a_stop_ends_the_ramp_at_once() -> None:
    world = paced(slew=Fraction(2))
    running = world.ask_command("run_forward", frequency=20.0)
    world.run(3.0)
    assert world.command("stop").verdict is Verdict.CONFIRMED
    told = running()
    assert told is not None and told.verdict is Verdict.SUPERSEDED
    before = len(steps(world))
    world.run(10.0)
    assert len(steps(world)) == before


def test_t3_a_run_begins_near_zero_and_is_confirmed_at_its_frequency() -> None:
    world = paced(slew=Fraction(5))
    world.write(SPEED, 50.0, ttl=5.0)
    outcome = world.command("run_forward", frequency=30.0)
    assert (outcome.verdict, outcome.value) == (Verdict.CONFIRMED, 30.0)
    begun = [i for i, (_, frame) in enumerate(world.wire) if frame.startswith("05 10 00 01 00 02")]
    run_at = world.wire[begun[0]][0]
    found = [(at, value) for at, value in steps(world) if at >= run_at]
    assert found[0][1] == Fraction(5, 2), "a motor at rest begins at zero, whatever the register holds"
    check_rate(found, Fraction(5))
    assert found[-1][1] == 30
    [running] = world.read("fan-1.running")
    assert running.value is True


def test_t3_a_run_may_be_no_bigger_step_than_a_write() -> None:
    world = paced(step=Fraction(10))
    outcome = world.command("run_forward", frequency=30.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.STEP)
    assert world.command("run_forward", frequency=10.0).verdict is Verdict.CONFIRMED
    assert world.command("run_forward", frequency=20.0).verdict is Verdict.CONFIRMED
    assert world.command("run_forward", frequency=31.0).cause is Cause.STEP


def test_t3_others_may_write_between_the_frames_of_a_ramp() -> None:
    world = paced(slew=Fraction(1))
    ramp = world.ask_write(SPEED, 5.0)
    world.run(1.0)
    begun = world.now
    assert world.write("fan-1.input_5", True, OPERATOR).verdict is Verdict.CONFIRMED
    assert world.now - begun < 0.6
    assert world.until(ramp, 10.0).verdict is Verdict.CONFIRMED


def test_t3_h5_a_ramp_goes_on_only_from_a_value_that_the_drive_shows() -> None:
    world = paced(slew=Fraction(2))
    asked = world.ask_write(SPEED, 4.0)
    world.run(0.6)
    world.drives["fan-1"].faults.inject(DropReply())
    outcome = world.until(asked, 20.0)
    assert outcome.verdict is Verdict.CONFIRMED
    check_rate(steps(world), Fraction(2))


def test_t3_of_setpoints_within_the_interval_the_newest_waits_its_turn() -> None:
    world = paced(interval=2.0)
    world.write(SPEED, 10.0)
    asked = []
    for value in (11.0, 12.0, 13.0):
        asked.append(world.ask_write(SPEED, value))
        world.run(0.2)
    assert world.until(asked[-1], 5.0).verdict is Verdict.CONFIRMED
    assert [outcome.verdict for outcome in told(asked[:2])] == [Verdict.SUPERSEDED] * 2
    found = steps(world)
    assert [value for _, value in found] == [10, 13]
    assert found[1][0] - found[0][0] >= 2.0


def told(asked: list[object]) -> list[Outcome]:
    outcomes = [ask() for ask in asked]  # type: ignore[operator]
    assert all(outcomes)
    return outcomes


def test_t3_a_setpoint_whose_turn_comes_too_late_is_told_when() -> None:
    world = paced(interval=30.0)
    world.write(SPEED, 10.0)
    outcome = world.write(SPEED, 11.0, ttl=5.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.TOO_SOON)
    assert "ask again in 30" in outcome.reason
    world.run(30.0)
    assert world.write(SPEED, 11.0).verdict is Verdict.CONFIRMED


def test_t3_other_points_are_refused_within_the_interval() -> None:
    world = World(make_site(limits={"acceleration_time_1": Pace(interval=10.0)}))
    world.run(1.0)
    assert world.write("fan-1.acceleration_time_1", 5.0, ENGINEER).verdict is Verdict.CONFIRMED
    outcome = world.write("fan-1.acceleration_time_1", 6.0, ENGINEER)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.TOO_SOON)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(0, 600), st.floats(0.05, 3.0)),
        min_size=1,
        max_size=8,
    ),
    st.sampled_from([Fraction(1, 10), Fraction(1), Fraction(7), Fraction(60)]),
)
def test_t3_whatever_is_asked_the_wire_never_sees_a_faster_change(
    targets: list[tuple[int, float]], slew: Fraction
) -> None:
    world = paced(slew=slew)
    asked = []
    for tenths, pause in targets:
        asked.append(world.ask_write(SPEED, tenths / 10))
        world.run(pause)
    world.run(5.0)
    check_rate(steps(world), slew)
    done = [ask() for ask in asked]
    assert all(outcome is None or outcome.verdict is not Verdict.FAILED for outcome in done)
    newest = done[-1]
    if newest is not None:
        assert newest.verdict is Verdict.CONFIRMED
        assert steps(world)[-1][1] == Fraction(targets[-1][0], 10), "the newest target stands"


NUMBERS = st.fractions(min_value=-1000, max_value=1000, max_denominator=1000)
COUNTS = st.fractions(min_value=Fraction(1, 1000), max_value=10, max_denominator=1000)


@given(NUMBERS, NUMBERS, st.fractions(min_value=0, max_value=100), COUNTS)
def test_t3_a_step_towards_a_target_never_reaches_too_far(
    base: Fraction, target: Fraction, most: Fraction, count: Fraction
) -> None:
    value = towards(base, target, most, count)
    assert abs(value - base) <= most
    assert abs(target - value) <= abs(target - base)
    if most >= count and target != base:
        assert value != base or abs(target - base) > most
    if value != target:
        assert ((value - base) / count).denominator == 1


@pytest.mark.parametrize("role", [OPERATOR, ENGINEER])
def test_t3_nobody_is_too_important_for_the_pace(role: object) -> None:
    world = paced(step=Fraction(1))
    assert world.write(SPEED, 5.0, role).cause is Cause.STEP  # type: ignore[arg-type]
