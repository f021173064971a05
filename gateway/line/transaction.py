"""One exchange: the request on the wire, what its reply must be, and until when it is waited for."""

from __future__ import annotations

from dataclasses import dataclass

from gateway.line.interface import Write
from gateway.line.requests import BROADCAST
from gateway.line.schedule import Choice, Waiting
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

    @property
    def write(self) -> Write | None:
        """The write that it carries out, None when it reads."""
        if self.aside or not isinstance(self.choice, Waiting):
            return None
        asked = self.choice.job.request
        return asked if isinstance(asked, Write) else None

    @property
    def answered(self) -> bool:
        """True when a reply is to be awaited."""
        return self.unit != BROADCAST and not (self.write and self.write.silent)


@dataclass(slots=True)
class Transaction:
    """A question on the wire. Its last bit leaves at ``ends``; no reply is believed after ``deadline``."""

    question: Question
    data: bytes
    seeker: Seeker
    began: float
    ends: float
    deadline: float
    echo: bool = False
    received: int = 0

    @property
    def heard(self) -> bool:
        """True when more came back than our own echo."""
        own = len(self.data) if self.echo or self.seeker.echoed else 0
        return self.received > own

    def feed(self, data: bytes, now: float) -> Reply | None:
        """Take what was received; the reply when it is complete and may be believed. A frame that has begun
        is waited for as long as its framing lets it take."""
        self.received += len(data)
        while (reply := self.seeker.feed(data)) is not None:
            if not self._may_be_late(reply):
                return reply
            data = b""
        if self.seeker.patience:
            self.deadline = max(self.deadline, now + self.seeker.patience)
        return None

    def _may_be_late(self, reply: Reply) -> bool:
        late, request = self.question.late, self.question.request
        shared = bool(late) and bool(request.error_functions)  # such a byte names no function
        return reply.exception is not None and (shared or request.function in late)


class Wire:
    """Framing and timing of a line together: makes transactions and knows what they cost.

    An echo that the settings do not name is noticed: otherwise a request that looks like its own reply
    would seem to be answered by a unit that is not there.
    """

    def __init__(self, framing: Framing, timing: Timing, echo: bool) -> None:
        self.framing = framing
        self.timing = timing
        self._declared = echo
        self._echo = echo

    def begin(self, question: Question, patience: float, now: float) -> Transaction:
        """The transaction that starts now; the unit has ``patience`` seconds until its reply begins."""
        request = question.request
        data = self.framing.encode(question.unit, request.pdu)
        ends = now + self.timing.duration(len(data))
        reply = self.timing.duration(self.framing.size(request.reply_length))
        seeker = self.framing.seeker(data, request, self._echo)
        return Transaction(question, data, seeker, now, ends, ends + patience + reply, self._echo)

    def learn(self, done: Transaction) -> None:
        """Notice from a finished transaction whether there is an echo."""
        if done.received:
            self._echo = self._declared or done.seeker.echoed or (self._echo and not done.heard)

    def length(self, transaction: Transaction, reply: Reply) -> int:
        """Characters of the frame that carried a reply."""
        normal = transaction.question.request.reply_length
        return self.framing.size(normal if reply.exception is None else EXCEPTION_LENGTH)

    def turnaround(self, transaction: Transaction, reply: Reply, now: float) -> float:
        """Seconds that the unit took until it began a reply that was complete at ``now``."""
        duration = self.timing.duration(self.length(transaction, reply))
        return max(0.0, now - transaction.ends - duration)

    def read_cost(self, count: int, turnaround: float, pause: float = 0.0) -> float:
        """Seconds of line that reading ``count`` registers takes, with the silence after it."""
        request, reply = self.framing.size(5), self.framing.size(2 + 2 * count)
        return self.timing.transaction(request, reply, turnaround, pause)
