"""The documents' own frames: built byte for byte, and understood."""

import pytest

from gateway.modbus import pdu
from gateway.modbus.ascii import AsciiFraming
from gateway.modbus.rtu import RtuFraming, crc
from tests.modbus.printed import S2000, S2000_ERRATA, SL3, SL3_ASCII, TECO_7200GS, Erratum, Exchange

RTU = [*TECO_7200GS, *S2000, *SL3]


def request_in(body: bytes) -> pdu.Request:
    """The request that a printed unit and PDU stand for."""
    address = int.from_bytes(body[2:4], "big")
    number = int.from_bytes(body[4:6], "big")
    match body[1]:
        case pdu.READ_HOLDING:
            return pdu.read_registers(address, number)
        case pdu.WRITE_ONE:
            return pdu.write_register(address, number)
        case pdu.DIAGNOSTICS:
            return pdu.loop_back(number)
        case _:
            words = [int.from_bytes(body[i : i + 2], "big") for i in range(7, len(body), 2)]
            return pdu.write_registers(address, words)


def meaning(exchange: Exchange) -> pdu.Reply:
    """What the printed RTU reply says, worked out by hand from its bytes."""
    reply = bytes.fromhex(exchange.reply)
    if reply[1] & 0x80:
        return pdu.Reply(exception=reply[2])
    if reply[1] == pdu.READ_HOLDING:
        return pdu.Reply(tuple(int.from_bytes(reply[i : i + 2], "big") for i in range(3, len(reply) - 2, 2)))
    return pdu.Reply()


@pytest.mark.parametrize("exchange", RTU, ids=lambda e: e.name)
def test_rtu_exchange(exchange: Exchange) -> None:
    printed = bytes.fromhex(exchange.request)
    request = request_in(printed[:-2])
    framing = RtuFraming()
    sent = framing.encode(printed[0], request.pdu)
    assert sent == printed
    assert framing.seeker(sent, request).feed(bytes.fromhex(exchange.reply)) == meaning(exchange)


@pytest.mark.parametrize("exchange", SL3_ASCII, ids=lambda e: e.name)
def test_ascii_exchange(exchange: Exchange) -> None:
    printed = bytes.fromhex(exchange.request)
    body = bytes.fromhex(printed[1:-4].decode())
    request = request_in(body)
    framing = AsciiFraming()
    sent = framing.encode(body[0], request.pdu)
    assert sent == printed
    reply = framing.seeker(sent, request).feed(bytes.fromhex(exchange.reply))
    assert reply == pdu.Reply((0xFFFF,) if exchange.name == "example 2" else ())


@pytest.mark.parametrize("erratum", S2000_ERRATA, ids=lambda e: e.name)
def test_misprinted_check_bytes(erratum: Erratum) -> None:
    body = bytes.fromhex(erratum.body)
    assert crc(body) == bytes.fromhex(erratum.right)
    assert crc(body) != bytes.fromhex(erratum.printed)


def test_enter_commands_are_built_with_the_right_crc() -> None:
    for erratum in S2000_ERRATA[:2]:
        body = bytes.fromhex(erratum.body)
        frame = RtuFraming().encode(1, request_in(body).pdu)
        assert frame == body + bytes.fromhex(erratum.right)


def test_misprinted_error_is_silence_and_the_right_one_is_an_answer() -> None:
    erratum = S2000_ERRATA[2]
    request = pdu.loop_back(0xA537)
    framing = RtuFraming()
    seeker = framing.seeker(framing.encode(1, request.pdu), request)
    assert seeker.feed(bytes.fromhex(erratum.body + erratum.printed)) is None
    assert seeker.feed(bytes.fromhex(erratum.body + erratum.right)) == pdu.Reply(exception=1)
