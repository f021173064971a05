"""What other masters ask our units: it will be answered, and the answer may look like one to us."""

from __future__ import annotations

from collections.abc import Iterator

from gateway.modbus.framing import Framing
from gateway.modbus.pdu import Request, overheard

KEPT = 256
"""So many of the bytes that nobody asked for are kept until they are looked at."""
BEGUN = 16
"""So many of them may be the beginning of a request whose end is still to come."""


class Overhearing:
    """Looks for requests in all that came in and was no reply to us."""

    def __init__(self, framing: Framing) -> None:
        self._framing = framing
        self._kept = b""
        self.waiting = False
        """True when something came in that was not looked at yet."""

    def keep(self, data: bytes) -> None:
        """Bytes that nobody asked for, to be looked at later."""
        self._kept, self.waiting = (self._kept + data)[-KEPT:], True

    def requests(self, data: bytes = b"") -> Iterator[tuple[int, Request]]:
        """Unit and request of each that stands in what was kept, and in ``data`` behind it."""
        if not self.waiting and not data:
            return
        heard, self._kept, self.waiting = self._kept + data, b"", False
        used = 0
        for unit, asked, used in self._framing.requests(heard):  # noqa: B007
            if (request := overheard(asked)) is not None:
                yield unit, request
        self._kept = heard[max(used, len(heard) - BEGUN) :]
