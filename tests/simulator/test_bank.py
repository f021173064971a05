"""Named values in registers."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.mapping.profile import Access, Encoding, Kind, NumberType, Point, Table
from gateway.simulator import UnsupportedError
from gateway.simulator.bank import Bank
from gateway.simulator.refusal import RefusalError


def bank_of(encoding: Encoding, table: Table = Table.HOLDING) -> Bank:
    point = Point(
        name="x",
        group="all",
        kind=Kind.STATUS,
        access=Access.READ,
        rate="fast",
        address=7,
        encoding=encoding,
        table=table,
    )
    return Bank([(7, 8)], {"x": point}, {"poles": Fraction(2)})


@settings(deadline=None)
@given(st.integers(0, 0xFFFF))
def test_every_count_comes_back(raw: int) -> None:
    bank = bank_of(Encoding(scale=Fraction(1, 100)))
    bank.set("x", raw / 100)
    assert bank.words[7] == raw
    assert bank.get("x") == pytest.approx(raw / 100)


@settings(deadline=None)
@given(st.integers(0, 0xFFFF), st.integers(0, 12), st.integers(1, 4), st.integers(0, 15))
def test_a_field_leaves_its_neighbours(word: int, bit: int, width: int, value: int) -> None:
    bank = bank_of(Encoding(bit=bit, width=width))
    bank.words[7] = word
    bank.set("x", value)
    mask = ((1 << width) - 1) << bit
    assert bank.words[7] & ~mask == word & ~mask
    assert bank.get("x") == min(value, (1 << width) - 1)


def test_values_are_held_within_the_register() -> None:
    bank = bank_of(Encoding(scale=Fraction(1, 10)))
    bank.set("x", 1e9)
    assert bank.words[7] == 0xFFFF
    bank.set("x", -1)
    assert bank.words[7] == 0


def test_signed_values() -> None:
    bank = bank_of(Encoding(type=NumberType.S16, offset=Fraction(-10)))
    bank.set("x", -20)
    assert (bank.words[7], bank.get("x")) == (0xFFF6, -20)
    bank.set("x", -1e6)
    assert bank.words[7] == 0x8000


@pytest.mark.parametrize(
    ("encoding", "value", "words"),
    [
        (Encoding(type=NumberType.U32, words=2), 0x12345678, (0x1234, 0x5678)),
        (Encoding(type=NumberType.U32, words=2, word_order="low_first"), 0x12345678, (0x5678, 0x1234)),
        (Encoding(type=NumberType.S32, words=2), -2, (0xFFFF, 0xFFFE)),
        (Encoding(type=NumberType.F32, words=2), 1.5, (0x3FC0, 0x0000)),
        (Encoding(type=NumberType.BCD), 1234, (0x1234, 0)),
        (Encoding(times="poles", scale=Fraction(1, 120)), 50, (3000, 0)),
        (Encoding(bit=4, width=1, active_low=True), 1, (0, 0)),
        (Encoding(bit=4, width=1, active_low=True), 0, (0x10, 0)),
    ],
)
def test_every_kind_of_number(encoding: Encoding, value: float, words: tuple[int, int]) -> None:
    bank = bank_of(encoding)
    bank.set("x", value)
    assert (bank.words[7], bank.words[8]) == words
    assert bank.get("x") == value


def test_what_is_not_modelled_is_said() -> None:
    with pytest.raises(UnsupportedError, match="x: only holding registers"):
        bank_of(Encoding(), Table.INPUT)


def test_addresses_that_do_not_exist() -> None:
    bank = Bank([(1, 2), (4, 4)], {})
    assert bank.read(1, 2) == (0, 0)
    for address, count in ((0, 1), (2, 2), (3, 1), (4, 2)):
        with pytest.raises(RefusalError, match="illegal_address"):
            bank.read(address, count)


def test_a_block_may_pass_over_holes_where_the_drive_allows_it() -> None:
    bank = Bank([(1, 2), (4, 4)], {})
    bank.words[4] = 7
    assert bank.read(2, 4, bridge=True) == (0, 0, 7, 0)
    for address, count in ((3, 1), (5, 1), (5, 2)):
        with pytest.raises(RefusalError, match="illegal_address"):
            bank.read(address, count, bridge=True)
