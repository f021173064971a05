"""A fixed budget of fuzzing for each framing, and the fuzzer notices what it is for."""

from __future__ import annotations

import binascii
from typing import get_args

import pytest

from gateway.modbus import ascii as ascii_module
from gateway.modbus import pdu as pdu_module
from gateway.modbus import rtu as rtu_module
from gateway.modbus.framing import FramingName
from tests.modbus.fuzz.target import fuzz

INPUTS = 3000


@pytest.mark.parametrize("name", get_args(FramingName))
def test_nothing_escapes_and_only_a_frame_is_a_reply(name: FramingName) -> None:
    assert len(fuzz(name, INPUTS, seed=1)) > 30


def test_a_check_that_is_left_out_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    right = rtu_module.crc
    monkeypatch.setattr(rtu_module, "crc", lambda data: right(data) if len(data) % 2 else data[:0])
    with pytest.raises(AssertionError):
        fuzz("rtu", INPUTS, seed=1)


def test_what_escapes_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def strict(text: bytes) -> bytes:
        return binascii.unhexlify(text[1:])[:-1]

    monkeypatch.setattr(ascii_module, "_unpacked", strict)
    with pytest.raises(AssertionError, match="ascii, seed 1"):
        fuzz("ascii", INPUTS, seed=1)


def test_another_units_frame_that_is_taken_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    right = pdu_module.interpret

    def careless(request: pdu_module.Request, pdu: bytes) -> pdu_module.Reply | None:
        return right(request, pdu) or (pdu_module.Reply() if len(pdu) == request.reply_length else None)

    monkeypatch.setattr("gateway.modbus.tcp.interpret", careless)
    with pytest.raises(AssertionError, match="tcp, seed 1"):
        fuzz("tcp", INPUTS, seed=1)
