"""What can be wrong with a line, as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType


class Illness(StrEnum):
    """The diagnoses, worst first."""

    PORT_DOWN = "port_down"
    """The port is not open."""
    WRONG_FORMAT = "wrong_format"
    """Everybody answers garbage: another speed, parity, number of bits or framing."""
    ALL_SILENT = "all_silent"
    """Nothing comes back from anybody."""
    ECHO_MISSING = "echo_missing"
    """The site declares an echo, and there is none."""
    FOREIGN_MASTER = "foreign_master"
    """Somebody else asks on this line."""
    TWO_DRIVES = "two_drives"
    """Two drives seem to have one address."""
    LATE_ANSWERS = "late_answers"
    """A drive answers, but later than its profile says."""
    DRIVE_SILENT = "drive_silent"
    """Some drives do not answer, others do."""
    NOISE = "noise"
    """Frames come damaged now and then."""
    LATENCY_TIMER = "latency_timer"
    """The adapter hands over what it received every 16 ms only."""
    ECHO_UNDECLARED = "echo_undeclared"
    """What is sent comes back, and the site does not say so."""


@dataclass(frozen=True, slots=True)
class Finding:
    """An illness, the units that it concerns (none: the line), and what speaks for it, in numbers."""

    illness: Illness
    units: tuple[int, ...] = ()
    evidence: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
