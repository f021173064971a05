"""Words of people, turned into tags, values and arguments."""

from __future__ import annotations

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.tag import ValueType
from gateway.terminal.errors import UsageError
from gateway.terminal.words import (
    arguments,
    as_meant,
    command_named,
    commanded_named,
    find_drive,
    read_value,
    select,
    split,
)
from tests.fakes import small_catalogue

CATALOGUE = small_catalogue()
SOURCES = {0: "line", 1: "operator_or_terminals"}


def test_without_patterns_what_is_monitored() -> None:
    assert select(CATALOGUE, []) == [
        "fan-1.running",
        "fan-1.output_frequency",
        "fan-1.output_voltage",
        "fan-1.scan_count",
        "fan-1.fault_overcurrent",
    ]


def test_patterns_overlap_once() -> None:
    found = select(CATALOGUE, ["fan-1.output_*", "fan-1.output_frequency"])
    assert found == ["fan-1.output_frequency", "fan-1.output_voltage"]


def test_a_pattern_that_names_nothing_is_an_error() -> None:
    with pytest.raises(UsageError, match=r"did you mean fan-1\.output_frequency"):
        select(CATALOGUE, ["fan-1.output_frequenzy"])


@pytest.mark.parametrize(
    ("text", "type", "values", "expected"),
    [
        ("60", ValueType.NUMBER, {}, 60.0),
        ("-0.5", ValueType.NUMBER, {}, -0.5),
        ("on", ValueType.BOOLEAN, {}, True),
        ("False", ValueType.BOOLEAN, {}, False),
        ("7", ValueType.INTEGER, {}, 7),
        ("line", ValueType.INTEGER, SOURCES, "line"),
        ("1", ValueType.INTEGER, SOURCES, 1),
        ("60", ValueType.TEXT, {}, "60"),
    ],
)
def test_values(text: str, type: ValueType, values: dict[int, str], expected: object) -> None:
    value = read_value(text, type, values)
    assert (value, value.__class__) == (expected, expected.__class__)


@pytest.mark.parametrize(
    ("text", "type", "values"),
    [
        ("nan", ValueType.NUMBER, {}),
        ("inf", ValueType.NUMBER, {}),
        ("-infinity", ValueType.NUMBER, {}),
        ("1e999", ValueType.NUMBER, {}),
        ("sixty", ValueType.NUMBER, {}),
        ("1.5", ValueType.INTEGER, {}),
        ("2", ValueType.BOOLEAN, {}),
        ("2", ValueType.INTEGER, SOURCES),
        ("lime", ValueType.INTEGER, SOURCES),
        ("\N{SUPERSCRIPT TWO}", ValueType.INTEGER, SOURCES),
    ],
)
def test_what_is_no_value(text: str, type: ValueType, values: dict[int, str]) -> None:
    with pytest.raises(UsageError):
        read_value(text, type, values)


@given(st.text(max_size=12))
def test_a_number_is_finite_or_refused(text: str) -> None:
    try:
        value = read_value(text, ValueType.NUMBER, {})
    except UsageError:
        return
    assert isinstance(value, float)
    assert math.isfinite(value)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_survive(number: float) -> None:
    assert read_value(repr(number), ValueType.NUMBER, {}) == number


def test_arguments_of_a_command() -> None:
    command = command_named(find_drive(CATALOGUE, "fan-1"), "run_forward")
    assert arguments(command, ["frequency=60"]) == {"frequency": 60.0}
    assert arguments(command, []) == {}


def test_what_cannot_be_read_is_left_for_the_core_to_refuse() -> None:
    command = command_named(find_drive(CATALOGUE, "fan-1"), "run_forward")
    assert arguments(command, ["frequency=fast", "frequenzy=60"]) == {"frequency": "fast", "frequenzy": "60"}
    assert arguments(None, ["height=3"]) == {"height": "3"}
    assert as_meant("nan", ValueType.NUMBER, {}) == "nan"
    assert as_meant("lime", ValueType.INTEGER, SOURCES) == "lime"
    assert as_meant("12.5", ValueType.NUMBER, {}) == 12.5


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["frequency=60", "frequency=50"], "given twice"),
        (["frequency"], "NAME=VALUE is expected"),
        (["frequency="], "NAME=VALUE is expected"),
    ],
)
def test_wrong_arguments(words: list[str], message: str) -> None:
    command = command_named(find_drive(CATALOGUE, "fan-1"), "run_forward")
    with pytest.raises(UsageError, match=message):
        arguments(command, words)


def test_unknown_names() -> None:
    with pytest.raises(UsageError, match="did you mean fan-1"):
        find_drive(CATALOGUE, "fan1")
    assert command_named(find_drive(CATALOGUE, "fan-1"), "stopp") is None
    assert command_named(None, "stop") is None


def test_only_the_first_equals_sign_splits() -> None:
    assert split("fan-1.label=a=b") == ("fan-1.label", "a=b")


def test_a_line_is_commanded_by_its_name_or_the_gateways_name_for_it() -> None:
    line = CATALOGUE.lines[0]
    assert commanded_named(CATALOGUE, "north") is line
    assert commanded_named(CATALOGUE, "_north") is line
    assert command_named(line, "stop_all") is line.commands[0]
    assert commanded_named(CATALOGUE, "nort") is None


def test_a_drive_that_is_called_like_a_line_goes_first() -> None:
    [fan] = CATALOGUE.drives
    renamed = msgspec.structs.replace(fan, name="north")
    assert commanded_named(msgspec.structs.replace(CATALOGUE, drives=(renamed,)), "north") is renamed
