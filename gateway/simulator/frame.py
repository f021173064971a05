"""Modbus RTU frames as a drive sees them. Written apart from `gateway.modbus` on purpose, so that a
mistake in one is not hidden by the same mistake in the other."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

SHORTEST = 4
"""Unit, function and two check bytes."""
LONGEST = 256


class LineError(StrEnum):
    """What a receiver can find wrong with a frame, or with the lack of frames."""

    CRC = "crc"
    LENGTH = "length"
    TIMEOUT = "timeout"


@dataclass(frozen=True, slots=True)
class Request:
    """An undamaged frame: whom it is for, the function code, and the bytes between it and the CRC."""

    unit: int
    function: int
    data: bytes


class DamagedError(Exception):
    """A frame that cannot be taken for a request."""

    def __init__(self, error: LineError) -> None:
        super().__init__(error)
        self.error = error


@dataclass(frozen=True, slots=True)
class ReadRequest:
    """The data of function 03H."""

    address: int
    count: int


@dataclass(frozen=True, slots=True)
class WriteRequest:
    """The data of function 10H. ``byte_count`` is as sent and need not fit ``count``."""

    address: int
    count: int
    byte_count: int
    words: tuple[int, ...]


def crc16(data: bytes) -> int:
    """The check value of ``data``, by the procedure of the 7200GS manual, section 7 (4) A to F."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc >> 8) ^ _CRC_OF_BYTE[(crc ^ byte) & 0xFF]
    return crc


def seal(content: bytes) -> bytes:
    """``content`` with its check value behind it, low byte first."""
    return content + crc16(content).to_bytes(2, "little")


def unseal(frame: bytes) -> Request:
    """The request in a frame, with its check value verified."""
    if not SHORTEST <= len(frame) <= LONGEST:
        raise DamagedError(LineError.LENGTH)
    if seal(frame[:-2]) != frame:
        raise DamagedError(LineError.CRC)
    return Request(frame[0], frame[1], frame[2:-2])


def parse_read(data: bytes) -> ReadRequest:
    """The data of a read; its length is fixed."""
    if len(data) != 4:
        raise DamagedError(LineError.LENGTH)
    return ReadRequest(_word(data, 0), _word(data, 2))


def parse_write(data: bytes) -> WriteRequest:
    """The data of a write; its length must be what its byte count announces."""
    if len(data) < 5 or len(data) != 5 + data[4]:
        raise DamagedError(LineError.LENGTH)
    words = tuple(_word(data, at) for at in range(5, len(data) - 1, 2))
    return WriteRequest(_word(data, 0), _word(data, 2), data[4], words)


def read_reply(unit: int, words: tuple[int, ...]) -> bytes:
    """The normal reply to function 03H."""
    content = b"".join(word.to_bytes(2, "big") for word in words)
    return seal(bytes((unit, 0x03, len(content))) + content)


def write_reply(unit: int, address: int, count: int) -> bytes:
    """The normal reply to function 10H."""
    return seal(bytes((unit, 0x10)) + address.to_bytes(2, "big") + count.to_bytes(2, "big"))


def error_reply(unit: int, function: int, code: int) -> bytes:
    """The reply of a drive that refuses."""
    return seal(bytes((unit, function | 0x80, code)))


def _word(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 2], "big")


def _shifted_out(byte: int) -> int:
    """The effect of one byte on the check value: steps C and D, eight times."""
    crc = byte
    for _ in range(8):
        crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return crc


_CRC_OF_BYTE = tuple(_shifted_out(byte) for byte in range(256))
