"""RTU frames as a drive sees them (Modbus over serial line V1.02; application protocol V1.1b3)."""

from __future__ import annotations

from dataclasses import dataclass

READ, WRITE = 0x03, 0x10
REQUEST_LENGTH = 8
"""Bytes of a request to read."""
WRITE_HEAD = 7
"""Bytes of a request to write, up to and with its byte count."""


def _entry(byte: int) -> int:
    for _ in range(8):
        byte = byte >> 1 ^ (0xA001 if byte & 1 else 0)
    return byte


_TABLE = tuple(_entry(byte) for byte in range(256))


def checked(body: bytes) -> bytes:
    """The frame: ``body`` and its CRC."""
    register = 0xFFFF
    for byte in body:
        register = register >> 8 ^ _TABLE[(register ^ byte) & 0xFF]
    return body + bytes((register & 0xFF, register >> 8))


@dataclass(frozen=True, slots=True)
class Request:
    """What a master asks: ``words`` to be written, or None for a read of ``count`` registers."""

    unit: int
    function: int
    address: int
    count: int
    words: tuple[int, ...] | None = None


def expected_length(data: bytes) -> int | None:
    """Bytes of the request that begins like this; None when that cannot be told."""
    if len(data) < 2:
        return REQUEST_LENGTH
    if data[1] == READ:
        return REQUEST_LENGTH
    if data[1] == WRITE:
        return WRITE_HEAD + data[6] + 2 if len(data) >= WRITE_HEAD else WRITE_HEAD + 2
    return None


def parse(frame: bytes) -> Request | None:
    """The request in a frame; None when it is damaged or nothing that these drives know."""
    if len(frame) < REQUEST_LENGTH or checked(frame[:-2]) != frame:
        return None
    address, count = int.from_bytes(frame[2:4], "big"), int.from_bytes(frame[4:6], "big")
    if frame[1] == READ:
        return Request(frame[0], READ, address, count)
    if frame[1] != WRITE:
        return None
    data = frame[WRITE_HEAD:-2]
    words = tuple(int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2))
    return Request(frame[0], WRITE, address, count, words)
