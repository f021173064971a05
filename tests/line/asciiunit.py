"""ASCII frames told from the standard, apart from `gateway.modbus`: colon, hexadecimal digits, LRC, CR LF."""

from __future__ import annotations

from dataclasses import dataclass

from tests.line.bench import FakeUnit, frame


def ascii_frame(content: bytes) -> bytes:
    """Unit and PDU as characters; the LRC makes the sum of all bytes zero."""
    return b":" + (content + bytes((-sum(content) % 256,))).hex().upper().encode() + b"\r\n"


def ascii_content(characters: bytes) -> bytes:
    """Unit and PDU of a frame. Raises `ValueError` when it is none."""
    if not characters.startswith(b":") or not characters.endswith(b"\r\n"):
        raise ValueError("no frame")
    content = bytes.fromhex(characters[1:-2].decode())
    if sum(content) % 256:
        raise ValueError("wrong LRC")
    return content[:-1]


@dataclass
class AsciiUnit(FakeUnit):
    """A drive that speaks ASCII."""

    def answer(self, request: bytes) -> bytes | None:
        reply = super().answer(frame(ascii_content(request)))
        return None if reply is None else ascii_frame(reply[:-2])
