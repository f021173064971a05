"""What other masters ask our units: it will be answered, and the answer may look like one to us."""

from __future__ import annotations

from collections.abc import Iterator

from gateway.modbus.framing import Framing
from gateway.modbus.pdu import Request, overheard

MANY = 128
"""So many bytes that nobody asked for are looked at even if that costs time now."""
BEGUN = 16
"""So many of them may be the beginning of a request whose end is still to come."""


class Overhearing:
    """Looks for requests in all that came in and was no reply to us."""

    def __init__(self, framing: Framing) -> None:
        self._framing = framing
        self._kept = b""
        self.waiting = False
        """True when something came in that was not looked at yet."""

    def requests(self, data: bytes = b"", least: int = 0) -> Iterator[tuple[int, Request]]:
        """Unit and request of each that stands in what was kept, and in ``data`` behind it. Fewer bytes than
        ``least`` are kept, to be looked at later."""
        if not self.waiting and not data:
            return
        heard = self._kept + data
        self.waiting = len(heard) < least
        if self.waiting:
            self._kept = heard
            return
        self._kept, used = b"", 0
        for unit, asked, used in self._framing.requests(heard):  # noqa: B007
            if (request := overheard(asked)) is not None:
                yield unit, request
        self._kept = heard[max(used, len(heard) - BEGUN) :]
