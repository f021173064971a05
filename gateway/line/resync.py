"""Late answers: which requests may still be answered, and whether a reply can be believed.

A serial line numbers nothing, so the reply to a request that timed out may come later and look like the reply
to another one. Some units answer in order; with a device server or a radio in between, each request may be
answered in its own time. A request without an answer is *open* until units of both kinds are through with it:
until a later request was answered that it cannot be confused with, and until its answer would be later than
late. Without the former, late answers may have piled up.

What could be the answer to an open request proves nothing by itself. Did the same reply come to the same
request more often in a row than there were older ones open, then one of them at least is its own.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

from gateway.modbus import pdu

LATE = 6
"""An answer takes so many of the longest times that it is waited for at most: five time-outs late."""
PILED = 3
"""Late answers of a unit that answers in order delay each other, by so many times that at most."""

COUNTED = 32
"""Replies in a row that are counted, at most."""
RUNS = 64
"""Requests whose replies in doubt are counted, at most."""

_NONCES = 0x10000
_STEP = 0x6A09
"""Odd, so that the nonces of one unit take every value before one comes again."""


class _Open(NamedTuple):
    """A request that was sent at ``at`` and has no answer for sure; ``until`` then its answer may come if
    no later request is answered. ``doubtful``: an answer came, but perhaps that to an older request."""

    request: pdu.Request
    at: float
    until: float
    doubtful: bool
    theirs: bool = False
    """Another master asked it."""

    def may_bring(self, request: pdu.Request, reply: pdu.Reply) -> bool:
        """True when this reply to ``request`` could be the answer to this one."""
        if reply.exception is None:
            return self.request.shape == request.shape
        return self.request.function == request.function or bool(request.error_functions)


class _Rival(NamedTuple):
    """An open request that could have brought a reply: whether it is for the very same registers, and when a
    reply last came while it was open."""

    asked: _Open
    same: bool
    seen: float


@dataclass(slots=True)
class _Run:
    """The same reply in doubt to the same request, several times in a row. ``replies`` are the last of them:
    when each was asked for, and when it was heard. ``rivals`` are the open requests that could have brought
    one of them, each once."""

    reply: pdu.Reply
    replies: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=COUNTED))
    rivals: dict[int, _Rival] = field(default_factory=dict)

    def note(self, request: pdu.Request, rivals: list[_Open], at: float, now: float) -> None:
        """The reply came once more to ``request``, sent at ``at``."""
        self.replies.append((at, now))
        self.rivals.update({id(each): _Rival(each, each.request.pdu == request.pdu, now) for each in rivals})
        oldest = self.replies[0][1]
        self.rivals = {key: rival for key, rival in self.rivals.items() if rival.seen >= oldest}

    def known_since(self) -> tuple[float, float] | None:
        """When the latest reply was asked for and heard from which on there were more replies than rivals:
        one of them at least is no rival's. (What was asked since then for the same registers is none.)"""
        for count, (asked, heard) in enumerate(reversed(self.replies), 1):
            others = [rival for rival in self.rivals.values() if rival.seen >= heard]
            if count > sum(not rival.same or rival.asked.at < asked for rival in others):
                return asked, heard
        return None


class Suspicion:
    """What a unit may still answer late. ``longest`` is the longest time in seconds that it is waited for."""

    def __init__(self, unit: int, longest: float) -> None:
        self._horizon = LATE * longest
        self._nonce = unit * 257
        self._open: list[_Open] = []
        self._runs: dict[bytes, _Run] = {}
        """By request."""
        self._proved = 0.0
        """All requests from before are over for a unit that answers in order."""
        self._write = b""
        self._only_write_since = 0.0

    def slower(self, longest: float) -> None:
        """The unit is waited for so many seconds now, no fewer than before."""
        self._horizon = LATE * longest

    def missed(self, request: pdu.Request, at: float, doubtful: bool = False, theirs: bool = False) -> None:
        """A request whose last bit went out at ``at`` has no answer, or a ``doubtful`` one; or another master
        asked it (``theirs``)."""
        last = self._open[-1] if self._open else None
        piled = last.until if last and last.at >= self._proved else at
        until = min(max(piled, at) + self._horizon, at + PILED * self._horizon)
        self._open = [*self._still_open(at), _Open(request, at, until, doubtful, theirs)]

    def explains(self, shape: pdu.Shape, asking: bool, now: float) -> bool:
        """An answer came for which nobody waits: True when an open request may have brought it. If that is
        another master's, and none of ours (we are not ``asking`` it now), his request is over."""
        alike = [each for each in self._still_open(now) if each.request.shape == shape]
        if len(alike) == 1 and alike[0].theirs and not asking:
            self._open.remove(alike[0])
        return bool(alike)

    def wrote(self, request: bytes, at: float) -> None:
        """A write goes out, its last bit at ``at``."""
        if request != self._write:
            self._write, self._only_write_since = request, at

    def shapes(self, now: float) -> set[pdu.Shape]:
        """What late answers look like that may still come."""
        return {each.request.shape for each in self._still_open(now)}

    def out_of_step(self, now: float) -> bool:
        """True while nothing was answered since a request was missed."""
        return any(each.at >= self._proved for each in self._still_open(now))

    def next_end(self, now: float) -> float:
        """When the next open request is over, if nothing more is missed; ``now`` when none is open."""
        return min((self._end(each) for each in self._still_open(now)), default=now)

    def weigh(self, request: pdu.Request, reply: pdu.Reply, at: float, now: float) -> float | None:
        """Since when a reply is known that was heard now, and whose request was sent at ``at``; None when it
        cannot be believed."""
        self._open = self._still_open(now)
        rivals = [each for each in self._open if each.may_bring(request, reply)]
        if not rivals:
            self._runs.pop(request.pdu, None)
            self._proved = max(self._proved, at)
            return now
        if all(self._as_good(each, request, reply) for each in rivals):
            self._answered_in_doubt(request, at, rivals)
            return now
        run = self._run_of(request, reply)
        run.note(request, rivals, at, now)
        if reply.exception is None:
            self._answered_in_doubt(request, at, rivals)
        if (known := run.known_since()) is None:
            return None
        self._proved = max(self._proved, known[0])
        return known[1]

    def _run_of(self, request: pdu.Request, reply: pdu.Reply) -> _Run:
        """How often this reply came to this request in a row; other requests in between change nothing."""
        run = self._runs.get(request.pdu)
        if run is None or run.reply != reply:
            if len(self._runs) >= RUNS:
                self._runs.clear()
            run = self._runs[request.pdu] = _Run(reply)
        return run

    def loop_back(self) -> pdu.Request:
        """A question that no late answer can be the reply to."""
        self._nonce = (self._nonce + _STEP) % _NONCES
        return pdu.loop_back(self._nonce)

    def _as_good(self, other: _Open, request: pdu.Request, reply: pdu.Reply) -> bool:
        """An earlier write of the very same, nothing else being written since: its answer says as much."""
        same = other.request.pdu == request.pdu == self._write
        return same and other.at >= self._only_write_since and reply.exception is None

    def _answered_in_doubt(self, request: pdu.Request, at: float, rivals: list[_Open]) -> None:
        """One more asked, one more heard: as many as before are under way, but this may be one of them."""
        doubtful = [each for each in rivals if each.doubtful]
        if len(doubtful) >= max(1, len(rivals) - len(doubtful)):
            self._open.remove(doubtful[0])
        self.missed(request, at, doubtful=True)

    def _still_open(self, now: float) -> list[_Open]:
        """Those that are open at an instant, which may be one to come: what a line will do is foretold."""
        return [each for each in self._open if now < self._end(each)] if self._open else self._open

    def _end(self, each: _Open) -> float:
        return each.at + self._horizon if each.at < self._proved else each.until
