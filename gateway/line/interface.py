"""What goes into a line and what comes out of it, as values.

A `gateway.line.line.Line` is a pure machine that owns one half-duplex line. The core tells it what is
wanted (`Want`) and asked (`Job`), the shell tells it what happened on the port; each of its methods
returns the `Action`s to be carried out, in order. It speaks registers, not points: decoding is the
core's business. All times are seconds of the monotonic clock that the caller passes in.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

from gateway.mapping.profile import SerialFormat, Table


class Priority(IntEnum):
    """Who goes first. One decision, one transaction."""

    STOP = 0
    """Overtakes everything but the transaction on the wire; sent even to a drive held to be down."""
    PROOF = 1
    """The reads that tell whether a stop was obeyed: they do not wait until planned reads had their share."""
    COMMAND = 2
    """Writes of commands and setpoints, and the reads that prove them."""
    READ = 3
    PROBE = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class LineSettings:
    """How to speak on the line. ``gap`` is the least silence in seconds beside 3.5 characters."""

    name: str
    framing: Literal["rtu", "ascii", "tcp"]
    baud: int
    format: SerialFormat
    gap: float = 0.0
    echo: bool = False
    """The transceiver gives us back what we send."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitFacts:
    """What a drive at a unit address can take; from its profile.

    ``readable`` are the closed address ranges that may be read, merged where they touch: any read must
    lie inside one of them, unless ``bridge`` allows to pass over the addresses between two of them.
    ``probe`` is the cheapest read that tells whether the drive is there: address and count.
    """

    unit: int
    functions: tuple[int, ...]
    read_max: int
    write_max: int
    write_one: int
    readable: tuple[tuple[int, int], ...]
    probe: tuple[int, int]
    bridge: bool = False
    holes: tuple[tuple[int, int], ...] = ()
    loop_back: bool = False
    """Function 08H is there for resynchronising."""
    reply_usual: float = 0.01
    reply_max: float = 1.0
    pause_read: float = 0.0
    pause_write: float = 0.0
    pause_broadcast: float = 0.1
    """Seconds of silence after a read, a write, a broadcast, beside the gap."""
    error_functions: tuple[int, ...] = ()
    """Function bytes that also mean an error reply, beside function + 80H."""


@dataclass(frozen=True, slots=True)
class Want:
    """These registers of that unit at least every ``period`` seconds. ``rank`` 0 stretches last."""

    unit: int
    address: int
    count: int
    period: float
    rank: int = 1
    table: Table = Table.HOLDING


@dataclass(frozen=True, slots=True)
class Read:
    """Read ``count`` registers from ``address``."""

    unit: int
    address: int
    count: int
    table: Table = Table.HOLDING


@dataclass(frozen=True, slots=True)
class Write:
    """Write registers from ``address`` on, in one frame; the unit's facts choose the function.

    ``silent``: the drive does not answer this write (a broadcast never is); it counts as answered once it
    is sent and its pause is over. ``pause``: seconds of silence to keep on the line afterwards, beside the
    gap and counted from the last bit on the wire; only a stop to another unit does not wait for it.
    """

    unit: int
    address: int
    words: tuple[int, ...]
    silent: bool = False
    pause: float = 0.0


@dataclass(frozen=True, slots=True)
class Job:
    """Something asked: one request, once. It is dropped unsent after ``deadline`` (None: never)."""

    id: int
    request: Read | Write
    priority: Priority
    deadline: float | None = None


@dataclass(frozen=True, slots=True)
class Answered:
    """A normal reply; ``words`` are the registers read (empty for a write)."""

    words: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Refused:
    """The drive answered with an exception code."""

    code: int


@dataclass(frozen=True, slots=True)
class Silent:
    """No believable reply in time. ``damaged`` tells that something came, but nothing valid; ``doubted`` that
    a valid reply came, which may be the answer to an older request, ``code`` being its exception code if it
    was a refusal."""

    damaged: bool = False
    doubted: bool = False
    code: int | None = None


@dataclass(frozen=True, slots=True)
class Unsent:
    """Not one byte went out: the deadline passed, the port is down, or the caller no longer admits it."""

    why: Literal["expired", "line_down", "not_admitted"]


Result = Answered | Refused | Silent | Unsent


@dataclass(frozen=True, slots=True)
class OpenPort:
    """Open the port; answer with `Line.port_opened` or `Line.port_lost`."""


@dataclass(frozen=True, slots=True)
class ClosePort:
    """Close the port; nothing is answered."""


@dataclass(frozen=True, slots=True)
class Transmit:
    """Put these bytes on the wire now."""

    data: bytes


@dataclass(frozen=True, slots=True)
class BlockRead:
    """A planned read was answered. ``at`` is when its last byte arrived."""

    unit: int
    address: int
    words: tuple[int, ...]
    at: float
    table: Table = Table.HOLDING


@dataclass(frozen=True, slots=True)
class BlockFailed:
    """A planned read was refused, or the unit is held to be down because of its silence."""

    unit: int
    address: int
    count: int
    result: Refused | Silent
    at: float
    table: Table = Table.HOLDING


@dataclass(frozen=True, slots=True)
class JobSent:
    """The last byte of a job's request leaves at ``at``."""

    id: int
    at: float


@dataclass(frozen=True, slots=True)
class JobDone:
    """What became of a job. Each job is told exactly once."""

    id: int
    result: Result
    at: float


@dataclass(frozen=True, slots=True)
class UnitUp:
    """A unit answers (for the first time, or again)."""

    unit: int
    at: float


@dataclass(frozen=True, slots=True)
class UnitDown:
    """A unit is held to be down: its reads stop, and a probe asks from time to time."""

    unit: int
    at: float
    reason: str


@dataclass(frozen=True, slots=True)
class PlanChanged:
    """The plan was made anew; `Line.plan` holds it."""


Action = (
    OpenPort
    | ClosePort
    | Transmit
    | BlockRead
    | BlockFailed
    | JobSent
    | JobDone
    | UnitUp
    | UnitDown
    | PlanChanged
)


@dataclass(frozen=True, slots=True)
class Block:
    """Contiguous registers read in one transaction every ``period`` seconds.

    ``cost`` is its wire time in seconds, silences and turnaround included; ``worst_age`` the oldest
    that its values can get while the plan holds.
    """

    unit: int
    address: int
    count: int
    period: float
    cost: float
    worst_age: float
    table: Table = Table.HOLDING


@dataclass(frozen=True, slots=True)
class Plan:
    """The reads of a line. ``load`` is the share of the wire they take, at the periods of the plan;
    ``stretch`` the longest factor by which a wanted period had to be lengthened (1: none)."""

    blocks: tuple[Block, ...] = ()
    load: float = 0.0
    stretch: float = 1.0

    def period(self, unit: int, address: int, count: int, table: Table = Table.HOLDING) -> float | None:
        """The period in seconds at which these registers are read, None when no block covers them."""
        periods = [
            block.period
            for block in self.blocks
            if block.unit == unit
            and block.table == table
            and block.address <= address
            and address + count <= block.address + block.count
        ]
        return min(periods, default=None)


@dataclass(slots=True)
class Counters:
    """What happened on a line since start."""

    requests: int = 0
    answered: int = 0
    refused: int = 0
    timeouts: int = 0
    damaged: int = 0
