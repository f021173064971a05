"""Frames as packets that Wireshark and tshark dissect as Modbus without any setting.

Each packet is of link type "Wireshark upper PDU" (252): tags that name the dissector, the two ends and the
direction, then the frame as it was on the wire. The tags are those of Wireshark's exported_pdu_tlvs.h.
Requests go from 127.0.0.1 to 0.0.<line>.<unit> and replies come back, so that Wireshark pairs them; lines
are counted from 0. A frame that is damaged, or in ASCII, which Wireshark does not dissect, is shown as data.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator

from gateway.bridge.api import Frame
from gateway.capture import pcapng
from gateway.capture.source import Captured, CaptureError, Source, described
from gateway.modbus.framing import FramingName, framing_of

UPPER_PDU = 252
RTU_PORT = 5020
"""The device's end in RTU. Wireshark has to be told (``-o mbrtu.tcp.port:5020``), but only for requests that
look like their replies (06H, 08H); all others it tells apart by itself. In Modbus TCP it knows 502."""
_TCP_PORT = 502
_OUR_PORT = 1

_END, _DISSECTOR = 0, 12
_FROM, _TO, _PORT_KIND, _FROM_PORT, _TO_PORT = 20, 21, 24, 25, 26
_PROTOCOL, _DIRECTION, _INFO = 33, 35, 36
_KIND_TCP = 2
_SENT, _RECEIVED = 0, 1

_INBOUND, _OUTBOUND = 1, 2
_CRC_ERROR = 1 << 24
"""Bits of a packet's flags (pcapng draft, 4.3.1)."""

_DISSECTORS: dict[FramingName, str] = {"rtu": "mbrtu", "tcp": "mbtcp"}
_NAMES: dict[FramingName, str] = {"rtu": "Modbus RTU", "ascii": "Modbus ASCII", "tcp": "Modbus/TCP"}


class Writer:
    """Makes a capture of some lines, piece by piece."""

    def __init__(self, application: str, sources: Iterable[Source]) -> None:
        self._numbers = {source.name: number for number, source in enumerate(sources)}
        self.head = pcapng.section(application) + b"".join(
            pcapng.interface(pcapng.Interface(UPPER_PDU, source.name, source.description, source.baud))
            for source in sources
        )
        """Comes before all frames."""

    def frame(self, captured: Captured) -> bytes:
        """One frame."""
        source, frame = captured
        number = self._numbers[source.name]
        intact = framing_of(source.framing).intact(frame.data)
        flags = (_OUTBOUND if frame.sent else _INBOUND) | (0 if intact else _CRC_ERROR)
        data = _tags(source, number, frame, intact) + frame.data
        return pcapng.packet(pcapng.Packet(number, frame.time // 1000, data, flags, frame.note))


def read_capture(file: bytes) -> Iterator[Captured]:
    """The frames of a capture that a `Writer` made.

    Raises:
        CaptureError: if it is none.
    """
    sources: list[Source] = []
    for block in pcapng.read(file):
        if isinstance(block, pcapng.Interface):
            sources.append(described(block.name, block.description))
        elif block.interface >= len(sources):
            raise CaptureError("a packet names an interface that is not described")
        else:
            sent = bool(block.flags & _OUTBOUND)
            frame = Frame(block.time * 1000, sent, _behind_tags(block.data), block.comment)
            yield Captured(sources[block.interface], frame)


def _tags(source: Source, number: int, frame: Frame, intact: bool) -> bytes:
    dissector = _DISSECTORS.get(source.framing) if intact else None
    unit = _unit(source.framing, frame.data) if intact else 0
    ends = [(bytes((127, 0, 0, 1)), _OUR_PORT), (bytes((0, 0, number % 256, unit)), _port(source.framing))]
    (here, here_port), (there, there_port) = ends if frame.sent else reversed(ends)
    told = b"" if dissector else _tag(_PROTOCOL, _NAMES[source.framing]) + _tag(_INFO, _info(source, frame))
    return b"".join(
        (
            _tag(_DISSECTOR, dissector or "data"),
            _tag(_FROM, here),
            _tag(_TO, there),
            _tag(_PORT_KIND, _KIND_TCP),
            _tag(_FROM_PORT, here_port),
            _tag(_TO_PORT, there_port),
            _tag(_DIRECTION, _SENT if frame.sent else _RECEIVED),
            told,
            struct.pack(">HH", _END, 0),
        )
    )


def _tag(code: int, value: str | bytes | int) -> bytes:
    if isinstance(value, int):
        value = struct.pack(">I", value)
    elif isinstance(value, str):
        value = value.encode()
    value += bytes(-len(value) % 4)
    return struct.pack(">HH", code, len(value)) + value


def _behind_tags(data: bytes) -> bytes:
    while len(data) >= 4:
        code, length = struct.unpack_from(">HH", data)
        data = data[4 + length :]
        if code == _END:
            return data
    raise CaptureError("a packet has no end of its tags")


def _info(source: Source, frame: Frame) -> str:
    """What the list of packets shows of a frame that is not dissected."""
    text = frame.data.decode("ascii", "replace").strip() if source.framing == "ascii" else ""
    return f"{text or frame.data.hex(' ').upper()} ({frame.note})"


def _unit(framing: FramingName, data: bytes) -> int:
    """The unit address of an intact frame."""
    if framing == "ascii":
        return int(data[1:3], 16)
    return data[6] if framing == "tcp" else data[0]


def _port(framing: FramingName) -> int:
    return _TCP_PORT if framing == "tcp" else RTU_PORT
