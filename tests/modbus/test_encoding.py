"""Raw words and values, both ways, exactly."""

import math
import struct
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.mapping.profile import Encoding, NumberType
from gateway.modbus.encoding import (
    NOT_A_NUMBER,
    NOT_DECIMAL,
    Decoded,
    EncodingError,
    decode,
    encode,
    extract,
    insert,
    to_words,
)

N = NumberType
HZ = Encoding(scale=Fraction(1, 100), symbol="Hz")

sizes = {N.U16: 1, N.S16: 1, N.U32: 2, N.S32: 2, N.U64: 4, N.BCD: 1}
orders = st.sampled_from(["high_first", "low_first"])
words = st.integers(0, 0xFFFF)


@st.composite
def integers(draw: st.DrawFn) -> Encoding:
    kind = draw(st.sampled_from(list(sizes)))
    return Encoding(
        type=kind,
        words=sizes[kind],
        word_order=draw(orders),
        scale=draw(st.fractions(min_value=Fraction(1, 1000), max_value=1000)),
        offset=draw(st.fractions(min_value=-1000, max_value=1000)),
        symbol="x",
    )


@st.composite
def fields(draw: st.DrawFn) -> Encoding:
    width = draw(st.integers(1, 16))
    return Encoding(
        bit=draw(st.integers(0, 16 - width)),
        width=width,
        type=draw(st.sampled_from([N.U16, N.S16])),
        active_low=draw(st.booleans()),
    )


@given(integers(), st.data(), st.fractions(min_value=Fraction(1, 7), max_value=50))
def test_the_value_is_the_float_nearest_to_the_exact_one(
    encoding: Encoding, data: st.DataObject, times: Fraction
) -> None:
    raw_words = tuple(data.draw(st.lists(words, min_size=encoding.words, max_size=encoding.words)))
    decoded = decode(encoding, raw_words, times)
    if decoded.special is None:
        raw = extract(encoding, raw_words)
        assert decoded.value == float(raw * encoding.scale * times + encoding.offset)


@given(integers(), st.data(), st.fractions(min_value=Fraction(1, 7), max_value=50))
def test_raw_to_value_to_raw_is_identity(encoding: Encoding, data: st.DataObject, times: Fraction) -> None:
    size = 16 * encoding.words
    low, high = {
        N.S16: (-(2**15), 2**15 - 1),
        N.S32: (-(2**31), 2**31 - 1),
        N.BCD: (0, 9999),
    }.get(encoding.type, (0, 2**size - 1))
    raw = data.draw(st.integers(low, high))
    value = raw * encoding.scale * times + encoding.offset
    assert encode(encoding, value, times) == raw
    registers = to_words(encoding, raw)
    assert len(registers) == encoding.words
    assert all(0 <= word <= 0xFFFF for word in registers)
    assert extract(encoding, registers) == raw
    assert decode(encoding, registers, times).value == float(value)


@given(fields(), words, st.data())
def test_fields_keep_their_neighbours(encoding: Encoding, word: int, data: st.DataObject) -> None:
    signed = encoding.type is N.S16
    low, high = (
        (-(1 << encoding.width - 1), (1 << encoding.width - 1) - 1)
        if signed
        else (0, (1 << encoding.width) - 1)
    )
    raw = data.draw(st.integers(low, high))
    changed = insert(encoding, raw, word)
    mask = ((1 << encoding.width) - 1) << encoding.bit
    assert extract(encoding, [changed]) == raw
    assert changed & ~mask == word & ~mask
    assert 0 <= changed <= 0xFFFF
    with pytest.raises(EncodingError):
        insert(encoding, high + 1, word)
    with pytest.raises(EncodingError):
        insert(encoding, low - 1, word)


@given(st.floats(width=32, allow_nan=False, allow_infinity=False), orders)
def test_single_floats(number: float, order) -> None:
    encoding = Encoding(type=N.F32, words=2, word_order=order)
    registers = to_words(encoding, encode(encoding, Fraction(number)))
    assert decode(encoding, registers).value == number
    high, low = registers if order == "high_first" else registers[::-1]
    assert struct.unpack(">f", struct.pack(">HH", high, low))[0] == number


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_floats_that_are_no_numbers(number: float) -> None:
    registers = struct.unpack(">HH", struct.pack(">f", number))
    assert decode(Encoding(type=N.F32, words=2), registers) == Decoded(None, special=NOT_A_NUMBER)


def test_frequency_of_the_7200gs() -> None:
    assert encode(HZ, Fraction(60)) == 0x1770
    assert decode(HZ, [0x1770]) == Decoded(60.0)
    assert decode(HZ, [6001]).value == 60.01


def test_master_speed_input_is_exact() -> None:
    encoding = Encoding(scale=Fraction(10, 1023), symbol="V")
    assert decode(encoding, [1023]).value == 10.0
    assert decode(encoding, [1]).value == 10 / 1023


def test_plain_integers_stay_integers() -> None:
    value = decode(Encoding(type=N.U64, words=4), [0xFFFF] * 4).value
    assert value == 2**64 - 1
    assert type(value) is int


def test_a_unit_makes_a_number_even_when_whole() -> None:
    assert type(decode(Encoding(symbol="V"), [230]).value) is float


@pytest.mark.parametrize(("half", "even"), [("0.125", 12), ("0.135", 14), ("-0.005", 0)])
def test_ties_go_to_even(half: str, even: int) -> None:
    assert encode(HZ, Fraction(half)) == even


@pytest.mark.parametrize("value", ["655.36", "-0.01", "1000000"])
def test_what_does_not_fit_is_refused(value: str) -> None:
    with pytest.raises(EncodingError, match="does not fit"):
        encode(HZ, Fraction(value))


def test_a_value_that_would_mean_something_else_is_refused() -> None:
    encoding = Encoding(scale=Fraction(1, 100), symbol="Hz", special={0xFFFF: "switched_off"})
    assert decode(encoding, [0xFFFF]) == Decoded(None, special="switched_off")
    with pytest.raises(EncodingError, match="switched_off"):
        encode(encoding, Fraction("655.35"))
    assert encode(encoding, Fraction("655.34")) == 0xFFFE


def test_special_of_a_signed_value_may_be_given_as_bits() -> None:
    for key in (0x8000, -0x8000):
        encoding = Encoding(type=N.S16, special={key: "none"}, scale=Fraction(1, 10), symbol="A")
        assert decode(encoding, [0x8000]).special == "none"
        assert decode(encoding, [0x8001]).value == -3276.7
        with pytest.raises(EncodingError):
            encode(encoding, Fraction(-32768, 10))


def test_enumerations() -> None:
    encoding = Encoding(bit=2, width=2, values={0: "decelerate", 3: "keep_running"})
    assert decode(encoding, [0b1100]) == Decoded(3, text="keep_running")
    assert decode(encoding, [0b0100]) == Decoded(1, text=None)
    assert encode(encoding, Fraction(3)) == 3
    for wrong in (Fraction(4), Fraction(1, 2), Fraction(-1)):
        with pytest.raises(EncodingError):
            encode(encoding, wrong)


def test_bits() -> None:
    run = Encoding(bit=0, width=1)
    assert decode(run, [3]) == Decoded(True)
    assert decode(run, [2]) == Decoded(False)
    assert insert(run, 0, 0xFFFF) == 0xFFFE
    low = Encoding(bit=15, width=1, active_low=True)
    assert decode(low, [0x7FFF]) == Decoded(True)
    assert insert(low, 1, 0xFFFF) == 0x7FFF
    with pytest.raises(EncodingError):
        encode(run, Fraction(2))


def test_bcd() -> None:
    encoding = Encoding(type=N.BCD)
    assert decode(encoding, [0x1234]).value == 1234
    assert to_words(encoding, 1234) == (0x1234,)
    assert decode(encoding, [0x12A4]) == Decoded(None, special=NOT_DECIMAL)
    with pytest.raises(EncodingError, match="digit"):
        extract(encoding, [0x12A4])
    with pytest.raises(EncodingError):
        encode(encoding, Fraction(10000))


def test_text() -> None:
    encoding = Encoding(type=N.TEXT, words=3)
    assert decode(encoding, [0x4142, 0x4320, 0x0000]) == Decoded("ABC")
    with pytest.raises(EncodingError, match="text"):
        encode(encoding, Fraction(1))


def test_words_must_be_as_many_as_the_value_has() -> None:
    with pytest.raises(EncodingError, match="words"):
        decode(Encoding(type=N.U32, words=2), [1])


def test_a_field_is_never_written_without_its_word() -> None:
    with pytest.raises(EncodingError, match="field"):
        to_words(Encoding(bit=0, width=1), 1)
    with pytest.raises(EncodingError, match="field"):
        insert(Encoding(), 1, 0)


def test_a_scale_of_zero_is_refused() -> None:
    with pytest.raises(EncodingError, match="zero"):
        encode(HZ, Fraction(1), times=Fraction(0))


def test_too_large_a_float_is_refused() -> None:
    with pytest.raises(EncodingError, match="float"):
        encode(Encoding(type=N.F32, words=2), Fraction(10) ** 60)


@given(st.lists(words, min_size=1, max_size=4), st.sampled_from(list(N)), orders)
def test_decoding_never_crashes(registers: list[int], kind: NumberType, order) -> None:
    size = 2 if kind is N.F32 else len(registers)
    decode(Encoding(type=kind, words=size, word_order=order), (registers * 2)[:size])
