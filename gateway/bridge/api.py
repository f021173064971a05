"""What the core offers to everybody above it: frozen values, batches, sequence numbers.

`Bridge` has two implementations: `gateway.core.direct` calls the core in the same process (for tests
and for the command line without a running core), `gateway.bridge.client` goes over a socket.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping, Sequence
from typing import Any, Protocol

import msgspec

from gateway.bridge.commanding import ControlInfo as ControlInfo  # noqa: PLC0414
from gateway.bridge.commanding import ControlState as ControlState  # noqa: PLC0414
from gateway.bridge.commanding import LeaseAct as LeaseAct  # noqa: PLC0414
from gateway.tag import Event, Origin, Outcome, Role, Sample, Value, ValueType

API_VERSION = 3
"""Raised at each change that an adapter of another version could misunderstand."""

DEFAULT_TTL = 5.0
"""Seconds that a write or command may wait for its first byte on the wire."""


DIAGNOSTIC = "diagnostic"
"""The kind of points that hold no register: what the gateway found out itself (`gateway.mapping.own`)."""


class PointInfo(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A point of a drive as northbounds show it."""

    name: str
    node: str = ""
    browse: str = ""
    topic: str = ""
    """How it is called outside: see `gateway.mapping.site.Names`. Empty: as its name."""
    group: str
    kind: str
    """`gateway.mapping.profile.Kind` as text: status, measurement, fault, setpoint, switch, ...; or
    `DIAGNOSTIC`."""
    type: ValueType
    rate: str
    """Rate class: fast, normal, slow."""
    unit: str | None = None
    """Symbol, ``Hz``; None for a plain number."""
    low: float | None = None
    high: float | None = None
    """Limits for writing in the unit, the site's narrowing included."""
    values: Mapping[int, str] = {}
    """Names of an enumeration's numbers."""
    readable: bool = True
    writable: bool = False
    """A single write may reach it (it is writable and not by commands only)."""
    role: Role | None = None
    """Least role for writing."""
    step: float | None = None
    """What one count is worth, in the unit."""
    register: str = ""
    """Address as the manual writes it, with the bits if it is a field: ``0020H.0``."""
    help: str = ""
    source: str = ""
    doubt: str = ""


class ArgumentInfo(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An argument of a command; it takes type, unit and limits from a point."""

    name: str
    point: str
    type: ValueType
    unit: str | None = None
    low: float | None = None
    high: float | None = None
    values: Mapping[int, str] = {}


class CommandInfo(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A command of a drive. ``node``, ``browse``, ``topic`` as those of a point."""

    name: str
    node: str = ""
    browse: str = ""
    topic: str = ""
    args: tuple[ArgumentInfo, ...] = ()
    role: Role = Role.OPERATOR
    help: str = ""


class OwnerInfo(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Something that has points: a drive, a line (``_north``), the gateway itself (``_gateway``).

    ``topic`` begins all its topics (``plant7/fan-1``). ``title`` says what it is. The ``commands`` of a line
    are for all its drives at once.
    """

    name: str
    node: str = ""
    browse: str = ""
    topic: str = ""
    title: str
    points: tuple[PointInfo, ...]
    commands: tuple[CommandInfo, ...] = ()


class DriveInfo(OwnerInfo, frozen=True, kw_only=True, omit_defaults=True):
    """A drive with everything that can be browsed. Its points are those of its profile, then what the gateway
    itself tells of it (kind `DIAGNOSTIC`)."""

    line: str
    unit: int
    profile: str
    maker: str
    model: str
    control: ControlInfo = ControlInfo()


class Catalogue(msgspec.Struct, frozen=True, kw_only=True):
    """The whole gateway, for browsing. A new generation replaces it as a whole."""

    site: str
    gateway: str
    version: str
    generation: int
    digest: str
    rates: Mapping[str, float]
    writes_enabled: bool
    drives: tuple[DriveInfo, ...]
    lines: tuple[OwnerInfo, ...] = ()
    own: tuple[OwnerInfo, ...] = ()
    """The gateway itself, if it has points."""

    @property
    def owners(self) -> tuple[OwnerInfo, ...]:
        """Everything that has points: drives, lines, the gateway."""
        return (*self.drives, *self.lines, *self.own)


class Batch(msgspec.Struct, frozen=True, tag="batch"):
    """Samples of watched tags. Samples read in one transaction stay together in one batch, unless the
    watcher fell behind: then it gets the latest sample of each tag and ``skipped`` counts the rest."""

    seq: int
    samples: tuple[Sample, ...]
    skipped: int = 0


class Periods(msgspec.Struct, frozen=True, tag="periods"):
    """The plan changed: from now on these tags are read every so many seconds."""

    periods: Mapping[str, float]


class DriveState(msgspec.Struct, frozen=True, tag="drive"):
    """A drive was found, lost or found again. The first states come right after the watch."""

    drive: str
    up: bool
    time: int
    reason: str = ""


class Happened(msgspec.Struct, frozen=True, tag="event"):
    """An event that happened."""

    event: Event


class Replaced(msgspec.Struct, frozen=True, tag="replaced"):
    """A new configuration is in force: read section and catalogue again."""

    generation: int


Update = Batch | Periods | DriveState | ControlState | Happened | Replaced


class LineHealth(msgspec.Struct, frozen=True, kw_only=True):
    """Counters of one line since start."""

    name: str
    port: str
    up: bool
    reason: str
    requests: int
    answered: int
    refused: int
    timeouts: int
    damaged: int
    """Frames with wrong check bytes, and noise that was skipped."""
    utilisation: float
    """Share of the last ten seconds that the wire was in use, 0 to 1."""


class Alarm(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Something that somebody has to look at. ``subject`` is a drive, a line (``_north``) or the gateway
    itself (``_gateway``); the times are wall-clock nanoseconds, 0 when that has not happened."""

    key: str
    """What it is acknowledged by: ``fan-1.restarted``."""
    subject: str
    name: str
    text: str
    raised: int
    cleared: int = 0
    """When its cause was gone."""
    acknowledged: int = 0
    by: str = ""
    """Who acknowledged it."""

    @property
    def is_over(self) -> bool:
        """Its cause is gone, and somebody has seen it."""
        return bool(self.cleared and self.acknowledged)


class RefusedGap(msgspec.Struct, frozen=True, kw_only=True):
    """Addresses that no point has, across which a drive does not let itself be read, and the exception
    ``code`` with which it says so. ``time`` is when that was found."""

    drive: str
    profile: str
    unit: int
    first: int
    last: int
    code: int
    time: int

    @property
    def text(self) -> str:
        """What was found, and what to do about it."""
        span = f"{self.first:04X}H" if self.first == self.last else f"{self.first:04X}H..{self.last:04X}H"
        return (
            f"{self.drive} refuses reads across {span} with {self.code:02X}H; what stands on both sides is "
            f"read apart (add `{span}` to `holes` in the profile {self.profile})"
        )


class Health(msgspec.Struct, frozen=True, kw_only=True):
    """How the core is doing."""

    started: int
    lines: tuple[LineHealth, ...]
    drives: Mapping[str, bool]
    """Drive name to whether it answers."""
    sessions: tuple[str, ...]
    journal: str = ""
    """Empty when the journal can be written, else why not."""
    alarms: tuple[Alarm, ...] = ()
    """Every alarm that stands, the oldest first."""
    gaps: tuple[RefusedGap, ...] = ()
    """What drives turned out not to let itself be read across."""


class Reading(msgspec.Struct, frozen=True, kw_only=True):
    """One read of the present plan; times are seconds. ``cost`` is what it takes of the wire, ``age`` how
    old a value can get at worst."""

    unit: int
    table: str
    address: int
    count: int
    period: float
    cost: float
    age: float


class Demand(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Who wants a tag how often (seconds), and the read that brings it; None while nobody wants it, or
    where it is read behind a selector."""

    wanted: tuple[tuple[str, float], ...] = ()
    reading: Reading | None = None
    gaps: tuple[RefusedGap, ...] = ()
    """Those at which that read ends, because the drive does not let itself be read across them."""


class Frame(msgspec.Struct, frozen=True, array_like=True):
    """One frame of the wire trace: when its first bit was on the wire (nanoseconds since 1970, exact to the
    microsecond), sent or received, its bytes, and what they were."""

    time: int
    sent: bool
    data: bytes
    note: str = ""


class TracePage(msgspec.Struct, frozen=True, array_like=True):
    """Some frames of a wire trace, oldest first. Frames are numbered from 1; ``first`` is the number of the
    first one here, ``last`` that of the newest that is kept."""

    first: int
    frames: tuple[Frame, ...]
    last: int


class BridgeError(Exception):
    """The core is not reachable, speaks another version, or went away."""


class Bridge(Protocol):
    """One client's view of the core. All methods may raise `BridgeError`."""

    @property
    def section(self) -> Mapping[str, Any]:
        """The validated configuration of this adapter, as plain data; empty for other clients."""
        ...

    @property
    def catalogue(self) -> Catalogue:
        """The present catalogue."""
        ...

    async def watch(self, wants: Mapping[str, float | None]) -> Mapping[str, float]:
        """Add, change (seconds) or withdraw (None) demands; other demands of this client stay.

        Returns the period in seconds that the plan holds for each tag that is now wanted; a tag that
        cannot be read is left out. The present sample of each newly wanted tag follows as a batch.
        """
        ...

    def updates(self) -> AsyncIterator[Update]:
        """What happens from now on, until the bridge is closed. One consumer per client."""
        ...

    async def read(self, tags: Sequence[str], max_age: float = 0.0) -> Sequence[Sample]:
        """One sample per tag, in order: from the store if at most ``max_age`` seconds old, else from
        the drive."""
        ...

    async def write(
        self,
        tag: str,
        value: Value,
        origin: Origin,
        ttl: float = DEFAULT_TTL,
        id: str = "",
        confirm: str = "",
    ) -> Outcome:
        """Write one value (engineering unit; enumerations by number or name) and tell its true outcome.

        ``id`` makes the write at-most-once per ``origin.through``: a second one with the same id gets
        the first one's outcome. ``confirm`` names the harm that the value does, as the profile's ``danger``
        words it; without that it is refused.
        """
        ...

    async def command(
        self,
        drive: str,
        name: str,
        args: Mapping[str, Value],
        origin: Origin,
        ttl: float = DEFAULT_TTL,
        id: str = "",
        confirm: str = "",
    ) -> Outcome:
        """Carry out a command of a drive, or of a line (``_north``) for all its drives; as `write`."""
        ...

    def turned_away(self, what: str, wanted: Any, origin: Origin, outcome: Outcome) -> None:
        """Put on record that an attempt was refused before it reached the core (``what`` as in
        ``fan-1.run_forward``, ``wanted`` as far as it could be read). Returns at once, and never fails."""
        ...

    async def lease(self, drive: str, act: LeaseAct, origin: Origin, whom: str = "") -> Outcome:
        """Acquire, renew, release or take the lease of a drive. ``whom``: take it from him only."""
        ...

    async def gone(self, origin: Origin, may_return: bool) -> Outcome:
        """A client of this adapter is gone: its session ended, and with it all its leases; or its connection
        broke, and it may return within the ttl of each."""
        ...

    async def controls(self) -> Sequence[ControlState]:
        """Who may command each drive now."""
        ...

    async def maintain(self, drive: str, on: bool, origin: Origin, reason: str = "") -> Outcome:
        """Switch a drive into maintenance, in which only a stop is let through, or out of it."""
        ...

    async def health(self) -> Health:
        """How the core is doing, and which alarms stand."""
        ...

    async def acknowledge(self, alarm: str, origin: Origin) -> Outcome:
        """Somebody has seen this alarm (`Alarm.key`); it is gone once its cause is gone too."""
        ...

    async def demand(self, tag: str) -> Demand:
        """Who wants a tag, and how it is read."""
        ...

    async def trace(self, line: str, after: int = 0) -> TracePage:
        """The oldest frames of a line behind number ``after``, as many as go into one page; those that are no
        longer kept are skipped."""
        ...

    async def close(self) -> None:
        """Withdraw all demands and leave."""
        ...
