"""RTU frames as a drive sees them. Written apart from `gateway.modbus` on purpose, so that a mistake in
one is not hidden by the same mistake in the other."""

from __future__ import annotations

from gateway.simulator.frame import DamagedError, LineError, Request

SHORTEST = 4
"""Unit, function and two check bytes."""
LONGEST = 256


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


def _shifted_out(byte: int) -> int:
    """The effect of one byte on the check value: steps C and D, eight times."""
    crc = byte
    for _ in range(8):
        crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return crc


_CRC_OF_BYTE = tuple(_shifted_out(byte) for byte in range(256))
