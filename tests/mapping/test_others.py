"""Drives of other makes, completed from the sketches with which the language was tried: it fits them."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from gateway.mapping.load import load_profile
from gateway.mapping.profile import Argument, Constant, Profile, Table
from gateway.modbus.encoding import decode
from tests.mapping.roundtrip import check_round_trips

OTHERS = Path(__file__).parent / "others"
WARNED = {
    "delta-vfd": "delta-vfd.yaml:28:5: warning: no case of `output_current` holds while current_decimals: 0 "
    "(add one, or a last one without `when`)",
}
WARNED["automationdirect-gs4"] = WARNED["delta-vfd"]


def other(name: str) -> Profile:
    profile, findings = load_profile(OTHERS / f"{name}.yaml")
    warned = [f"{OTHERS}/{WARNED[name]}"] if name in WARNED else []
    assert [str(finding) for finding in findings] == warned
    assert profile is not None
    return profile


@pytest.mark.parametrize("name", sorted(file.stem for file in OTHERS.glob("*.yaml")))
def test_it_loads_and_every_point_comes_back(name: str) -> None:
    profile = other(name)
    assert check_round_trips(profile) >= len(profile.points)


def test_danfoss_selects_an_index_before_each_access() -> None:
    profile = other("danfoss-fc")
    current, alarm = profile.points["output_current"], profile.points["alarm_code_2"]
    assert (current.address, current.words, current.select) == (
        0x3F0B,
        2,
        {"array_index": Constant(Fraction(0))},
    )
    assert (alarm.address, alarm.select) == (15299, {"array_index": Constant(Fraction(2))})
    assert decode(current.encoding, (0x0001, 0x0000)).value == 655.36


def test_abb_turns_the_sign_of_an_argument() -> None:
    profile = other("abb-acs")
    assert profile.commands["run_reverse"].steps[0].write["speed_command"] == Argument("speed", negate=True)
    speed = profile.points["speed_command"]
    assert (speed.address, speed.encoding.scale, speed.encoding.times) == (
        1,
        Fraction(1, 20000),
        "speed_scaling",
    )
    assert profile.points["status_word"].encoding.word_order == "low_first"


@pytest.mark.parametrize(("bits", "frame"), [(0, 0x047E), (0x0001, 0x047F), (0x0801, 0x0C7F)])
def test_v20_control_word(bits: int, frame: int) -> None:
    word = other("siemens-v20").words[0x63]
    assert bits & ~word.always_mask | word.always_bits == frame


def test_delta_decimals_from_another_register() -> None:
    current = other("delta-vfd").points["output_current"]
    assert [(str(case.when[0].text), case.encoding.scale) for case in current.cases] == [
        ("current_decimals: 1", Fraction(1, 10)),
        ("current_decimals: 2", Fraction(1, 100)),
    ]


def test_gs4_is_delta_with_one_decimal() -> None:
    ours, theirs = other("automationdirect-gs4"), other("delta-vfd")
    assert (ours.name, ours.title, ours.version) == (
        "automationdirect-gs4",
        "AutomationDirect GS4",
        theirs.version,
    )
    frequency = ours.points["frequency_command"]
    assert (frequency.address, frequency.encoding.scale) == (0x2001, Fraction(1, 10))
    assert theirs.points["frequency_command"].encoding.scale == Fraction(1, 100)
    assert [name for name in theirs.points if theirs.points[name] != ours.points[name]] == [
        "frequency_command"
    ]
    assert list(ours.points) == list(theirs.points) and ours.commands == theirs.commands


@pytest.mark.parametrize(
    ("word", "state"),
    [
        (0x0250, "switch_on_disabled"),
        (0x0231, "ready_to_switch_on"),
        (0x0233, "switched_on"),
        (0x8637, "operation_enabled"),
        (0x0607, "quick_stop"),
        (0x021F, "fault_reaction"),
        (0x0218, "fault"),
        (0x0000, "not_ready"),
        (0x0005, None),
    ],
)
def test_cia402_states(word: int, state: str | None) -> None:
    point = other("altivar").points["drive_state"]
    assert decode(point.encoding, (word,)).text == state
    assert decode(point.encoding, (word,)).value == word


def test_cia402_a_condition_means_every_word_of_the_state() -> None:
    steps = other("altivar").commands["run_forward"].steps
    (ready,) = steps[0].until
    (later,) = steps[1].until
    assert all(any(low <= word <= high for low, high in ready.ranges) for word in (0x21, 0x31, 0x8231))
    assert not any(low <= 0x33 <= high for low, high in ready.ranges)
    assert all(any(low <= word <= high for low, high in later.ranges) for word in (0x23, 0x37, 0x8637))


def test_a_notation_may_mean_a_table_that_no_point_uses() -> None:
    assert {point.table for point in other("danfoss-fc").points.values()} == {Table.HOLDING}
