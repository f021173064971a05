"""What the simulator knows about a drive beside its profile: the resolved section ``simulate``.

These are assumptions of ours for a believable twin, not facts about the drive. Nothing but the simulator
looks at them. Frequencies are in Hz, times in seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from gateway.mapping.condition import Bound, Condition, Constant

Reaction = Literal["decelerate", "coast", "decelerate_fast", "keep_running"]
"""What a drive can do on a fault."""

SHOWN = (
    "running",
    "running_forward",
    "running_reverse",
    "ready",
    "fault",
    "warning",
    "zero_speed",
    "speed_agree",
    "frequency_reference",
    "output_frequency",
    "output_current",
    "output_voltage",
    "output_power",
    "dc_bus_voltage",
    "communication_lost",
    "requests",
    "unit",
    "baud",
    "delete_errors",
    "reset_input",
    "refused_locked",
    "refused_illegal_address",
    "refused_illegal_value",
    "crc_error",
    "length_error",
    "timeout_error",
)
"""What a simulated drive can show of itself. A point of the same name shows it by itself."""


def _nothing() -> Mapping[Any, Any]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Lock:
    """While ``when`` holds, writes of ``what`` (points and groups; empty: everything) are refused with
    ``reason``. The points that ``when`` names stay open, so that the lock can be taken away."""

    when: Condition
    what: tuple[str, ...] = ()
    reason: str = "locked"


@dataclass(frozen=True, slots=True)
class External:
    """An external fault: the fault that it trips, the point that demands it (None: only a broadcast can),
    the point or setting that tells the action."""

    trips: str
    by: str | None = None
    action: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulate:
    """Facts for the simulated twin; every one has a default, so that any profile can be simulated."""

    factory: Mapping[int, int] = field(default_factory=_nothing)
    """Raw register contents at delivery, by wire address; these registers exist. 0 elsewhere."""
    units: Mapping[str, tuple[Fraction, str]] = field(default_factory=_nothing)
    """Point to the scale and symbol that the twin assumes, where the document gives none."""
    max_frequency: Bound | None = None
    """Highest frequency that a write may ask for; 100 % of broadcasts. None: what the site's setting of
    that name says, else 60 Hz."""
    base_frequency: Bound | None = None
    """What the ramp times count to from standstill; None: the highest frequency."""
    acceleration: Bound = Fraction(3)
    deceleration: Bound = Fraction(3)
    fast_deceleration: Bound = Fraction(1)
    run_when: Condition = ()
    """The run command comes from the line; otherwise from the panel."""
    frequency_when: Condition = ()
    """The frequency comes from the line; otherwise from ``panel_frequency``, else it is 0."""
    panel_frequency: str | None = None
    panel_frequency_when: Condition = ()
    coast_when: Condition = ()
    """A stop coasts; never, when empty."""
    forward_only_when: Condition = ()
    """Reverse is forbidden: the motor stands still; never, when empty."""
    initialise_when: Condition = ()
    """A write that makes this true brings the factory contents back; never, when empty."""
    shows: Mapping[str, tuple[str, ...]] = field(default_factory=_nothing)
    """Point to what it shows: one of `SHOWN`, or another point. Several are bits, the first is bit 0."""
    codes: Mapping[str, Mapping[int, int]] = field(default_factory=_nothing)
    """Point to the raw value that stands for each shown number."""
    history: tuple[str, ...] = ()
    """Points that hold the codes of the last faults, the latest first."""
    alarms: Mapping[str, int] = field(default_factory=_nothing)
    """Fault to its code in the history; a fault that is not listed counts its bit plus one. Faults that
    are no points of the profile are declared by this, and so is ``communication``."""
    external_fault: External | None = None
    reset: str | None = None
    """Point whose rising edge resets the faults."""
    reset_when: Condition = ()
    """Neither it nor a broadcast resets them otherwise."""
    actions: Mapping[str, Reaction] = field(default_factory=_nothing)
    """What the named values of an action mean."""
    comm_timeout: float | None = None
    """Seconds of silence after which the line counts as lost, where the profile does not tell."""
    locks: tuple[Lock, ...] = ()
    refuses: Mapping[str, str] = field(default_factory=_nothing)
    """Reason that the drive gives for ``read_only`` and ``locked`` writes; ``locked`` for both by default."""
    activates: str | None = None
    """Point whose write makes written parameters effective (those that the profile ends with ``then``)."""
    stores: str | None = None
    """Point whose write does so and keeps them for good."""
    saving: float = 0.2
    """Seconds that storing takes; the drive refuses writes as busy meanwhile."""
    restarts: Mapping[str, Constant] = field(default_factory=_nothing)
    """Written values that restart the drive."""
    restart_time: float = 1.0
    """Seconds until it answers again."""
