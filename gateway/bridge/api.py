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
from gateway.bridge.report import Alarm as Alarm  # noqa: PLC0414
from gateway.bridge.report import Demand as Demand  # noqa: PLC0414
from gateway.bridge.report import Diagnosis as Diagnosis  # noqa: PLC0414
from gateway.bridge.report import Frame as Frame  # noqa: PLC0414
from gateway.bridge.report import Health as Health  # noqa: PLC0414
from gateway.bridge.report import LineHealth as LineHealth  # noqa: PLC0414
from gateway.bridge.report import Reading as Reading  # noqa: PLC0414
from gateway.bridge.report import RefusedGap as RefusedGap  # noqa: PLC0414
from gateway.bridge.report import TracePage as TracePage  # noqa: PLC0414
from gateway.tag import Event, Origin, Outcome, Role, Sample, Value, ValueType

API_VERSION = 3
"""Raised at each change that an adapter of another version could misunderstand."""

DEFAULT_TTL = 5.0
"""Seconds that a write or command may wait for its first byte on the wire."""
TOO_LATE = "its time to live had ended when it arrived"
"""Why a write or command is expired that came too late, in the words of every protocol."""


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
