"""The container that packet analysers read: blocks of a pcapng file, written and read.

After the IETF draft "PCAP Now Generic (pcapng) Capture File Format" (draft-ietf-opsawg-pcapng): section
header 4.1, interface description 4.2, enhanced packet 4.3, options 3.5. Numbers are little-endian here; a
file in the other order, or with other blocks between ours, can be read too.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from gateway.capture.source import CaptureError

_SECTION, _INTERFACE, _PACKET = 0x0A0D0D0A, 1, 6
_MAGIC = 0x1A2B3C4D
_ORDERS = {_MAGIC.to_bytes(4, "little"): "<", _MAGIC.to_bytes(4, "big"): ">"}
MAGIC = _SECTION.to_bytes(4, "big")
"""What every such file begins with, in either order."""
_LENGTH_UNKNOWN = -1
_MICROSECONDS = 6
"""Option value: times count units of 10 to the minus 6 seconds."""

_END, _COMMENT = 0, 1
_NAME, _DESCRIPTION, _SPEED, _RESOLUTION = 2, 3, 8, 9
_APPLICATION = 4
_FLAGS = 2

Options = Iterable[tuple[int, bytes]]


@dataclass(frozen=True, slots=True)
class Interface:
    """Where packets come from. ``link`` says what they begin with; ``speed`` is in bits a second."""

    link: int
    name: str
    description: str
    speed: int | None = None


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet: the index of its interface, microseconds since 1970, its bytes, flags and comment."""

    interface: int
    time: int
    data: bytes
    flags: int
    comment: str = ""


def section(application: str) -> bytes:
    """The head of a file."""
    body = struct.pack("<IHHq", _MAGIC, 1, 0, _LENGTH_UNKNOWN)
    return _block(_SECTION, body, [(_APPLICATION, application.encode())])


def interface(described: Interface) -> bytes:
    """Stands before the first packet from there; interfaces are counted from 0."""
    options = [(_NAME, described.name.encode()), (_DESCRIPTION, described.description.encode())]
    if described.speed is not None:
        options.append((_SPEED, struct.pack("<Q", described.speed)))
    options.append((_RESOLUTION, bytes((_MICROSECONDS,))))
    return _block(_INTERFACE, struct.pack("<HHI", described.link, 0, 0), options)


def packet(told: Packet) -> bytes:
    """One packet."""
    high, low = divmod(told.time, 1 << 32)
    length = len(told.data)
    body = struct.pack("<IIIII", told.interface, high, low, length, length) + _padded(told.data)
    comment = [(_COMMENT, told.comment.encode())] if told.comment else []
    return _block(_PACKET, body, [*comment, (_FLAGS, struct.pack("<I", told.flags))])


def read(file: bytes) -> Iterator[Interface | Packet]:
    """The interfaces and packets of a file in their order; times are taken for microseconds.

    Raises:
        CaptureError: if it is no such file, or it is cut off.
    """
    order, at = "", 0
    while at < len(file):
        if file[at : at + 4] == MAGIC:
            order = _ORDERS.get(file[at + 8 : at + 12], "")
        if not order:
            raise CaptureError("this is no pcapng file")
        kind, length = _unpack(order + "II", file, at)
        if length < 12 or length % 4 or at + length > len(file):
            raise CaptureError(f"the block at byte {at} is cut off")
        body = file[at + 8 : at + length - 4]
        if kind == _INTERFACE:
            yield _interface(order, body)
        elif kind == _PACKET:
            yield _packet(order, body)
        at += length


def _block(kind: int, body: bytes, options: Options) -> bytes:
    body += b"".join(struct.pack("<HH", code, len(value)) + _padded(value) for code, value in options)
    body += struct.pack("<HH", _END, 0)
    length = len(body) + 12
    return struct.pack("<II", kind, length) + body + struct.pack("<I", length)


def _padded(value: bytes) -> bytes:
    return value + bytes(-len(value) % 4)


def _interface(order: str, body: bytes) -> Interface:
    (link,) = _unpack(order + "H", body, 0)
    found = _options(order, body[8:])
    speed = found.get(_SPEED)
    return Interface(
        link,
        found.get(_NAME, b"").decode(errors="replace"),
        found.get(_DESCRIPTION, b"").decode(errors="replace"),
        None if speed is None else _unpack(order + "Q", speed, 0)[0],
    )


def _packet(order: str, body: bytes) -> Packet:
    index, high, low, length, _ = _unpack(order + "IIIII", body, 0)
    found = _options(order, body[20 + length + -length % 4 :])
    (flags,) = _unpack(order + "I", found.get(_FLAGS, bytes(4)), 0)
    comment = found.get(_COMMENT, b"").decode(errors="replace")
    return Packet(index, high << 32 | low, body[20 : 20 + length], flags, comment)


def _options(order: str, body: bytes) -> dict[int, bytes]:
    found: dict[int, bytes] = {}
    while len(body) >= 4:
        code, length = _unpack(order + "HH", body, 0)
        if code == _END:
            break
        found.setdefault(code, body[4 : 4 + length])
        body = body[4 + length + -length % 4 :]
    return found


def _unpack(form: str, data: bytes, at: int) -> tuple[int, ...]:
    try:
        return struct.unpack_from(form, data, at)
    except struct.error as error:
        raise CaptureError("a block is shorter than it says") from error
