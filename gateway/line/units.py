"""The units of a line together: what each may be asked now, how, and how patiently."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from gateway.line.interface import Priority, Read, UnitFacts, Want
from gateway.line.overhearing import News
from gateway.line.reachability import Probing, Unit
from gateway.line.requests import (
    BROADCAST,
    broadcast_facts,
    longer,
    may_read,
    request_of,
    shape_of,
    understood,
)
from gateway.line.schedule import Choice, Due, Probe, Waiting
from gateway.line.transaction import Question, Transaction
from gateway.modbus import pdu
from gateway.modbus.framing import FramingName
from gateway.modbus.overheard import overheard

ANOTHER = 30.0
"""Seconds after a word of another master in which damaged bytes count as one."""


class Units:
    """All units, and whose turn it is to be probed."""

    def __init__(self, facts: Sequence[UnitFacts]) -> None:
        self._units = {one.unit: Unit(one) for one in facts}
        self._broadcast = broadcast_facts(facts)
        self._wants: Sequence[Want] = ()
        self.probing = Probing()
        self._another_at = -math.inf
        """When another master was last heard, whomever he asked."""

    def __iter__(self) -> Iterator[Unit]:
        return iter(self._units.values())

    def __contains__(self, unit: int) -> bool:
        return unit in self._units

    def __getitem__(self, unit: int) -> Unit:
        return self._units[unit]

    def facts(self, unit: int) -> UnitFacts:
        """The facts of a unit, or of all together for broadcasts. Raises `ValueError` for a stranger."""
        if unit == BROADCAST:
            return self._broadcast
        if unit not in self._units:
            raise ValueError(f"there is no unit {unit} on this line")
        return self._units[unit].facts

    def longest(self) -> dict[int, float]:
        """How many seconds the reply of each unit is waited for at most."""
        return {number: unit.turnaround.longest for number, unit in self._units.items()}

    def late(self, unit: int, seconds: float) -> None:
        """A unit began a reply so long after a request that was not waited for any more."""
        self._units[unit].late(seconds)

    def ready_at(self, unit: int) -> float:
        """The instant from which a unit may be asked; infinite while it is held to be down."""
        return -math.inf if unit == BROADCAST else self._units[unit].ready_at

    def probe(self) -> Probe | None:
        """The next probe, now or later."""
        return self.probing.next(self._units.values())

    def want(self, wants: Sequence[Want]) -> None:
        """What is wanted of all units: no read is ever cut within one of these."""
        self._wants = wants

    def foretold(self, choice: Due, now: float) -> pdu.Request | None:
        """What `question` will ask for a planned read, if that is a read of it."""
        unit, read = self._units[choice.unit], self._read_of(choice)
        assert read is not None, "what is planned is a read"
        if now < unit.doubling.until or (unit.facts.loop_back and unit.suspicion.out_of_step(now)):
            return None
        question = self._apart(unit, choice, read, now)
        return None if question is None else question.request

    def question(self, choice: Choice, echo: bool | None, now: float) -> Question | None:
        """What to ask so that no late answer looks like the reply; None: let this read wait. ``echo`` tells
        whether our own request comes back, None when that is not known yet."""
        read = self._read_of(choice)
        if read is None:
            write = self._plain(choice)
            return self._trial(choice) if echo is None and _looks_like_its_echo(write) else write
        unit = self._units[choice.unit]
        if isinstance(choice, Due) and now < unit.doubling.until:
            return None
        if unit.facts.loop_back and echo is False and unit.suspicion.out_of_step(now):
            nonce = understood(unit.facts, unit.suspicion.loop_back())
            return Question(choice.unit, nonce, choice, aside=True)
        apart = self._apart(unit, choice, read, now)
        if apart is None and (unit.silences or not isinstance(choice, Due)):
            return self._plain(choice)
        return apart

    def overheard(self, news: News, asking: bool, now: float) -> None:
        """What another master asked was heard, or an answer that nobody waits for. ``asking``: a request of
        ours to that unit is under way."""
        if news.asked:
            self._another_at = now
        if news.unit in self._units:
            self._units[news.unit].overheard(news.request, news.asked, asking, news.at, now)

    def weigh(self, done: Transaction, reply: pdu.Reply, framing: FramingName) -> float | None:
        """Since when the reply of a transaction is known; None when it cannot be believed. Where another
        master talks, nothing is believed behind damaged bytes: they may be his question, this its answer."""
        unit, request = self._units[done.question.unit], done.question.request
        if done.heard_at - self._another_at < ANOTHER and overheard(framing, done.surplus).rest:
            unit.suspicion.missed(request, done.ends, doubtful=True)
            return None
        return unit.suspicion.weigh(request, reply, done.ends, done.heard_at)

    def postponed(self, unit: int, now: float) -> float:
        """Until when a planned read waits for which there was no question."""
        known = self._units[unit]
        return known.doubling.until if now < known.doubling.until else known.suspicion.next_end(now)

    def wrote(self, question: Question, at: float) -> None:
        """A write is going out, its last bit at ``at``."""
        units = self._units.values() if question.unit == BROADCAST else [self._units[question.unit]]
        for unit in units:
            unit.suspicion.wrote(question.request.pdu, at)

    def pause(self, question: Question) -> float:
        """Seconds of silence that the unit needs afterwards, beside the gap."""
        facts, write = self.facts(question.unit), question.write
        if write is None:
            return facts.pause_read
        usual = facts.pause_broadcast if question.unit == BROADCAST else facts.pause_write
        return max(usual, write.pause)

    def patience(self, question: Question) -> float:
        """Seconds that the unit gets until its reply begins. A write's outcome is worth the longest wait."""
        if not question.answered:
            return 0.0
        unit = self._units[question.unit]
        if isinstance(question.choice, Probe):
            return unit.patience
        if question.request.function in (pdu.WRITE_ONE, pdu.WRITE_MANY):
            return unit.turnaround.longest
        return unit.turnaround.limit

    # How to ask

    def _read_of(self, choice: Choice) -> Read | None:
        """The registers that are still to be read; None for a write."""
        match choice:
            case Due(block=block, done=done):
                return Read(block.unit, block.address + done, block.count - done, block.table)
            case Probe(unit=unit):
                return Read(unit, *self.facts(unit).probe)
            case Waiting(job=job):
                return job.request if isinstance(job.request, Read) else None

    def _plain(self, choice: Choice) -> Question:
        """Ask for just what was chosen."""
        facts, read = self.facts(choice.unit), self._read_of(choice)
        if read is not None:
            return Question(choice.unit, request_of(facts, read), choice, part=(read.address, read.count))
        assert isinstance(choice, Waiting), "all others read"
        return Question(choice.unit, request_of(facts, choice.job.request), choice)

    def _apart(self, unit: Unit, choice: Choice, read: Read, now: float) -> Question | None:
        """A question for a read, or for its first part, whose reply no late answer looks like."""
        late = unit.suspicion.shapes(now)
        for part in self._parts(choice, read):
            for way in longer(unit.facts, part):
                if shape_of(way) not in late:
                    request, span = request_of(unit.facts, way), (part.address, part.count)
                    return Question(choice.unit, request, choice, part=span, skip=part.address - way.address)
        return None

    def _parts(self, choice: Choice, read: Read) -> Iterator[Read]:
        """The read as a whole, then less and less of it; what was asked once comes whole or not at all. No
        part, nor what is left then, ends at a register that the whole only passed over."""
        yield read
        if not isinstance(choice, Due):
            return
        facts = self.facts(read.unit)
        wants = [want for want in self._wants if want.unit == read.unit and want.table == read.table]
        for count in range(read.count - 1, 0, -1):
            cut = read.address + count
            if any(want.address < cut < want.address + want.count for want in wants):
                continue
            if may_read(facts, read.address, count) and may_read(facts, cut, read.count - count):
                yield Read(read.unit, read.address, count, read.table)

    def _trial(self, choice: Choice) -> Question:
        """A read that shows whether there is an echo."""
        facts = self.facts(choice.unit)
        return Question(choice.unit, request_of(facts, Read(choice.unit, *facts.probe)), choice, aside=True)


def _looks_like_its_echo(question: Question) -> bool:
    """True for a write whose reply does, unless it is urgent: what proves a stop is what the drive shows."""
    choice = question.choice
    urgent = isinstance(choice, Waiting) and choice.job.priority is Priority.STOP
    return question.answered and question.request.mirrored and not urgent
