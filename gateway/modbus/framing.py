"""How a PDU travels: what every framing can do, and the table of framings."""

from __future__ import annotations

from typing import Literal, Protocol

from gateway.modbus.ascii import AsciiFraming
from gateway.modbus.pdu import Reply, Request
from gateway.modbus.rtu import RtuFraming
from gateway.modbus.tcp import TcpFraming

FramingName = Literal["rtu", "ascii", "tcp"]


class Seeker(Protocol):
    """Looks for the reply to one request in a stream that may hold noise, echo and strangers' frames.

    What is found does not depend on how the stream is cut into pieces.
    """

    @property
    def echoed(self) -> bool:
        """True when our own request came back, which no unit would send."""
        ...

    @property
    def patience(self) -> float:
        """Seconds that the next byte of a frame that has begun may take; 0 where that is not known."""
        ...

    @property
    def behind(self) -> int:
        """Bytes that came in behind the reply that was found last."""
        ...

    def feed(self, data: bytes) -> Reply | None:
        """Take more bytes; the next reply, or None. Call again with ``b""`` to look behind a reply."""
        ...


class Framing(Protocol):
    """One way to put PDUs on a wire."""

    @property
    def numbered(self) -> bool:
        """True when frames carry a transaction number, so that a late reply is known as such."""
        ...

    def encode(self, unit: int, pdu: bytes) -> bytes:
        """The frame that carries ``pdu`` to ``unit``."""
        ...

    def seeker(self, sent: bytes, request: Request, echo: bool = False) -> Seeker:
        """Seek the reply to ``request``, which was sent as ``sent``; ``echo``: behind our own echo."""
        ...

    def size(self, length: int) -> int:
        """Characters on the wire for a PDU of ``length`` bytes."""
        ...

    def intact(self, data: bytes) -> bool:
        """True when ``data`` is one whole frame, with the right check value where there is one."""
        ...


def framing_of(name: FramingName) -> Framing:
    """A fresh framing for one line."""
    kinds: dict[FramingName, type[Framing]] = {
        "rtu": RtuFraming,
        "ascii": AsciiFraming,
        "tcp": TcpFraming,
    }
    return kinds[name]()
