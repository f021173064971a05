"""What leans on other points: cases, conditions on patterns, selectors; views of a word; repeated words."""

from __future__ import annotations

from fractions import Fraction

import pytest

from gateway.mapping.profile import Constant, Encoding, Limits
from gateway.mapping.values import fitting
from gateway.modbus.encoding import decode
from tests.mapping.texts import good, load_text, small

MODE = "mode: {at: 0001H, values: {0: plain, 1: fine, 2: rough}}\n"


def test_a_case_replaces_keys_of_the_entry_and_keeps_the_others() -> None:
    point = good(
        small(
            MODE
            + "speed: {at: 0002H, kind: setpoint, unit: 1 Hz, range: 0..9, special: {FFFFH: off}, "
            + "cases: [{when: {mode: fine}, unit: 0.1 Hz, range: 0..5}, {offset: 1}]}"
        )
    ).points["speed"]
    fine, other = point.cases
    assert [term.text for term in fine.when] == ["mode: fine"] and other.when == ()
    assert (fine.encoding.scale, fine.limits) == (Fraction(1, 10), Limits(Fraction(0), Fraction(5)))
    assert (other.encoding.scale, other.encoding.offset) == (Fraction(1), Fraction(1))
    assert other.limits == Limits(Fraction(0), Fraction(9))
    assert fine.encoding.special == other.encoding.special == {0xFFFF: "off"}


def test_cases_of_a_group_hold_for_its_points() -> None:
    text = small("load: 0002H").replace(
        "  g:\n",
        "  modes: {points: {mode: 0001H}}\n  g:\n"
        "    cases: [{when: {mode: 0..2}, unit: 1 A}, {unit: 0.1 A}]\n",
    )
    assert [case.encoding.scale for case in good(text).points["load"].cases] == [1, Fraction(1, 10)]
    assert good(text).points["mode"].cases == ()


def test_a_selector_is_written_with_the_value_that_the_author_named() -> None:
    profile = good(
        small("row: {at: 0001H, kind: command, values: {3: third}}\nload: {at: 0002H, select: {row: third}}")
    )
    assert profile.points["load"].select == {"row": Constant(Fraction(3))}
    assert profile.points["row"].select == {}


def test_entries_on_one_register_with_other_selections_do_not_collide() -> None:
    text = (
        "row: {at: 0001H, kind: command}\na: {at: 0002H, select: {row: 1}}\nb: {at: 0002H, select: {row: 2}}"
    )
    assert len(good(small(text)).points) == 3


@pytest.mark.parametrize(
    ("width", "mask", "bits"), [(8, 0x6F, 0x21), (4, 0x8, 0x8), (4, 0x1, 0), (4, 0, 0), (6, 63, 5)]
)
def test_the_ranges_of_a_pattern(width: int, mask: int, bits: int) -> None:
    ranges = fitting(mask, bits, width)
    inside = {raw for raw in range(1 << width) if any(low <= raw <= high for low, high in ranges)}
    assert inside == {raw for raw in range(1 << width) if raw & mask == bits}
    assert len(inside) == sum(high - low + 1 for low, high in ranges)


def test_a_pattern_names_what_is_read() -> None:
    encoding = Encoding(values={0: "none"}, patterns=((0b110, 0b010, "up"), (0b110, 0b100, "down")))
    assert [decode(encoding, (word,)).text for word in (0, 2, 3, 0xF004, 6)] == [
        "none",
        "up",
        "up",
        "down",
        None,
    ]


def test_patterns_of_a_field_see_the_field_alone() -> None:
    text = "word: {at: 0001H, bits: {state: {bit: 4..6, values: {x1B: odd, 1x0B: big}}, low: 0..3}}"
    encoding = good(small(text)).points["state"].encoding
    assert [decode(encoding, (word,)).text for word in (0x010, 0xFF4F, 0x061, 0x021)] == [
        "odd",
        "big",
        "big",
        None,
    ]


def test_a_condition_may_mix_patterns_names_and_numbers() -> None:
    text = "state: {at: 0001H, values: {0x1B: ready, 0: off}}\na: {at: 0002H, when: {state: [ready, off, 7]}}"
    (term,) = good(small(text.replace("0x1B", "1x1B"))).points["a"].when
    held = [raw for raw in range(32) if any(low <= raw <= high for low, high in term.ranges)]
    assert held == [0, 5, 7, 13, 15, 21, 23, 29, 31]


def test_a_cut_register_may_be_repeated() -> None:
    profile = good(
        small(
            "axis_<n>: {at: 0010H, repeat: 1..3, stride: 4, image: true, kind: switch, "
            "bits: {on_<n>: 0, speed_<n>: {bit: 1..2}, rest: {bit: 3..15, always: 0}}}"
        )
    )
    assert list(profile.words) == [0x10, 0x14, 0x18]
    assert [word.fields for word in profile.words.values()] == [(f"on_{n}", f"speed_{n}") for n in (1, 2, 3)]
    assert all(word.image and word.always_mask == 0xFFF8 for word in profile.words.values())
    assert profile.points["speed_2"].address == 0x14


def test_similar_documents_are_told_of_once() -> None:
    points = "\n".join(f"p_{n}: {{at: {n:04X}H, kind: switch, source: s 1}}" for n in range(1, 6))
    profile, findings = load_text(small(points))
    assert profile is not None
    assert [finding.message for finding in findings] == [
        "`p_1`, `p_2`, `p_3` and 2 more: written, but known from similar models only"
    ]
