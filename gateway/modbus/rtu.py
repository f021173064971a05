"""RTU: unit, PDU, CRC (serial line V1.02, section 2.5.1).

The end of a reply is known from its request, so no silence has to be measured. Every byte is tried as the
last of a reply: a good one is found behind noise, our own echo or strangers' frames, and a damaged one
hides nothing behind it.
"""

from __future__ import annotations

from functools import lru_cache

from pymodbus.framer import FramerRTU

from gateway.modbus.pdu import EXCEPTION_LENGTH, Reply, Request, interpret

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


class RtuSeeker:
    """Finds the reply to one request."""

    patience = 0.0

    def __init__(self, sent: bytes, request: Request, echo: bool) -> None:
        self._sent = sent
        self._request = request
        self._echo = echo
        self._passed_echo = False
        self._buffer = b""
        self._tried = 0
        unit = sent[:_UNIT]
        self._forms = (
            (unit + request.head, _UNIT + request.reply_length + _CRC),
            *((unit + bytes((byte,)), _UNIT + EXCEPTION_LENGTH + _CRC) for byte in request.exceptions),
        )

    @property
    def echoed(self) -> bool:
        """True when the request itself came back; where it looks like its own reply (06H, 08H), that is
        known only of an echo that was expected."""
        unlike = self._request.head != self._request.pdu
        return self._passed_echo or (unlike and self._sent in self._buffer)

    @property
    def behind(self) -> int:
        """Bytes that were not tried yet."""
        return len(self._buffer) - self._tried

    def feed(self, data: bytes) -> Reply | None:
        """Take more bytes; the next reply whose CRC is right, or None."""
        self._buffer += data
        if self._echo and not self._behind_echo():
            return None
        while (end := self._next_end()) is not None:
            self._tried = end
            for head, length in self._forms:
                if (reply := self._ending_here(head, length)) is not None:
                    return reply
        self._tried = len(self._buffer)
        return None

    def _next_end(self) -> int | None:
        """The first byte not tried yet that could be the last of a reply, by what the reply begins with; the
        end of it."""
        ends = [
            start + length
            for head, length in self._forms
            if (start := self._buffer.find(head, max(0, self._tried - length + 1))) >= 0
        ]
        end = min(ends, default=None)
        return None if end is None or end > len(self._buffer) else end

    def _behind_echo(self) -> bool:
        """Skip our own request, once; False while it has not come back whole."""
        at = self._buffer.find(self._sent)
        if at >= 0:
            self._buffer = self._buffer[at + len(self._sent) :]
            self._echo, self._passed_echo = False, True
        return at >= 0

    def _ending_here(self, head: bytes, length: int) -> Reply | None:
        start = self._tried - length
        if start < 0 or not self._buffer.startswith(head, start):
            return None
        frame = self._buffer[start : self._tried]
        if crc(frame[:-_CRC]) != frame[-_CRC:]:
            return None
        return interpret(self._request, frame[_UNIT:-_CRC])


@lru_cache(FRAMES)
def _frame(body: bytes) -> bytes:
    return body + crc(body)


def crc(data: bytes) -> bytes:
    """CRC-16 of ``data`` in the order of the wire."""
    return FramerRTU.compute_CRC(data).to_bytes(_CRC, "big")
