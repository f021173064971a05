"""What is a frame, written a second time from the standards: bit by bit, with nothing of the gateway's."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Frame:
    """A whole frame with a right check: unit, and PDU."""

    unit: int
    pdu: bytes


def rtu(data: bytes) -> Frame | None:
    """Serial line V1.02, 2.5.1 and 6.2.2: unit, PDU, CRC-16 with the low byte first."""
    register = 0xFFFF
    for byte in data[:-2]:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0xA001 if register & 1 else 0)
    right = len(data) >= 4 and register.to_bytes(2, "little") == data[-2:]
    return Frame(data[0], data[1:-2]) if right else None


def ascii_(data: bytes) -> Frame | None:
    """Serial line V1.02, 2.5.2 and 6.2.1: colon, two digits a byte, LRC, CR LF."""
    digits = data[1:-2]
    if data[:1] != b":" or data[-2:] != b"\r\n" or len(digits) < 6 or len(digits) % 2:
        return None
    if not all(digit in b"0123456789ABCDEFabcdef" for digit in digits):
        return None
    values = [int(digits[at : at + 2], 16) for at in range(0, len(digits), 2)]
    return Frame(values[0], bytes(values[1:-1])) if sum(values) % 256 == 0 else None


def tcp(data: bytes) -> Frame | None:
    """Messaging on TCP/IP V1.0b, 3.1.3: seven bytes of header; the number is looked at elsewhere."""
    if len(data) < 8 or data[2:4] != b"\0\0" or int.from_bytes(data[4:6], "big") != len(data) - 6:
        return None
    return Frame(data[6], data[7:])


def tcp_frames(data: bytes) -> Iterator[tuple[bytes, Frame]]:
    """Numbers and frames of a stream, one behind another, up to where it is out of step or ends."""
    while len(data) >= 6:
        size = 6 + int.from_bytes(data[4:6], "big")
        if (frame := tcp(data[:size])) is None:
            return
        yield data[:2], frame
        data = data[size:]


CHECKS = {"rtu": rtu, "ascii": ascii_, "tcp": tcp}
