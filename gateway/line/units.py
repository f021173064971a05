"""The units of a line together: what each may be asked now, how, and how patiently."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from gateway.line.interface import Priority, Read, UnitFacts
from gateway.line.reachability import Probing, Unit
from gateway.line.requests import BROADCAST, broadcast_facts, request_of
from gateway.line.schedule import Choice, Due, Probe, Waiting
from gateway.line.transaction import Question, Wire
from gateway.modbus import pdu


class Units:
    """All units, and whose turn it is to be probed."""

    def __init__(self, facts: Sequence[UnitFacts]) -> None:
        self._units = {one.unit: Unit(one) for one in facts}
        self._broadcast = broadcast_facts(facts)
        self.probing = Probing()

    def __iter__(self) -> Iterator[Unit]:
        return iter(self._units.values())

    def __getitem__(self, unit: int) -> Unit:
        return self._units[unit]

    def facts(self, unit: int) -> UnitFacts:
        """The facts of a unit, or of all together for broadcasts. Raises `ValueError` for a stranger."""
        if unit == BROADCAST:
            return self._broadcast
        if unit not in self._units:
            raise ValueError(f"there is no unit {unit} on this line")
        return self._units[unit].facts

    def ready_at(self, unit: int) -> float:
        """The instant from which a unit may be asked; infinite while it is held to be down."""
        return -math.inf if unit == BROADCAST else self._units[unit].ready_at

    def probe(self) -> Probe | None:
        """The next probe, now or later."""
        return self.probing.next(self)

    def frame(self, choice: Due, wire: Wire) -> bytes:
        """The bytes of a planned read; empty when it may have to wait for another question."""
        request = self._request(choice)
        told_apart = self._units[choice.unit].suspicion.tells_apart(request)
        return wire.framing.encode(choice.unit, request.pdu) if told_apart else b""

    def question(self, choice: Choice, now: float) -> Question | None:
        """What to ask so that no late answer is mistaken for the reply; None: leave the unit alone."""
        request = self._request(choice)
        if not (question := Question(choice.unit, request, choice)).answered:
            return question
        suspicion = self._units[choice.unit].suspicion
        late = suspicion.late(now)
        if suspicion.tells_apart(request):
            return Question(choice.unit, request, choice, late=late)
        if isinstance(choice, Waiting) and choice.job.priority is Priority.STOP:
            return Question(choice.unit, request, choice, doubtful=True, late=late)
        aside = suspicion.question()
        if aside is not None:
            return Question(choice.unit, aside, choice, aside=True, late=late)
        if now < suspicion.quarantine_end:
            return None
        suspicion.clear()
        return Question(choice.unit, request, choice)

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

    def _request(self, choice: Choice) -> pdu.Request:
        facts = self.facts(choice.unit)
        match choice:
            case Waiting():
                return request_of(facts, choice.job.request)
            case Due(block=block):
                return request_of(facts, Read(block.unit, block.address, block.count, block.table))
            case Probe():
                return request_of(facts, Read(choice.unit, *facts.probe))
