"""RTU: unit, PDU, CRC (serial line V1.02, section 2.5.1).

The length of a reply is known from its request. Whether the bytes so far end with it is looked at, whatever
stands before it: a good reply is found behind noise, our own echo or strangers' frames. What goes on behind
it belongs to it and makes it none, so that it is believed only when the silence between frames has followed.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from pymodbus.framer import FramerRTU

from gateway.modbus.pdu import EXCEPTION_LENGTH, Reply, Request, interpret, request_length

_UNIT = 1
_CRC = 2
FRAMES = 4096
"""Frames that are kept: the same reads are asked again and again."""


class RtuFraming:
    """Frames with a CRC, apart by silence."""

    numbered = False

    def encode(self, unit: int, pdu: bytes) -> bytes:
        """Unit, PDU and CRC, low byte of the CRC register first."""
        return _frame(bytes((unit,)) + pdu)

    def seeker(self, sent: bytes, request: Request, echo: bool = False) -> RtuSeeker:
        """Seek the reply of the unit that ``sent`` went to."""
        return RtuSeeker(sent, request, echo)

    def size(self, length: int) -> int:
        """A character a byte, and three more."""
        return _UNIT + length + _CRC

    def intact(self, data: bytes) -> bool:
        """The CRC is right; the shortest frame has a unit, a function and the CRC."""
        return len(data) > _UNIT + _CRC and crc(data[:-_CRC]) == data[-_CRC:]

    def requests(self, data: bytes) -> Iterator[tuple[int, bytes, int]]:
        """Every place is tried, since silences are not known here."""
        for start in range(len(data) - _UNIT - _CRC):
            length = request_length(data[start + _UNIT :])
            end = start + _UNIT + length + _CRC
            if length and end <= len(data) and crc(data[start : end - _CRC]) == data[end - _CRC : end]:
                yield data[start], data[start + _UNIT : end - _CRC], end


class RtuSeeker:
    """Finds the reply to one request."""

    patience = 0.0

    def __init__(self, sent: bytes, request: Request, echo: bool) -> None:
        self._sent = sent
        self._request = request
        self._copies = 2 if echo and request.mirrored else 1
        self.heard = b""
        self.length = 0
        unit = sent[:_UNIT]
        self._forms = (
            (unit + request.head, _UNIT + request.reply_length + _CRC),
            *((unit + bytes((byte,)), _UNIT + EXCEPTION_LENGTH + _CRC) for byte in request.exceptions),
        )

    @property
    def echoed(self) -> bool:
        """True when what came begins with the request itself."""
        return self.heard.startswith(self._sent)

    @property
    def spoilt(self) -> bool:
        """True when what came is the reply, but for a few bits. With one byte more it could be somebody's
        request, which has 8 of them; a reply has an odd number."""
        head, length = self._forms[0]
        own = len(self._sent) if self.echoed else 0
        return self.heard.startswith(head[:1], own) and len(self.heard) == own + length

    def feed(self, data: bytes) -> Reply | None:
        """Take more bytes; the reply that all of them end with, or None."""
        self.heard += data
        for head, length in self._forms:
            if (reply := self._ending(head, length)) is not None:
                self.length = length
                return reply
        return None

    def _ending(self, head: bytes, length: int) -> Reply | None:
        start = len(self.heard) - length
        if start < 0 or not self.heard.startswith(head, start):
            return None
        frame = self.heard[start:]
        if crc(frame[:-_CRC]) != frame[-_CRC:]:
            return None
        if frame == self._sent and self.heard.count(self._sent) < self._copies:
            return None  # our own echo
        return interpret(self._request, frame[_UNIT:-_CRC])


@lru_cache(FRAMES)
def _frame(body: bytes) -> bytes:
    return body + crc(body)


def crc(data: bytes) -> bytes:
    """CRC-16 of ``data`` in the order of the wire."""
    return FramerRTU.compute_CRC(data).to_bytes(_CRC, "big")
