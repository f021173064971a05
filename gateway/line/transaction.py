"""One exchange: the request on the wire, what its reply must be, and until when it is waited for."""

from __future__ import annotations

from dataclasses import dataclass

from gateway.line.interface import Write
from gateway.line.requests import BROADCAST
from gateway.line.schedule import Choice, Waiting
from gateway.modbus.framing import Framing, Seeker
from gateway.modbus.pdu import Reply, Request
from gateway.modbus.timing import Timing

TOLERANCE = 0.03
"""Two clocks of serial ports differ by less than this."""


@dataclass(frozen=True, slots=True)
class Question:
    """A request to a unit, and why it is asked.

    ``choice`` is the decision behind it. ``aside``: the request only puts the unit in step before what was
    chosen. ``part`` are the registers that are wanted of a read, address and count; ``skip`` others come
    before them in its reply.
    """

    unit: int
    request: Request
    choice: Choice
    aside: bool = False
    part: tuple[int, int] = (0, 0)
    skip: int = 0

    @property
    def write(self) -> Write | None:
        """The write that it carries out, None when it reads."""
        if self.aside or not isinstance(self.choice, Waiting):
            return None
        asked = self.choice.job.request
        return asked if isinstance(asked, Write) else None

    @property
    def whole(self) -> bool:
        """True when nothing else is read than what is wanted."""
        return not self.skip and self.request.reply_length == 2 + 2 * self.part[1]

    @property
    def answered(self) -> bool:
        """True when a reply is to be awaited."""
        return self.unit != BROADCAST and not (self.write and self.write.silent)


@dataclass(slots=True)
class Transaction:
    """A question on the wire. Its last bit leaves at ``ends``, and its reply is there at ``deadline`` or
    not at all. ``silence`` behind it is what makes it whole. ``echo``: what begins with our own request
    may be its echo. ``heard_at`` is when the last byte came in, ``reply`` what the bytes so far end with."""

    question: Question
    data: bytes
    seeker: Seeker
    began: float
    ends: float
    deadline: float
    silence: float
    echo: bool
    heard_at: float = 0.0
    reply: Reply | None = None
    numbered: bool = False
    """Its reply carries its number: none that comes late is taken for another."""
    doubted: bool = False
    """A reply came that was not believed, a refusal if it has an exception ``code``."""
    code: int | None = None

    @property
    def until(self) -> float:
        """When it is over, if nothing more comes: a reply is one when silence follows."""
        return self.deadline if self.reply is None else self.heard_at + self.silence

    @property
    def surplus(self) -> bytes:
        """What came in beside the reply and our own echo."""
        heard = self.seeker.heard
        first = len(self.data) if self.echo and self.seeker.echoed else 0
        return heard[first : len(heard) - (self.seeker.length if self.reply else 0)]

    @property
    def heard(self) -> bool:
        """True when something came that was not our own echo."""
        return self.reply is not None or bool(self.surplus)

    def feed(self, data: bytes, now: float) -> None:
        """Take what was received. A frame that has begun is waited for as long as its framing lets it
        take."""
        self.heard_at = now
        self.reply = self.seeker.feed(data)
        if self.seeker.patience:
            self.deadline = max(self.deadline, now + self.seeker.patience)

    def delay(self, seconds: float) -> None:
        """It leaves so much later than it was decided on."""
        self.began += seconds
        self.ends += seconds
        self.deadline += seconds

    def doubt(self, code: int | None) -> None:
        """Go on waiting: what came, a refusal if it has a code, is taken for the reply to something older."""
        self.doubted, self.code, self.reply = True, code, None


class Echo:
    """Whether the transceiver gives back what we send: declared, or noticed.

    ``there`` is None until it is known. Noise may hide an echo, and a foreign master may ask what we asked,
    so that a few exchanges have to contradict before what is known changes.
    """

    CONVINCED = 4

    def __init__(self, declared: bool) -> None:
        self._declared = declared
        self.there: bool | None = True if declared else None
        self._contrary = 0

    def learn(self, done: Transaction) -> None:
        """Notice from an exchange whether there is an echo, if that can be told from it."""
        seeker = done.seeker
        if self._declared or done.reply is None or done.question.request.mirrored:
            return
        if not seeker.echoed and len(seeker.heard) != seeker.length:
            return
        self._contrary = self._contrary + 1 if seeker.echoed != self.there else 0
        if self.there is None or self._contrary >= self.CONVINCED:
            self.there, self._contrary = seeker.echoed, 0


class Wire:
    """Framing and timing of a line together: makes transactions and knows what they cost."""

    def __init__(self, framing: Framing, timing: Timing, echo: bool) -> None:
        self.framing = framing
        self.timing = timing
        self.echo = Echo(echo)

    def begin(self, question: Question, patience: float, now: float) -> Transaction:
        """The transaction that starts now; the unit has ``patience`` seconds until its reply begins."""
        request = question.request
        data = self.framing.encode(question.unit, request.pdu)
        ends = now + self.timing.duration(len(data))
        reply = self.timing.duration(self.framing.size(request.reply_length))
        seeker = self.framing.seeker(data, request, self.echo.there is True)
        deadline, echo = ends + patience + reply, self.echo.there is not False
        numbered = self.framing.numbered
        return Transaction(
            question, data, seeker, now, ends, deadline, self.timing.end, echo, numbered=numbered
        )

    def turnaround(self, done: Transaction) -> float:
        """Seconds that the unit took until it began its reply."""
        return max(0.0, done.heard_at - done.ends - self.timing.duration(done.seeker.length))

    def too_early(self, done: Transaction) -> bool:
        """True when the reply was there before its bytes can have come behind the request."""
        taken = self.timing.duration(len(done.data) + done.seeker.length)
        earliest = done.ends + self.timing.duration(done.seeker.length)
        return done.heard_at < earliest - TOLERANCE * taken - self.timing.character

    def read_cost(self, count: int, turnaround: float, pause: float = 0.0) -> float:
        """Seconds of line that reading ``count`` registers takes, with the silence after it."""
        request, reply = self.framing.size(5), self.framing.size(2 + 2 * count)
        return self.timing.transaction(request, reply, turnaround, pause)
