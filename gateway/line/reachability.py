"""Which units answer, how fast, and when to ask those that do not."""

from __future__ import annotations

import math
from collections.abc import Collection

from gateway.line.doubling import Doubling, Punctual
from gateway.line.interface import UnitFacts
from gateway.line.resync import Suspicion
from gateway.line.schedule import Probe
from gateway.line.transaction import Transaction
from gateway.modbus.framing import FramingName
from gateway.modbus.overheard import overheard
from gateway.modbus.pdu import Request

FLOOR = 0.03
"""Least seconds to wait for a reply: a USB adapter may hold bytes back for 16 ms, each way a little more."""
DOWN_AFTER = 3
"""Requests in a row without an answer after which a unit that did answer is held to be down."""
DOWN_AT_FIRST = 2
"""The same for a unit that never answered."""
PROBE_SHARE = 0.02
"""Share of the line that all probes together may take from units that answer."""
PROBE_SHARE_ALONE = 0.25
"""The same while no unit answers: there is nobody to take it from."""
PROBE_PERIOD = 5.0
"""Least seconds between two probes of one unit."""
GROWTH = 2.0
"""A unit whose answers keep coming too late is waited for up to so many times what its profile says ..."""
PATIENCE = 1.0
"""... but for that no longer than so many seconds: all others wait as long."""
LATER = 1.25
"""By what to wait longer than late answers took."""
PATIENT_EVERY = 16
"""Of so many probes one waits as long as the profile says a reply can take, the others a usual time."""


class Turnaround:
    """Learns how long a unit takes from the end of a request to the start of its reply (all in seconds)."""

    def __init__(self, facts: UnitFacts) -> None:
        self._facts = facts
        self._mean = math.nan
        self._deviation = 0.0
        self._peak = 0.0
        self._missed = 0
        self._late = 0.0
        """How long the last answer took that came too late; 0 when none did."""
        self._grown = 0.0

    @property
    def usual(self) -> float:
        """What to plan with."""
        return self._facts.reply_usual if math.isnan(self._mean) else self._mean

    @property
    def longest(self) -> float:
        """The profile's word, or what was learned of late answers; but never below the floor."""
        profile = max(FLOOR, self._facts.reply_max)
        return max(profile, min(self._grown, GROWTH * profile, PATIENCE))

    @property
    def limit(self) -> float:
        """How long to wait for a reply; doubled with each that did not come."""
        if math.isnan(self._mean):
            return self.longest
        learned = max(2 * self._mean + 4 * self._deviation, 1.5 * self._peak, FLOOR)
        return min(learned * 2.0 ** min(self._missed, 8), self.longest)

    @property
    def probe_limit(self) -> float:
        """How long a probe usually waits."""
        return min(max(8 * self.usual, 2 * FLOOR, self._grown), self.longest)

    def answered(self, seconds: float) -> None:
        """A reply began so long after its request."""
        self._missed = 0
        self._peak = max(seconds, 0.999 * self._peak)
        if math.isnan(self._mean):
            self._mean, self._deviation = seconds, seconds / 2
            return
        error = seconds - self._mean
        self._mean += error / 8
        self._deviation += (abs(error) - self._deviation) / 4

    def missed(self) -> None:
        """No reply came in time."""
        self._missed += 1

    def late(self, seconds: float) -> None:
        """A reply began so long after a request that was not waited for any more. The shorter time of two
        counts: one could be the answer to a younger request than it is held to be."""
        self._grown = max(self._grown, LATER * min(seconds, self._late))
        self._late = seconds


class Unit:
    """What is known of one unit. ``up`` is None until it was asked."""

    def __init__(self, facts: UnitFacts) -> None:
        self.facts = facts
        self.up: bool | None = None
        self.turnaround = Turnaround(facts)
        self.suspicion = Suspicion(facts.unit, self.turnaround.longest)
        self.doubling = Doubling(self.turnaround.longest)
        self.punctual = Punctual()
        self.blocked_until = -math.inf
        self.probed_at = -math.inf
        self._probes = 0
        self.silences = 0
        """Requests in a row that were not answered at all."""
        self._silent_since = 0.0

    @property
    def is_new(self) -> bool:
        """Nothing was heard of it since the port was opened, and nothing awaited in vain."""
        return self.up is None and not self.silences

    @property
    def ready_at(self) -> float:
        """The instant from which it may be asked."""
        return math.inf if self.up is False else self.blocked_until

    @property
    def patience(self) -> float:
        """How long this probe waits for a reply."""
        patient = self._probes % PATIENT_EVERY == 0
        return self.turnaround.longest if patient else self.turnaround.probe_limit

    def probed(self, now: float) -> None:
        """A probe went out."""
        self.probed_at = now
        self._probes += 1

    def heard(self) -> bool:
        """It answered; True when that is news."""
        news = self.up is not True
        if news:
            self.doubling.back()
        self.up = True
        self.silences = 0
        return news

    def silent(self, asked: float, now: float) -> bool:
        """A request that went out at ``asked`` got no answer; True when it is held to be down from now on."""
        if not self.silences:
            self._silent_since = asked
        self.silences += 1
        enough = self.silences >= (DOWN_AT_FIRST if self.up is None else DOWN_AFTER)
        if self.up is False or not enough or now - self._silent_since < self.facts.reply_max:
            return False
        self.up = False
        self.probed_at = now
        self._probes = 1
        return True

    def late(self, seconds: float) -> None:
        """It began a reply so long after a request that was not waited for any more."""
        self.turnaround.late(seconds)
        self.suspicion.slower(self.turnaround.longest)

    def unanswered(self, done: Transaction, framing: FramingName) -> None:
        """The reply may still come, unless it came damaged. Where replies are numbered, that does no harm."""
        request = done.question.request
        alone = done.seeker.echoed or not done.echo  # or what came may be our own echo, damaged
        came = alone and done.seeker.spoilt and request.shape not in self.suspicion.shapes(done.ends)
        came = came and not overheard(framing, done.surplus).frames  # or others said as much together
        if not came and not done.numbered:
            self.suspicion.missed(request, done.ends)

    def overheard(self, request: Request, asked: bool, asking: bool, at: float, now: float) -> None:
        """At an instant another master asked it this: it will be answered, and that may look like an answer
        to us. Or (not ``asked``) an answer to this came for which nobody waits: if no request without an
        answer explains it, then there are too many. ``asking``: a request of ours to it is under way."""
        if asked or not (self.suspicion.explains(request.shape, asking, now) or self.doubling.too_many(at)):
            self.suspicion.missed(request, now, theirs=asked)

    def forget(self) -> None:
        """The port was closed: whether the unit answers is not known any more."""
        self.up = None
        self.silences = 0


class Probing:
    """Whose turn it is to be probed: those that do not answer in a round, together never above their share of
    the line; and one that answered once too often when it may be asked again."""

    def __init__(self) -> None:
        self._began, self._took = -math.inf, 0.0

    def next(self, units: Collection[Unit]) -> Probe | None:
        """The next probe, now or later; None when every unit is up and known to be one."""
        doubtful = [unit for unit in units if unit.up and unit.doubling.doubtful]
        probes = [
            Probe(unit.facts.unit, max(unit.doubling.until, unit.probed_at + PROBE_PERIOD))
            for unit in doubtful
        ]
        silent = [unit for unit in units if unit.up is False]
        if silent:
            first = min(silent, key=lambda unit: unit.probed_at)
            share = PROBE_SHARE if any(unit.up for unit in units) else PROBE_SHARE_ALONE
            at = max(self._began + self._took / share, first.probed_at + PROBE_PERIOD)
            probes.append(Probe(first.facts.unit, at))
        return min(probes, key=lambda probe: probe.at, default=None)

    def spent(self, began: float, seconds: float) -> None:
        """A probe that began at ``began`` took so much of the line."""
        self._began, self._took = began, seconds
