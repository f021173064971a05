"""Modbus TCP: a header with transaction number and length before the PDU (messaging guide V1.0b, 3.1.3)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from itertools import count

from gateway.modbus.pdu import Reply, Request, interpret

_HEADER = struct.Struct(">HHHB")
_NUMBERS = 0x10000
_LONGEST = 254
"""Unit and PDU together never take more bytes."""


class TcpFraming:
    """Frames on a stream that loses nothing; each request has a number of its own."""

    numbered = True

    def __init__(self) -> None:
        self._numbers = count(1)

    def encode(self, unit: int, pdu: bytes) -> bytes:
        """Header and PDU, with the next transaction number."""
        return _HEADER.pack(next(self._numbers) % _NUMBERS, 0, 1 + len(pdu), unit) + pdu

    def seeker(self, sent: bytes, request: Request, echo: bool = False) -> TcpSeeker:
        """Seek the reply with the number of ``sent``. A network connection has no echo."""
        return TcpSeeker(sent, request)

    def size(self, length: int) -> int:
        """Seven bytes of header before the PDU."""
        return _HEADER.size + length

    def intact(self, data: bytes) -> bool:
        """The header announces what is there; the network sees to the rest."""
        if len(data) <= _HEADER.size:
            return False
        _, protocol, length, _ = _HEADER.unpack_from(data)
        return (protocol, length) == (0, len(data) - _HEADER.size + 1)

    def requests(self, data: bytes) -> Iterator[tuple[int, bytes, int]]:
        """Nobody else speaks on a connection."""
        return iter(())


class TcpSeeker:
    """Finds the reply to one request."""

    echoed = False
    patience = 0.0

    def __init__(self, sent: bytes, request: Request) -> None:
        self._number, _, _, self._unit = _HEADER.unpack_from(sent)
        self._request = request
        self._buffer = b""
        self.heard = b""
        self.length = 0
        self.spoilt = False

    def feed(self, data: bytes) -> Reply | None:
        """Take more bytes; the reply, or None. A stream out of step is dropped to its end."""
        self.heard += data
        self._buffer += data
        while len(self._buffer) >= _HEADER.size:
            number, protocol, length, unit = _HEADER.unpack_from(self._buffer)
            if protocol or not 2 <= length <= _LONGEST:
                self._buffer = b""
                return None
            if len(self._buffer) < _HEADER.size - 1 + length:
                return None
            pdu = self._take(length)
            if (number, unit) == (self._number, self._unit) and (reply := interpret(self._request, pdu)):
                self.length = len(self.heard)
                return reply
        return None

    def _take(self, length: int) -> bytes:
        end = _HEADER.size - 1 + length
        pdu, self._buffer = self._buffer[_HEADER.size : end], self._buffer[end:]
        return pdu
