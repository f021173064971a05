"""ASCII: colon, hexadecimal unit, PDU and LRC, CR LF (serial line V1.02, section 2.5.2)."""

from __future__ import annotations

import binascii
from collections.abc import Iterator

from pymodbus.framer import FramerAscii

from gateway.modbus.pdu import Reply, Request, interpret, request_length

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

    def requests(self, data: bytes) -> Iterator[tuple[int, bytes, int]]:
        """Each line that is whole is looked at."""
        start = 0
        while (end := data.find(_END, start)) >= 0:
            frame = _unpacked(data[start:end])
            start = end + len(_END)
            if len(frame) > 1 and request_length(frame[1:]) == len(frame) - 1:
                yield frame[0], frame[1:], start


class AsciiSeeker:
    """Finds the reply to one request."""

    def __init__(self, sent: bytes, request: Request, echo: bool) -> None:
        self._sent = sent
        self._unit = _unpacked(sent[: -len(_END)])[:1]
        self._request = request
        self._copies = 2 if echo and request.mirrored else 1
        self._longest = len(_START) + 2 * (1 + request.reply_length + 1) + len(_END)
        self.heard = b""
        self.length = 0
        self.spoilt = False

    @property
    def echoed(self) -> bool:
        """True when what came begins with the request itself."""
        return self.heard.startswith(self._sent)

    @property
    def patience(self) -> float:
        """The standard's second while a frame of our unit is coming that can still be the reply."""
        begun = self.heard[max(0, self.heard.rfind(_START)) :]
        ours = self._sent[: len(_START) + 2]
        longest = max(len(self._sent), self._longest)
        coming = begun[: len(ours)] == ours[: len(begun)] and 0 < len(begun) < longest
        return CHARACTER_PAUSE if coming and not begun.endswith(_END) else 0.0

    def feed(self, data: bytes) -> Reply | None:
        """Take more characters; the reply that they end with, or None: one that more came after was told when
        it did, and is not told again."""
        self.heard += data
        if not self.heard.endswith(_END):
            return None
        end = len(self.heard) - len(_END)
        text = self.heard[max(0, self.heard.rfind(_START, 0, end)) : end]
        self.length = len(self.heard) - end + len(text)
        if text + _END == self._sent and self.heard.count(self._sent) < self._copies:
            return None  # our own echo
        frame = _unpacked(text)
        return interpret(self._request, frame[1:]) if frame[:1] == self._unit else None


def lrc(data: bytes) -> bytes:
    """Longitudinal redundancy check: the two's complement of the sum of all bytes."""
    return bytes((FramerAscii.compute_LRC(data),))


def _unpacked(text: bytes) -> bytes:
    """Unit and PDU of a frame without its CR LF; empty when it is damaged."""
    start = text.rfind(_START)
    try:
        frame = binascii.unhexlify(text[start + 1 :])
    except binascii.Error:
        return b""
    if start < 0 or not frame or lrc(frame[:-1]) != frame[-1:]:
        return b""
    return frame[:-1]
