"""ASCII: colon, hexadecimal unit, PDU and LRC, CR LF (serial line V1.02, section 2.5.2)."""

from __future__ import annotations

import binascii

from pymodbus.framer import FramerAscii

from gateway.modbus.pdu import Reply, Request, interpret

_START = b":"
_END = b"\r\n"
CHARACTER_PAUSE = 1.0
"""Seconds that may pass between two characters of a frame (serial line V1.02, section 2.5.2.1)."""


class AsciiFraming:
    """Frames between a colon and CR LF."""

    numbered = False

    def encode(self, unit: int, pdu: bytes) -> bytes:
        """The frame in capital hexadecimal digits."""
        frame = bytes((unit,)) + pdu
        return _START + binascii.hexlify(frame + lrc(frame)).upper() + _END

    def seeker(self, sent: bytes, request: Request, echo: bool = False) -> AsciiSeeker:
        """Seek the reply of the unit that ``sent`` went to."""
        return AsciiSeeker(sent, request, echo)

    def size(self, length: int) -> int:
        """Two characters for each of unit, PDU and LRC; colon, CR and LF."""
        return len(_START) + 2 * (1 + length + 1) + len(_END)

    def intact(self, data: bytes) -> bool:
        """Colon, CR LF and a right LRC."""
        return data.endswith(_END) and len(_unpacked(data[: -len(_END)])) > 1


class AsciiSeeker:
    """Finds the reply to one request."""

    def __init__(self, sent: bytes, request: Request, echo: bool) -> None:
        self._sent = sent
        self._request = request
        self._skip_own = echo
        self._longest = len(_START) + 2 * (1 + request.reply_length + 1) + len(_END)
        self._rest = b""
        self.echoed = False

    @property
    def patience(self) -> float:
        """The standard's second while a frame of our unit is coming that can still be the reply."""
        begun = self._rest[self._rest.rfind(_START) :] if _START in self._rest else b""
        ours = self._sent[: len(_START) + 2]
        longest = max(len(self._sent), self._longest)
        coming = bool(begun) and begun[: len(ours)] == ours[: len(begun)] and len(begun) < longest
        return CHARACTER_PAUSE if coming else 0.0

    @property
    def behind(self) -> int:
        """Characters behind the last CR LF that was looked at."""
        return len(self._rest)

    def feed(self, data: bytes) -> Reply | None:
        """Take more characters; the next reply whose LRC is right, or None."""
        self._rest += data
        while _END in self._rest:
            line, self._rest = self._rest.split(_END, 1)
            if (reply := self._reply(line[line.rfind(_START) :])) is not None:
                return reply
        return None

    def _reply(self, text: bytes) -> Reply | None:
        own = text + _END == self._sent
        self.echoed |= own and (self._skip_own or self._request.head != self._request.pdu)
        if own and self._skip_own:
            self._skip_own = False
            return None
        frame = _unpacked(text)
        if self._skip_own or frame[:1] != _unpacked(self._sent[: -len(_END)])[:1]:
            return None
        return interpret(self._request, frame[1:])


def lrc(data: bytes) -> bytes:
    """Longitudinal redundancy check: the two's complement of the sum of all bytes."""
    return bytes((FramerAscii.compute_LRC(data),))


def _unpacked(text: bytes) -> bytes:
    """Unit and PDU of a frame without its CR LF; empty when it is damaged."""
    try:
        frame = binascii.unhexlify(text[1:])
    except binascii.Error:
        return b""
    if not text.startswith(_START) or not frame or lrc(frame[:-1]) != frame[-1:]:
        return b""
    return frame[:-1]
