"""Plain facts of a drive model: the addresses of its manual, its serial line, and which requests it takes.
Times are seconds. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from gateway.mapping.condition import UNSTATED, Condition, Provenance


class Table(StrEnum):
    """The four Modbus tables."""

    HOLDING = "holding"
    INPUT = "input"
    COIL = "coil"
    DISCRETE = "discrete"


@dataclass(frozen=True, slots=True)
class Notation:
    """How the manual writes addresses: each part of the pattern counts its weight, ``add`` comes on top."""

    pattern: str
    weights: Mapping[str, int]
    add: int
    table: Table
    example: str
    provenance: Provenance = UNSTATED


@dataclass(frozen=True, slots=True)
class SerialFormat:
    """Data bits, parity (``N``, ``E`` or ``O``) and stop bits."""

    data_bits: int
    parity: Literal["N", "E", "O"]
    stop_bits: int

    @property
    def bits_per_character(self) -> int:
        """Start bit, data bits, parity bit and stop bits."""
        return 1 + self.data_bits + (self.parity != "N") + self.stop_bits

    def __str__(self) -> str:
        return f"{self.data_bits}{self.parity}{self.stop_bits}"


@dataclass(frozen=True, slots=True)
class CommLoss:
    """What the drive does when the line dies: after how many seconds of silence, and the name of the
    point or setting that tells the action. None: not known. It does so only while ``when`` holds."""

    after: float | None = None
    action: str | None = None
    when: Condition = ()
    stops_when: Condition | None = None
    """The motor stops then while this holds, and runs on while it does not; None: not known."""
    after_from: str | None = None
    """The point or setting that holds the time instead of ``after``."""
    blind: bool = False
    """The drive's settings tell it not to watch the line at all."""

    @property
    def names(self) -> tuple[str, ...]:
        """The points and settings that decide what happens."""
        terms = [term.name for term in (*self.when, *(self.stops_when or ()))]
        return tuple(dict.fromkeys(name for name in (self.action, self.after_from, *terms) if name))


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialFacts:
    """What the drive's serial interface can do. Lists have the factory setting first."""

    baud: tuple[int, ...]
    rtu: tuple[SerialFormat, ...] = ()
    ascii: tuple[SerialFormat, ...] = ()
    units: tuple[int, int] = (1, 247)
    gap: float = 0.0
    """Least silence between frames in seconds, beside 3.5 characters; the longer counts."""
    reply_usual: float = 0.01
    """Usual seconds from the end of a request to the first character of the reply."""
    reply_max: float = 1.0
    """Seconds after which there is no reply any more."""
    pause_read: float = 0.0
    pause_write: float = 0.0
    pause_broadcast: float = 0.1
    """Seconds of silence to keep after a read, a write, a broadcast, beside the gap."""
    comm_loss: CommLoss = CommLoss()


@dataclass(frozen=True, slots=True, kw_only=True)
class ModbusFacts:
    """Which requests the drive takes."""

    functions: tuple[int, ...] = (0x03, 0x06, 0x10)
    write_one: int = 0x06
    """Function for writing one register."""
    read_max: int = 125
    write_max: int = 123
    bridge: bool = False
    """True when a read may pass over addresses that no point names."""
    holes: tuple[tuple[int, int], ...] = ()
    """Closed address ranges that no read may touch, even with ``bridge``."""
    probe: str = ""
    """``loop_back``, or the name of the point that is the cheapest question."""
    error_functions: tuple[int, ...] = ()
    """Function bytes that also mean an error reply, beside function + 80H."""
    identity: Condition = ()
    """What the drive shows if it is of this model; empty: it shows nothing that would tell."""
