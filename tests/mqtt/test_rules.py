"""Publish rules: which tags, how often, and which readings are worth telling."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bridge.api import PointInfo
from gateway.northbound.mqtt.rules import Filter, Rule, rules_for
from gateway.tag import Quality, Sample, ValueType
from tests.fakes import small_catalogue

NUMBER = PointInfo(name="n", group="g", kind="measurement", type=ValueType.NUMBER, rate="fast")
BIT = PointInfo(name="b", group="g", kind="status", type=ValueType.BOOLEAN, rate="fast")
MODE = PointInfo(
    name="m", group="g", kind="status", type=ValueType.INTEGER, rate="fast", values={0: "a", 9: "b"}
)
SETPOINT = PointInfo(
    name="s", group="g", kind="setpoint", type=ValueType.NUMBER, rate="normal", writable=True
)

values = st.floats(-1000, 1000)
steps = st.lists(st.tuples(st.floats(0.01, 20), values), max_size=40)
unhurried = settings(deadline=None)  # the machine may be busy


def test_diagnostics_are_published_only_where_a_rule_names_them() -> None:
    """Safety I2."""
    catalogue = small_catalogue()
    for publish in (None, [{"points": ["*", "*.*"], "rate": 1.0}]):
        assert not any("_" in (tag[0], tag.partition(".")[2][0]) for tag in rules_for(publish, catalogue))
    asked = rules_for([{"points": ["_timeouts", "_north.*"], "rate": 1.0}], catalogue)
    assert set(asked) == {"fan-1._timeouts", "_north.utilisation"}


def reading(value: float | bool | None, quality: Quality = Quality.GOOD) -> Sample:
    return Sample("d.n", value, quality, 1)


def told(
    rule: Rule, readings: list[tuple[float, float]], point: PointInfo = NUMBER
) -> list[tuple[float, float]]:
    """The readings (at, value) that change the state, out of readings given as (pause, value)."""
    known, now, out = Filter.of(rule, point), 0.0, []
    for pause, value in readings:
        now += pause
        if known.due(reading(value), now) and known.tell(reading(value), now):
            out.append((now, value))
    return out


@unhurried
@given(steps, st.floats(0, 100))
def test_what_is_told_differs_by_more_than_the_deadband_from_what_was_told_last(
    readings: list[tuple[float, float]], deadband: float
) -> None:
    out = [value for _, value in told(Rule(0.0, deadband), readings)]
    assert all(abs(b - a) > deadband for a, b in pairwise(out))


@unhurried
@given(steps, st.floats(0, 100))
def test_nobody_who_heard_the_last_told_value_is_off_by_more_than_the_deadband(
    readings: list[tuple[float, float]], deadband: float
) -> None:
    for count in range(1, len(readings) + 1):
        out = told(Rule(0.0, deadband), readings[:count])
        assert abs(readings[count - 1][1] - out[-1][1]) <= deadband


@unhurried
@given(steps, st.floats(0.1, 30))
def test_after_the_longest_silence_the_next_reading_is_told(
    readings: list[tuple[float, float]], silence: float
) -> None:
    at = [time for time, _ in told(Rule(0.0, 1e9, silence), readings)]
    now = last = 0.0
    for count, (pause, _) in enumerate(readings):
        now += pause
        if count == 0 or now - last >= silence:
            assert now in at
            last = now
        else:
            assert now not in at


@unhurried
@given(steps, st.floats(0.5, 10))
def test_numbers_come_no_faster_than_their_rate(readings: list[tuple[float, float]], rate: float) -> None:
    known, now, at = Filter.of(Rule(rate), NUMBER), 0.0, []
    for pause, value in readings:
        now += pause
        if known.due(reading(value), now):
            known.tell(reading(value), now)
            at.append(now)
    if len(at) > 1:
        assert (at[-1] - at[0]) >= (len(at) - 1.5) * rate * 0.99


def test_a_faster_demand_of_somebody_else_is_thinned_to_the_rate() -> None:
    known = Filter.of(Rule(1.0), NUMBER)
    due = [
        count
        for count in range(101)
        if known.due(reading(count), count * 0.1) and known.tell(reading(count), 0)
    ]
    assert len(due) in (11, 12)


def test_jitter_costs_no_reading() -> None:
    known = Filter.of(Rule(1.0), NUMBER)
    for count in range(50):
        now = count + (0.1 if count % 2 else -0.1)
        assert known.due(reading(count), now)
        known.tell(reading(count), now)


def test_a_change_of_quality_always_passes() -> None:
    known = Filter.of(Rule(10.0, 100.0), NUMBER)
    sequence = [Quality.GOOD, Quality.STALE, Quality.NO_COMMUNICATION, Quality.LINE_DOWN, Quality.GOOD]
    for count, quality in enumerate(sequence):
        sample = reading(None if quality in sequence[2:4] else 5.0, quality)
        assert known.due(sample, count * 0.001)
        assert known.tell(sample, count * 0.001)


def test_bits_and_enumerations_pass_at_once_and_ignore_the_deadband() -> None:
    for point, first, second in ((BIT, False, True), (MODE, 0, 9)):
        known = Filter.of(Rule(10.0, 50.0), point)
        assert known.due(reading(first), 0)
        assert known.tell(reading(first), 0)
        assert known.due(reading(second), 0.1)
        assert known.tell(reading(second), 0.1)
        assert not known.due(reading(second), 0.2)


def test_a_setpoint_that_was_written_is_shown_at_once() -> None:
    known = Filter.of(Rule(10.0), SETPOINT)
    assert known.due(reading(10.0), 0)
    assert known.tell(reading(10.0), 0)
    assert known.due(reading(20.0), 0.1)
    assert known.tell(reading(20.0), 0.1)


def test_the_default_is_everything_but_parameters_at_the_rate_of_its_class() -> None:
    rules = rules_for(None, small_catalogue())
    assert rules["fan-1.output_frequency"] == Rule(0.2)
    assert rules["fan-1.frequency_command"] == Rule(1.0)
    assert "fan-1.run_source" not in rules
    assert len(rules) == 8


def test_the_first_entry_that_matches_counts() -> None:
    publish = [
        {"points": ["fan-1.output_f*"], "rate": 0.5, "deadband": 0.05, "max_silence": 60.0},
        {"points": ["pump-2.*"], "rate": 9.0, "deadband": None, "max_silence": None},
        {"points": ["output_*", "run_source"], "rate": 2.0, "deadband": None, "max_silence": None},
    ]
    assert rules_for(publish, small_catalogue()) == {
        "fan-1.output_frequency": Rule(0.5, 0.05, 60.0),
        "fan-1.output_voltage": Rule(2.0),
        "fan-1.run_source": Rule(2.0),
    }
