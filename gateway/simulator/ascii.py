"""ASCII frames as a drive sees them: a colon, two capital hexadecimal digits for each byte, an LRC, and
CR LF. Written apart from `gateway.modbus` on purpose, like `rtu`."""

from __future__ import annotations

from gateway.simulator.frame import DamagedError, LineError, Request

START, END = b":", b"\r\n"
SHORTEST = 3
"""Unit, function and LRC."""
LONGEST = 255
_DIGITS = frozenset(b"0123456789ABCDEF")


def lrc(data: bytes) -> int:
    """What makes the sum of all bytes zero, counted in eight bits."""
    return -sum(data) & 0xFF


def seal(content: bytes) -> bytes:
    """``content`` as characters on the wire."""
    return START + (content + bytes((lrc(content),))).hex().upper().encode("ascii") + END


def unseal(frame: bytes) -> Request:
    """The request in the characters up to CR LF; whatever stands before the last colon is forgotten."""
    characters = frame[frame.rfind(START) + 1 :].removesuffix(END)
    if START not in frame or not frame.endswith(END) or len(characters) % 2:
        raise DamagedError(LineError.LENGTH)
    if not _DIGITS.issuperset(characters):
        raise DamagedError(LineError.CRC)
    content = bytes.fromhex(characters.decode("ascii"))
    if not SHORTEST <= len(content) <= LONGEST:
        raise DamagedError(LineError.LENGTH)
    if lrc(content):
        raise DamagedError(LineError.CRC)
    return Request(content[0], content[1], content[2:-1])
