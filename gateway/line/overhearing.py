"""What others have to do with our units: what a master asks one of them will be answered, and that may look
like an answer to us; and an answer that nobody asked for shows that more may come.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from gateway.modbus import pdu
from gateway.modbus.framing import FramingName, framing_of
from gateway.modbus.overheard import Overheard, Sort, overheard

MANY = 128
"""So many bytes that nobody asked for are looked at even if that costs time now."""
BEGUN = 16
"""So many of them may be the beginning of a request whose end is still to come."""
MOST = 126
"""One more than the registers of the longest read."""
READS = (pdu.READ_HOLDING, pdu.READ_INPUT)


class News(NamedTuple):
    """What another master ``asked`` a unit; or what somebody must have asked it, because it gave an answer
    that nobody waits for. The last of it was heard ``at`` this instant."""

    unit: int
    request: pdu.Request
    asked: bool
    at: float


class Overhearing:
    """Looks for requests and for answers in all that came in and was no reply to us."""

    def __init__(self, framing: FramingName) -> None:
        self._name = framing
        self._framing = framing_of(framing)
        self._kept = b""
        self.waiting = False
        """True when something came in that was not looked at yet."""
        self._heard_at = -math.inf

    def news(self, data: bytes, now: float, least: int = 0) -> Iterator[News]:
        """All that stands in what was kept, and in ``data`` behind it. Fewer bytes than ``least`` are kept,
        and looked at later."""
        if not self.waiting and not data:
            return
        if data:
            self._heard_at = now
        heard = self._kept + data
        self.waiting = len(heard) < least
        if self.waiting:
            self._kept = heard
            return
        self._kept, used = b"", 0
        for unit, asked, used in self._framing.requests(heard):  # noqa: B007
            if (request := pdu.overheard(asked)) is not None:
                yield News(unit, request, True, self._heard_at)
        for frame in overheard(self._name, heard).frames:
            if frame.sort is Sort.REPLY and frame.function in READS:
                used = max(used, heard.rfind(frame.frame) + len(frame.frame))
                yield News(frame.unit, self._asking(frame), False, self._heard_at)
        self._kept = heard[max(used, len(heard) - BEGUN) :]

    def _asking(self, reply: Overheard) -> pdu.Request:
        """A read that has an answer of this length; which registers it was is not known."""
        counts = (n for n in range(1, MOST) if self._framing.size(2 + 2 * n) == len(reply.frame))
        return pdu.read_registers(0, next(counts, 1), reply.function)
