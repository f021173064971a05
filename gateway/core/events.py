"""What the core is told and what it wants done, as values.

`gateway.core.core.Core.step(event, now)` takes one `Event` and returns the `Action`s to carry out, in
order. Requests and responses of clients are those of `gateway.bridge.messages`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from gateway.bridge.messages import Call, Response
from gateway.core.memory import Memory
from gateway.core.runs import Boot
from gateway.tag import Role


@dataclass(frozen=True, slots=True)
class PortOpened:
    """The port of this line is open."""

    line: str


@dataclass(frozen=True, slots=True)
class PortLost:
    """The port of this line could not be opened, or went away."""

    line: str
    reason: str


@dataclass(frozen=True, slots=True)
class Received:
    """Bytes arrived on this line; ``at`` is when they were there at the latest (monotonic), where that was
    noted before the step."""

    line: str
    data: bytes
    at: float = math.inf


@dataclass(frozen=True, slots=True)
class Ticked:
    """The time that `Core.wake` named has come."""


@dataclass(frozen=True, slots=True)
class Joined:
    """A client connected. ``ceiling`` bounds the role that it may claim for its users."""

    session: int
    name: str
    ceiling: Role


@dataclass(frozen=True, slots=True)
class Left:
    """A client is gone; its demands go with it."""

    session: int


@dataclass(frozen=True, slots=True)
class Asked:
    """A client asks for something. ``came`` is when (monotonic), where it had to wait for its turn: a stop
    that came later may have been told before."""

    session: int
    request: Call
    came: float = math.inf


@dataclass(frozen=True, slots=True)
class Recorded:
    """The journal entry with this number is on disk, or could not be written (``problem``)."""

    number: int
    problem: str = ""


@dataclass(frozen=True, slots=True)
class Started:
    """Begin: open the ports.

    ``memory`` is what the journal remembers of earlier runs; ``broken`` tells where its chain is, if it is;
    ``cut`` is how many bytes at its end were no whole entry.
    """

    memory: Memory = field(default_factory=Memory, hash=False)
    boot: Boot = field(default_factory=Boot)
    broken: str = ""
    cut: int = 0


@dataclass(frozen=True, slots=True)
class Stopping:
    """End: nothing new is begun, everybody who waits is told. A pulse that is under way is taken back first;
    `gateway.core.core.Core.ended` tells when that is done."""


Event = PortOpened | PortLost | Received | Ticked | Joined | Left | Asked | Recorded | Started | Stopping


@dataclass(frozen=True, slots=True)
class Open:
    """Open the port of this line; answer `PortOpened` or `PortLost`."""

    line: str


@dataclass(frozen=True, slots=True)
class Close:
    """Close the port of this line."""

    line: str


@dataclass(frozen=True, slots=True)
class Transmit:
    """Put these bytes on this line now."""

    line: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Tell:
    """Send this to a client."""

    session: int
    message: Response


@dataclass(frozen=True, slots=True)
class Record:
    """Append to the journal; answer `Recorded` with this number once it is flushed to disk.

    The entry is plain JSON data. If it cannot be written now, one to ``keep`` is written as soon as that is
    possible again; another is dropped, and `Recorded` says so.
    """

    number: int
    entry: dict[str, Any] = field(hash=False)
    keep: bool = True


Action = Open | Close | Transmit | Tell | Record
