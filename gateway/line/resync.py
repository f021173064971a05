"""Late answers: after a time-out a unit is believed again only behind an answer that can be no old one.

RTU numbers nothing, so the reply to a request that timed out may come later and look like the reply to the
next one. Units answer in order; therefore the answer to a request that differs from all unanswered ones
proves that nothing older is on its way. Where no such request exists, the unit is left alone for as long as
its profile says that a reply can take.
"""

from __future__ import annotations

from collections.abc import Iterator

from gateway.line.interface import UnitFacts
from gateway.line.requests import understood
from gateway.modbus import pdu

_NONCES = 0x10000
_STEP = 0x6A09
"""Odd, so that the nonces of one unit take every value before one comes again."""


class Suspicion:
    """What a unit may still answer late."""

    def __init__(self, facts: UnitFacts) -> None:
        self._facts = facts
        self._nonce = facts.unit * 257
        self._unanswered: set[tuple[bytes, int]] = set()
        self._functions: set[int] = set()
        self._last = 0.0

    def late(self, now: float) -> frozenset[int]:
        """Functions whose exception reply may be a late one. Exceptions all look alike, so that only time
        can end this doubt for a unit that answers with nothing else."""
        return frozenset() if now >= self.quarantine_end else frozenset(self._functions)

    @property
    def quarantine_end(self) -> float:
        """When, by the profile's word, no late answer can come any more."""
        return self._last + self._facts.reply_max

    def missed(self, request: pdu.Request, at: float) -> None:
        """A request that went out at ``at`` was not answered in time."""
        self._last = max(self._last, at)
        if request.function != pdu.DIAGNOSTICS:  # its nonce never comes again soon
            self._unanswered.add(request.shape)
        self._functions.add(request.function)

    def clear(self) -> None:
        """The unit is in step again."""
        self._unanswered.clear()
        self._functions.clear()

    def tells_apart(self, request: pdu.Request) -> bool:
        """True when no late answer can be taken for the answer to this request."""
        return request.shape not in self._unanswered

    def question(self) -> pdu.Request | None:
        """A request whose answer puts the unit in step; None when there is none but waiting.

        The loop-back is the best of them, unless the last one was lost and an exception to it would not be
        believed.
        """
        read = next((request for request in self._reads() if self.tells_apart(request)), None)
        if self._facts.loop_back and (read is None or pdu.DIAGNOSTICS not in self._functions):
            self._nonce = (self._nonce + _STEP) % _NONCES
            return understood(self._facts, pdu.loop_back(self._nonce))
        return read

    def _reads(self) -> Iterator[pdu.Request]:
        """Reads of every length that the unit allows."""
        if pdu.READ_HOLDING not in self._facts.functions:
            return
        for low, high in self._facts.readable:
            for count in range(1, min(self._facts.read_max, high - low + 1) + 1):
                yield understood(self._facts, pdu.read_registers(low, count))
