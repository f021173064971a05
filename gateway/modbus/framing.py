"""How a PDU travels: what every framing can do, and the table of framings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, Protocol

from gateway.modbus.ascii import AsciiFraming
from gateway.modbus.pdu import Reply, Request
from gateway.modbus.rtu import RtuFraming
from gateway.modbus.tcp import TcpFraming

FramingName = Literal["rtu", "ascii", "tcp"]


class Seeker(Protocol):
    """Looks for the reply to one request behind noise, echo and strangers' frames.

    Whether a reply is there once all has come does not depend on the pieces in which it came.
    """

    heard: bytes
    """All that came so far."""
    length: int
    """How many bytes of it, the last ones, are the reply that was found."""

    @property
    def echoed(self) -> bool:
        """True when what came begins with our own request."""
        ...

    @property
    def patience(self) -> float:
        """Seconds that the next byte of a frame that has begun may take; 0 where that is not known."""
        ...

    @property
    def spoilt(self) -> bool:
        """True when what came can only be the reply, but is damaged."""
        ...

    def feed(self, data: bytes) -> Reply | None:
        """Take more bytes; the reply that stands at the end of all that came, or None."""
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
        """Seek the reply to ``request``, which was sent as ``sent``; ``echo``: our own request may come back,
        and is not to be taken for a reply."""
        ...

    def size(self, length: int) -> int:
        """Characters on the wire for a PDU of ``length`` bytes."""
        ...

    def intact(self, data: bytes) -> bool:
        """True when ``data`` is one whole frame, with the right check value where there is one."""
        ...

    def requests(self, data: bytes) -> Iterator[tuple[int, bytes, int]]:
        """The requests of other masters that stand in ``data``: unit, PDU, and where the frame ends."""
        ...


def framing_of(name: FramingName) -> Framing:
    """A fresh framing for one line."""
    kinds: dict[FramingName, type[Framing]] = {
        "rtu": RtuFraming,
        "ascii": AsciiFraming,
        "tcp": TcpFraming,
    }
    return kinds[name]()
