"""Whole frames in bytes that were no reply to us: from other masters, from drives that they ask, from two
drives with one address.

Their lengths are known from their first bytes (application protocol V1.1b3, section 6); what a check value
confirms is a frame. A frame of a few functions may be a request or the reply to it: they look alike.
"""

from __future__ import annotations

import binascii
from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from typing import NamedTuple

from gateway.modbus import pdu
from gateway.modbus.ascii import lrc
from gateway.modbus.framing import FramingName
from gateway.modbus.rtu import crc

_BIT_READS = (0x01, 0x02)
_WRITE_BIT, _WRITE_BITS = 0x05, 0x0F
_HEAD = 2
"""Bytes before the data: unit and function."""
_CRC = 2


class Sort(Enum):
    """What a frame is by its shape."""

    REQUEST = "request"
    REPLY = "reply"
    EITHER = "either"
    """A write and its echo look alike."""


class Overheard(NamedTuple):
    """A frame: who it is to or from, its function, what it is, and all its bytes."""

    unit: int
    function: int
    sort: Sort
    frame: bytes


class Heard(NamedTuple):
    """All frames in some bytes, in order, and how many bytes belong to none."""

    frames: list[Overheard]
    rest: int


def overheard(framing: FramingName, data: bytes) -> Heard:
    """The frames in ``data``. A network connection has no strangers: nothing is looked for there."""
    return _SEARCHES[framing](data)


def _rtu(data: bytes) -> Heard:
    frames: list[Overheard] = []
    start = rest = 0
    while start < len(data):
        found = next(_beginning(data, start), None)
        if found is None:
            start, rest = start + 1, rest + 1
        else:
            frames.append(found)
            start += len(found.frame)
    return Heard(frames, rest)


def _beginning(data: bytes, start: int) -> Iterator[Overheard]:
    """The frame that begins at a place, if one does."""
    for length, sort in _forms(data[start + 1 : start + 7]):
        end = start + length + 1 + _CRC
        frame = data[start:end]
        if end <= len(data) and crc(frame[:-_CRC]) == frame[-_CRC:]:
            yield Overheard(frame[0], frame[1], sort, frame)


def _forms(head: bytes) -> Iterator[tuple[int, Sort]]:
    """The lengths that a PDU with these first bytes may have, and what it is then."""
    if not head:
        return
    function = head[0]
    if function in (pdu.READ_HOLDING, pdu.READ_INPUT, *_BIT_READS):
        yield 5, Sort.REQUEST
        if len(head) > 1:
            yield 2 + head[1], Sort.REPLY
    elif function in (pdu.WRITE_ONE, pdu.DIAGNOSTICS, _WRITE_BIT):
        yield 5, Sort.EITHER
    elif function in (pdu.WRITE_MANY, _WRITE_BITS):
        yield 5, Sort.REPLY
        if len(head) > 5:
            yield 6 + head[5], Sort.REQUEST
    elif function & pdu.EXCEPTION:
        yield pdu.EXCEPTION_LENGTH, Sort.REPLY


def _ascii(data: bytes) -> Heard:
    frames: list[Overheard] = []
    used = 0
    for line in data.split(b"\r\n")[:-1]:
        text = line[line.rfind(b":") :]
        frame = _unpacked(text)
        for length, sort in _forms(frame[1:7]):
            if length + 1 == len(frame):
                frames.append(Overheard(frame[0], frame[1], sort, text + b"\r\n"))
                used += len(text) + 2
                break
    return Heard(frames, len(data) - used)


def _unpacked(text: bytes) -> bytes:
    """Unit and PDU of a frame; empty when it is damaged."""
    try:
        frame = binascii.unhexlify(text[1:])
    except binascii.Error:
        return b""
    whole = text.startswith(b":") and len(frame) > _HEAD and lrc(frame[:-1]) == frame[-1:]
    return frame[:-1] if whole else b""


def _tcp(data: bytes) -> Heard:
    return Heard([], 0)


_SEARCHES: Mapping[FramingName, Callable[[bytes], Heard]] = {"rtu": _rtu, "ascii": _ascii, "tcp": _tcp}
