"""What people and programs read on standard output."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.bridge.api import PointInfo
from gateway.tag import Cause, Outcome, Quality, Sample, Value, ValueType, Verdict
from gateway.terminal.board import Board
from gateway.terminal.output import (
    is_named,
    moment,
    outcome_line,
    outcome_object,
    sample_line,
    sample_object,
    value_text,
    with_unit,
)
from gateway.terminal.words import points_by_tag
from tests.fakes import small_catalogue

POINTS = points_by_tag(small_catalogue())
FREQUENCY = POINTS["fan-1.output_frequency"]
NOON = 1_795_521_600_123_456_789


def test_moments_are_utc_to_the_millisecond() -> None:
    assert moment(NOON) == "2026-11-24T12:00:00.123Z"


@pytest.mark.parametrize(
    ("value", "tag", "expected"),
    [
        (59.98, "fan-1.output_frequency", "59.98 Hz"),
        (60.0, "fan-1.output_frequency", "60.00 Hz"),
        (380.0, "fan-1.output_voltage", "380 V"),
        (True, "fan-1.running", "on"),
        (12, "fan-1.scan_count", "12"),
    ],
)
def test_values_with_units(value: float, tag: str, expected: str) -> None:
    assert with_unit(value, POINTS[tag]) == expected


def test_a_sample_for_people() -> None:
    sample = Sample("fan-1.output_frequency", 59.98, Quality.GOOD, NOON)
    assert (
        sample_line(sample, FREQUENCY) == "2026-11-24T12:00:00.123Z  fan-1.output_frequency  59.98 Hz  good"
    )


def test_a_bad_sample_says_why() -> None:
    sample = Sample("fan-1.output_frequency", None, Quality.NO_COMMUNICATION, NOON, reason="no answer")
    assert sample_line(sample, FREQUENCY).endswith("- (no answer)  no_communication")


def test_a_sample_for_programs() -> None:
    sample = Sample("fan-1.output_frequency", 59.98, Quality.STALE, NOON, age=0.45)
    assert sample_object(sample, FREQUENCY) == {
        "tag": "fan-1.output_frequency",
        "value": 59.98,
        "text": None,
        "unit": "Hz",
        "quality": "stale",
        "severity": "uncertain",
        "time": "2026-11-24T12:00:00.123Z",
        "age": 0.45,
        "reason": "",
    }


def test_an_outcome_says_what_the_drive_shows() -> None:
    outcome = Outcome(
        verdict=Verdict.FAILED, cause=Cause.NOT_PROVED, reason="it shows another value", value=30.0
    )
    line = outcome_line("fan-1.frequency_command=60", outcome)
    assert line == "failed  fan-1.frequency_command=60: it shows another value (the drive shows 30.0)"


def info(type: ValueType, **more: Any) -> PointInfo:
    return PointInfo(name="p", group="g", kind="parameter", rate="slow", type=type, **more)


@pytest.mark.parametrize(
    ("point", "value", "shown"),
    [
        (info(ValueType.INTEGER, values={1: "by_g1_03"}), 1, "by_g1_03"),
        (info(ValueType.BOOLEAN), True, "on"),
        (info(ValueType.NUMBER, unit="Hz", step=0.1), 30.0, "30.0 Hz"),
    ],
)
def test_an_outcome_shows_the_value_as_a_reading_does(point: PointInfo, value: Value, shown: str) -> None:
    outcome = Outcome(verdict=Verdict.CONFIRMED, value=value)
    assert outcome_line("it", outcome, point) == f"confirmed  it (the drive shows {shown})"


def test_what_is_no_number_and_has_a_name_is_shown_by_it() -> None:
    point = info(ValueType.INTEGER)
    off = Sample("d.p", None, Quality.NOT_APPLICABLE, NOON, text="switched_off", reason="switched_off")
    bad = Sample("d.p", None, Quality.INVALID, NOON, text="invalid", reason="invalid")
    assert (value_text(off, point), is_named(off)) == ("switched_off", True)
    assert (value_text(bad, point), is_named(bad)) == ("- (invalid)", False)


def test_an_outcome_for_programs_has_no_moment_that_never_came() -> None:
    found = outcome_object(Outcome(verdict=Verdict.EXPIRED, cause=Cause.EXPIRED, asked=NOON))
    assert (found["verdict"], found["asked"], found["sent"]) == ("expired", "2026-11-24T12:00:00.123Z", None)


def test_the_board_tells_only_changes() -> None:
    board = Board(POINTS, ["fan-1.output_frequency"])
    first = Sample("fan-1.output_frequency", 1.0, Quality.GOOD, NOON)
    again = Sample("fan-1.output_frequency", 1.0, Quality.GOOD, NOON + 1)
    stale = Sample("fan-1.output_frequency", 1.0, Quality.STALE, NOON + 2)
    assert board.line() == "output_frequency=?"
    assert [board.take([sample]) for sample in (first, again, stale)] == [[first], [], [stale]]
    assert board.line() == "output_frequency=1.00 Hz"
    assert board.table().row_count == 1
