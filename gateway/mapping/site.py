"""A site file, resolved: lines, drives and northbound sections, with every default applied.

`model` holds the YAML shape, `load` makes this out of it. Times are seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from gateway.mapping.profile import Pace, Profile, SerialFormat
from gateway.tag import Role

LeaseMode = Literal["session", "required", "off"]

SHORTEST = 0.01
"""Seconds; no tag is read more often."""
SETPOINT = "frequency_command"
"""The point that ``on_expiry: {setpoint: x}`` is about."""


@dataclass(frozen=True, slots=True)
class Control:
    """Who may command a drive and what happens when he goes away."""

    lease: LeaseMode = "session"
    ttl: float = 10.0
    on_expiry: str | None = None
    """``stop``, ``hold`` or ``setpoint: x``; None while nobody chose."""
    setpoint: Fraction | None = None
    """The ``x`` of that, for `SETPOINT`."""
    takeover: Role = Role.ENGINEER
    """Least role that may take the lease away from its holder."""
    on_reappear: Literal["report", "stop"] = "report"
    """What is done about a drive that comes back running although nobody commanded it from here."""


@dataclass(frozen=True, slots=True)
class LossDemand:
    """What the site demands that a drive does when the line dies (H9): ``stop``, at the latest ``within``
    so many seconds; ``keep_running``; or ``any``, which is only shown."""

    action: Literal["stop", "keep_running", "any"]
    within: float | None = None


@dataclass(frozen=True, slots=True)
class Rs485:
    """Options of the transceiver: does it echo what is sent, and does RTS switch its direction."""

    echo: bool = False
    rts: Literal["none", "send_high", "send_low"] = "none"


@dataclass(frozen=True, slots=True)
class Names:
    """How one point or command is called outside: its OPC UA node (the part behind ``s=``), its browse
    name, and the last part of its MQTT topics."""

    node: str
    browse: str
    topic: str


@dataclass(frozen=True, slots=True)
class DriveNames:
    """How a drive and what belongs to it are called outside. ``topic`` begins all topics of the drive:
    ``plant7/fan-1``. ``points`` holds points and commands, which share one name space."""

    node: str
    browse: str
    topic: str
    points: Mapping[str, Names]


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveConfig:
    """A drive: a profile at a unit address on a line. ``profile`` is already specialised: what depends on
    the drive's settings alone (shift, cases, when) is decided."""

    name: str
    line: str
    profile: Profile
    unit: int
    ranges: Mapping[str, tuple[Fraction, Fraction]] = field(default_factory=lambda: MappingProxyType({}))
    """Per point, narrower limits than the profile's, in the point's unit."""
    limits: Mapping[str, Pace] = field(default_factory=lambda: MappingProxyType({}))
    """Per point, a slower pace than the profile's."""
    wear_per_day: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    """Per point whose writes wear it, how many are allowed in a day; others have `Site.wear_per_day`."""
    settings: Mapping[str, Fraction] = field(default_factory=lambda: MappingProxyType({}))
    """Every setting of the profile that has a value here or a default."""
    control: Control = Control()
    comm_loss: LossDemand | None = None
    """None: nobody said; then what the drive does is only shown."""
    ruled_out: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """Points and commands of the profile that the drive's settings leave out, and why."""
    names: DriveNames | None = None
    """None: by the default rule, which `gateway.mapping.naming` states."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LineConfig:
    """One line: a port and how to speak on it.

    ``port`` is a device path, ``tcp://host:port`` (RTU over TCP), ``modbus://host:port`` (Modbus TCP)
    or ``simulated:``; a relative device path is relative to the site file.
    """

    name: str
    port: str
    framing: Literal["rtu", "ascii", "tcp"]
    baud: int
    format: SerialFormat
    rs485: Rs485
    drives: tuple[DriveConfig, ...]
    broadcast: Role | None = None
    """Least role that may command all drives at once; None: nobody may (H18)."""


@dataclass(frozen=True, slots=True)
class StartGroup:
    """Drives of which no two start within ``apart`` seconds."""

    name: str
    drives: tuple[str, ...]
    apart: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """One gateway's whole configuration."""

    site: str
    gateway: str
    path: Path
    """The site file."""
    lines: tuple[LineConfig, ...]
    rates: Mapping[str, float]
    """Rate class to period in seconds; ``fast``, ``normal`` and ``slow`` always exist."""
    writes_enabled: bool
    wear_per_day: int = 10
    """Writes in a day that each point has that wears by them."""
    data: Path
    """Absolute path of the data folder."""
    opcua: Mapping[str, Any] | None
    """The validated section as plain data, for the adapter; None when absent."""
    mqtt: tuple[Mapping[str, Any], ...]
    starts: tuple[StartGroup, ...] = ()
    digest: str
    """SHA-256 over the site file and all profiles it uses, in hex."""

    @property
    def drives(self) -> tuple[DriveConfig, ...]:
        """All drives of all lines, in the order of the file."""
        return tuple(drive for line in self.lines for drive in line.drives)
