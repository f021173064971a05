"""The small forms: what they read, what they refuse, and that nothing is lost on the way."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.mapping import forms
from gateway.mapping.forms import FormError, Placeholder, Range
from gateway.mapping.profile import SerialFormat
from gateway.mapping.units import SYMBOLS

whole = st.integers(0, 10**9)
decimals = st.decimals(allow_nan=False, allow_infinity=False, places=4, min_value=-(10**9), max_value=10**9)


@given(decimals)
def test_a_decimal_number_is_exact(value: object) -> None:
    assert forms.number(f"{value:f}") == Fraction(str(value))


@given(whole)
def test_hex_and_binary(value: int) -> None:
    assert forms.number(f"{value:04X}H") == value
    assert forms.number(f"{value:b}B") == value


@pytest.mark.parametrize(
    "text",
    ["", "1e3", "0x10", "+5", ".5", "5.", "1_000", "0eH", "12:30", "on", "H", "B", "12B", "- 5", "٣", "1 "],
)
def test_what_is_no_number(text: str) -> None:
    with pytest.raises(FormError):
        forms.number(text)


def test_leading_zeros_mean_nothing() -> None:
    assert forms.number("0600") == 600
    assert forms.number("1110") == 1110
    assert forms.number("1110B") == 14


@given(decimals, decimals)
def test_a_range_keeps_its_ends(one: object, other: object) -> None:
    low, high = sorted([one, other], key=lambda value: Fraction(str(value)))
    assert forms.span(f"{low:f}..{high:f}") == Range(Fraction(str(low)), Fraction(str(high)))


def test_a_range_may_end_in_a_name() -> None:
    assert forms.span("0..max_frequency") == Range(Fraction(0), "max_frequency")


@given(st.integers(1, 10**6), st.integers(1, 10**6), st.sampled_from(sorted(SYMBOLS)))
def test_a_unit_keeps_its_fraction(top: int, bottom: int, symbol: str) -> None:
    unit = forms.unit(f"{top}/{bottom} {symbol}")
    assert (unit.scale, unit.symbol) == (Fraction(top, bottom), symbol)


@given(st.integers(0, 10**7))
def test_a_duration_is_seconds(milliseconds: int) -> None:
    assert forms.duration(f"{milliseconds}ms") == milliseconds / 1000
    assert forms.duration(f"{milliseconds / 1000:.3f}s") == milliseconds / 1000


@given(st.integers(0, 15), st.integers(0, 15))
def test_bit_positions(first: int, last: int) -> None:
    for one, other in ((f"{first}", f"{last}"), (f"{first:X}", f"{last:X}")):
        if first <= last:
            assert forms.bits(f"{one}..{other}") == (first, last - first + 1)
        else:
            with pytest.raises(FormError):
                forms.bits(f"{one}..{other}")


@pytest.mark.parametrize("parity", "NEO")
@pytest.mark.parametrize(("data", "stop"), [(7, 1), (7, 2), (8, 1), (8, 2)])
def test_a_serial_format_comes_back(data: int, parity: str, stop: int) -> None:
    text = f"{data}{parity}{stop}"
    assert str(forms.serial_format(text)) == text
    assert isinstance(forms.serial_format(text), SerialFormat)


def test_placeholders_fill_the_whole_value() -> None:
    assert forms.placeholder("<frequency>") == Placeholder("frequency", negate=False)
    assert forms.placeholder("-<frequency>") == Placeholder("frequency", negate=True)
    assert forms.placeholder("1<frequency>") is None


FORMS = [
    forms.number,
    forms.integer,
    forms.pattern,
    forms.span,
    forms.numbers_span,
    forms.integers_span,
    forms.unit,
    forms.duration,
    forms.durations,
    forms.truth,
    forms.name,
    forms.bits,
    forms.serial_format,
]


@given(st.text(max_size=60), st.sampled_from(FORMS))
def test_any_text_is_read_or_refused_with_words(text: str, form: object) -> None:
    try:
        form(text)  # type: ignore[operator]
    except FormError as error:
        assert error.message and error.remedy
