"""Requests are what the standard says; a reply must be the reply to this request."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.modbus import pdu
from gateway.modbus.framing import framing_of
from gateway.modbus.pdu import Reply

WORDS = st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=20)


def words_pdu(function: int, words: list[int]) -> bytes:
    return bytes((function, 2 * len(words))) + b"".join(word.to_bytes(2, "big") for word in words)


@given(WORDS, st.sampled_from([pdu.READ_HOLDING, pdu.READ_INPUT]))
def test_registers_read(words: list[int], function: int) -> None:
    request = pdu.read_registers(0x20, len(words), function)
    assert pdu.interpret(request, words_pdu(function, words)) == Reply(tuple(words))


@given(WORDS, st.integers(1, 20))
def test_other_quantity_is_no_reply(words: list[int], asked: int) -> None:
    reply = pdu.interpret(pdu.read_registers(0, asked), words_pdu(3, words))
    assert (reply is None) == (asked != len(words))


def test_input_registers_do_not_answer_for_holding_registers() -> None:
    assert pdu.interpret(pdu.read_registers(0, 1), words_pdu(pdu.READ_INPUT, [1])) is None


@pytest.mark.parametrize("other", ["06 00 01 17 71", "06 00 02 17 70", "10 00 01 17 70", "06 00 01 17"])
def test_write_one_must_be_echoed(other: str) -> None:
    request = pdu.write_register(1, 0x1770)
    assert request.pdu.hex(" ") == "06 00 01 17 70"
    assert pdu.interpret(request, request.pdu) == Reply()
    assert pdu.interpret(request, bytes.fromhex(other)) is None


@pytest.mark.parametrize("other", ["10 00 01 00 01", "10 00 02 00 02", "10 00 01 00 02 04", "06 00 01 00 02"])
def test_write_many_echoes_address_and_quantity(other: str) -> None:
    request = pdu.write_registers(1, [1, 6000])
    assert request.pdu.hex(" ") == "10 00 01 00 02 04 00 01 17 70"
    assert pdu.interpret(request, bytes.fromhex("10 00 01 00 02")) == Reply()
    assert pdu.interpret(request, bytes.fromhex(other)) is None


def test_loop_back_must_bring_the_same_nonce() -> None:
    request = pdu.loop_back(0xA537)
    assert request.pdu.hex(" ") == "08 00 00 a5 37"
    assert pdu.interpret(request, request.pdu) == Reply()
    assert pdu.interpret(request, pdu.loop_back(0xA538).pdu) is None


@given(st.integers(0, 255))
def test_every_exception_code_is_a_number(code: int) -> None:
    request = pdu.write_registers(1, [1])
    assert pdu.interpret(request, bytes((0x90, code))) == Reply(exception=code)
    assert pdu.interpret(request, bytes((0x83, code))) is None


@given(st.binary(max_size=40))
def test_nothing_that_comes_in_crashes(data: bytes) -> None:
    for request in (pdu.read_registers(0, 3), pdu.write_register(1, 2), pdu.loop_back(3)):
        pdu.interpret(request, data)


@pytest.mark.parametrize(
    "make",
    [
        lambda: pdu.read_registers(0, 0),
        lambda: pdu.read_registers(0, 126),
        lambda: pdu.read_registers(0xFFFF, 2),
        lambda: pdu.read_registers(-1, 1),
        lambda: pdu.write_registers(0, []),
        lambda: pdu.write_registers(0, [0] * 124),
        lambda: pdu.write_registers(0, [0x10000]),
        lambda: pdu.write_register(0, -1),
        lambda: pdu.write_register(0x10000, 0),
        lambda: pdu.loop_back(0x10000),
    ],
)
def test_impossible_requests_are_refused(make) -> None:
    with pytest.raises(ValueError, match=r"."):
        make()


@given(st.integers(0x20, 0xFF), st.integers(0, 0xFF))
def test_error_functions_of_a_drive_are_exceptions(byte: int, code: int) -> None:
    plain = pdu.read_registers(0x20, 1)
    request = replace(plain, error_functions=(byte,))
    assert pdu.interpret(request, bytes((byte, code))) == Reply(exception=code)
    assert pdu.interpret(request, bytes((0x83, code))) == Reply(exception=code)
    assert (pdu.interpret(plain, bytes((byte, code))) is None) == (byte != 0x83)
    for name in ("rtu", "ascii", "tcp"):
        framing = framing_of(name)
        sent = framing.encode(5, request.pdu)
        answer = framing.encode(5, bytes((byte, code)))
        if framing.numbered:
            answer = sent[:2] + answer[2:]
        assert framing.seeker(sent, request).feed(answer) == Reply(exception=code)
