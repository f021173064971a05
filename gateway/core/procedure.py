"""How a write or command is carried out: a generator that yields what it needs next. Pure.

A `Procedure` yields `Effect`s and gets their results; it returns the final outcome or raises
`gateway.core.guard.Ended`. `gateway.core.runner` serves it. Nothing here knows of clients or lines.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from typing import Any

from gateway.core.drive import Drive
from gateway.core.guard import NO_CONSENT, Consent
from gateway.line.interface import Priority, Read, Result, Silent, Write
from gateway.mapping.profile import Condition
from gateway.tag import Instant, Origin, Outcome, Role

READ_AGAIN = 2
"""Times that a read without an answer is asked again."""


@dataclass(frozen=True, slots=True)
class Ask:
    """One write or command under way. ``deadline`` (monotonic) is the latest first byte on the wire;
    None: a stop never grows too old. ``setpoint`` is the tag that a newer write may supersede."""

    number: int
    drive: Drive
    what: str
    origin: Origin
    asked: Instant
    deadline: float | None
    urgent: bool = False
    setpoint: str | None = None
    then: str | None = None
    """Command to run after a batch of writes that all name it."""
    to_zero: bool = False
    """It takes a setpoint to zero."""
    takes_back: bool = False
    """It ends a pulse that was given."""
    wanted: Any = field(default=None, hash=False)
    session: int = 0
    """The bridge session that it came through."""
    needed: Role | None = None
    """Least role for it; None: it is the core's own, which asks nobody."""
    consent: Consent = NO_CONSENT
    starts: bool = False
    """It sets the motor running."""
    moves: bool = False
    """It can move the motor, so that the end of its lease has to be made good."""
    sets: frozenset[str] = frozenset()
    """Setpoints that it writes."""
    members: tuple[Drive, ...] = ()
    """The drives that a command to all of a line is for; ``drive`` is the line itself then."""
    about: Mapping[str, Any] = field(default_factory=dict, hash=False)
    """What each of its entries in the journal tells (`gateway.core.attempts.ABOUT`)."""

    @property
    def own(self) -> bool:
        """The core asks it for reasons of its own."""
        return self.needed is None

    @property
    def drives(self) -> tuple[Drive, ...]:
        """The drives that it concerns."""
        return self.members or (self.drive,)

    @property
    def harmless(self) -> bool:
        """It is carried out even while it cannot be put on record (safety.md R2)."""
        return self.urgent or self.to_zero or self.takes_back


@dataclass(frozen=True, slots=True)
class Lane:
    """Wait until nobody else is writing to the drives concerned; answered with the time (monotonic)."""


@dataclass(frozen=True, slots=True)
class Leave:
    """Let the next ones write to the drives concerned."""


@dataclass(frozen=True, slots=True)
class Exchange:
    """One transaction; answered by `Finished`. A write must have been put on record (`Intend`).
    ``condition`` is looked at once more just before it goes out: what it contradicts is not sent."""

    request: Read | Write
    priority: Priority
    deadline: float | None
    condition: Condition = ()


@dataclass(frozen=True, slots=True)
class Finished:
    """What became of a transaction, and when (monotonic). ``objection`` is why a write was held back in the
    last moment, where a rule about its client did that."""

    result: Result
    at: float
    objection: Outcome | None = None


@dataclass(frozen=True, slots=True)
class Intend:
    """Put the frame that is to be sent next on record, with these facts. Answered with the problem in words
    when that is on disk ("": none), after ``patience`` seconds at the latest; at once without.

    With ``keep`` it is put on record later if it cannot be now, for it is sent all the same."""

    facts: Mapping[str, Any] = field(hash=False)
    patience: float | None
    keep: bool = False


@dataclass(frozen=True, slots=True)
class Pause:
    """Let this many seconds pass."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Prove:
    """Watch the drives concerned until the condition holds on all of them in values read after ``since``, at
    the latest until ``until`` (monotonic both); answered with True or False."""

    condition: Condition
    since: float
    until: float


@dataclass(frozen=True, slots=True)
class IsLast:
    """Is there nobody behind this one in the drive's lane who names the same `Ask.then`?"""


@dataclass(frozen=True, slots=True)
class Ramping:
    """From now on this setpoint is on its way to a value; clients are told."""

    point: str
    target: float


@dataclass(frozen=True, slots=True)
class IsOutrun:
    """Has there been a newer ask for one of the same setpoints?"""


@dataclass(frozen=True, slots=True)
class Owing:
    """While on, the frames end what was begun (a pulse): no rule about the client holds them back, and the
    gateway does not end before they are sent. ``once_sent``: from the moment at which the next frame leaves.
    """

    on: bool
    once_sent: bool = False


@dataclass(frozen=True, slots=True)
class StopEach:
    """Stop these drives, each by a stop of its own; answered with what became of each, in order."""

    drives: tuple[Drive, ...]
    why: str


@dataclass(frozen=True, slots=True)
class Report:
    """Tell the asker this outcome now, although the procedure goes on; what comes later is only noted."""

    outcome: Outcome


class Withdrawn(BaseException):
    """A procedure ends before the frame that it put on record last has left."""


Effect = (
    Report | Lane | Leave | Exchange | Intend | Pause | Prove | IsLast | IsOutrun | Ramping | Owing | StopEach
)
Procedure = Generator[Effect, Any, Outcome]


def exchange(
    request: Read | Write, priority: Priority, deadline: float | None, condition: Condition = ()
) -> Generator[Effect, Any, Finished]:
    """Carry out one transaction."""
    finished: Finished = yield Exchange(request, priority, deadline, condition)
    return finished


def read(request: Read, priority: Priority, deadline: float | None) -> Generator[Effect, Any, Finished]:
    """Carry out a read; one that is not answered is asked again, since reading twice is reading."""
    finished = yield from exchange(request, priority, deadline)
    for _ in range(READ_AGAIN):
        if not isinstance(finished.result, Silent):
            break
        finished = yield from exchange(request, priority, deadline)
    return finished
