"""What stands in a frame, whatever its framing: requests as a drive takes them apart, and its replies."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class LineError(StrEnum):
    """What a receiver can find wrong with a frame, or with the lack of frames."""

    CRC = "crc"
    LENGTH = "length"
    TIMEOUT = "timeout"


@dataclass(frozen=True, slots=True)
class Request:
    """An undamaged frame: whom it is for, the function code, and the bytes up to the check value."""

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


def parse_read(data: bytes) -> ReadRequest:
    """The data of a read; its length is fixed."""
    if len(data) != 4:
        raise DamagedError(LineError.LENGTH)
    return ReadRequest(_word(data, 0), _word(data, 2))


def parse_write_one(data: bytes) -> WriteRequest:
    """The data of function 06H, as a write of one register."""
    if len(data) != 4:
        raise DamagedError(LineError.LENGTH)
    return WriteRequest(_word(data, 0), 1, 2, (_word(data, 2),))


def parse_write(data: bytes) -> WriteRequest:
    """The data of a write; its length must be what its byte count announces."""
    if len(data) < 5 or len(data) != 5 + data[4]:
        raise DamagedError(LineError.LENGTH)
    words = tuple(_word(data, at) for at in range(5, len(data) - 1, 2))
    return WriteRequest(_word(data, 0), _word(data, 2), data[4], words)


def parse_loop_back(data: bytes) -> int:
    """The sub-function of function 08H."""
    if len(data) != 4:
        raise DamagedError(LineError.LENGTH)
    return _word(data, 0)


def echo(unit: int, function: int, data: bytes) -> bytes:
    """The reply that repeats the request: functions 06H and 08H."""
    return bytes((unit, function)) + data


def read_reply(unit: int, words: tuple[int, ...]) -> bytes:
    """The normal reply to function 03H."""
    content = b"".join(word.to_bytes(2, "big") for word in words)
    return bytes((unit, 0x03, len(content))) + content


def write_reply(unit: int, address: int, count: int) -> bytes:
    """The normal reply to function 10H."""
    return bytes((unit, 0x10)) + address.to_bytes(2, "big") + count.to_bytes(2, "big")


def error_reply(unit: int, function: int, code: int) -> bytes:
    """The reply of a drive that refuses."""
    return bytes((unit, function | 0x80, code))


def _word(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 2], "big")
