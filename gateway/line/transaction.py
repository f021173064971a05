"""One exchange: the request on the wire, what its reply must be, and until when it is waited for."""

from __future__ import annotations

from dataclasses import dataclass

from gateway.line.schedule import Choice
from gateway.modbus.framing import Framing, Seeker
from gateway.modbus.pdu import EXCEPTION_LENGTH, Reply, Request
from gateway.modbus.timing import Timing


@dataclass(frozen=True, slots=True)
class Question:
    """A request to a unit, and why it is asked.

    ``choice`` is the decision behind it. ``aside``: the request only puts the unit in step before what was
    chosen. ``doubtful``: a late reply could be taken for this one's, so that a reply proves nothing.
    ``late`` are the functions whose exception replies may be late ones.
    """

    unit: int
    request: Request
    choice: Choice
    aside: bool = False
    doubtful: bool = False
    late: frozenset[int] = frozenset()


@dataclass(slots=True)
class Transaction:
    """A question on the wire. Its last bit leaves at ``ends``; no reply is believed after ``deadline``."""

    question: Question
    data: bytes
    seeker: Seeker
    began: float
    ends: float
    deadline: float
    heard: bool = False

    def feed(self, data: bytes) -> Reply | None:
        """Take what was received; the reply when it is complete and may be believed."""
        self.heard |= bool(data)
        while (reply := self.seeker.feed(data)) is not None:
            if not self._may_be_late(reply):
                return reply
            data = b""
        return None

    def _may_be_late(self, reply: Reply) -> bool:
        return reply.exception is not None and self.question.request.function in self.question.late


class Wire:
    """Framing and timing of a line together: makes transactions and knows what they cost."""

    def __init__(self, framing: Framing, timing: Timing, echo: bool) -> None:
        self.framing = framing
        self.timing = timing
        self.echo = echo

    def begin(self, question: Question, patience: float, now: float) -> Transaction:
        """The transaction that starts now; the unit has ``patience`` seconds until its reply begins."""
        request = question.request
        data = self.framing.encode(question.unit, request.pdu)
        ends = now + self.timing.duration(len(data))
        reply = self.timing.duration(self.framing.size(request.reply_length))
        echo = self.echo and not self.framing.numbered
        seeker = self.framing.seeker(data, request, echo)
        return Transaction(question, data, seeker, now, ends, ends + patience + reply)

    def turnaround(self, transaction: Transaction, reply: Reply, now: float) -> float:
        """Seconds that the unit took until it began a reply that was complete at ``now``."""
        normal = transaction.question.request.reply_length
        length = normal if reply.exception is None else EXCEPTION_LENGTH
        return max(0.0, now - transaction.ends - self.timing.duration(self.framing.size(length)))

    def read_cost(self, count: int, turnaround: float) -> float:
        """Seconds of line that reading ``count`` registers takes."""
        request, reply = self.framing.size(5), self.framing.size(2 + 2 * count)
        return self.timing.transaction(request, reply, turnaround)
