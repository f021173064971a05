"""What a scan asks, and what comes back. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from gateway.mapping.profile import Point, Profile, Table
from gateway.mapping.specialise import specialise
from gateway.modbus.pdu import READ_HOLDING, Reply, Request, loop_back, read_registers

NONCE = 0x5AA5
"""What a loop-back has to bring back."""
LOOP_BACK = 0x08


@dataclass(frozen=True, slots=True)
class Ask:
    """A read of ``count`` holding registers from ``address``, or a loop-back (count 0)."""

    address: int
    count: int = 1

    @property
    def request(self) -> Request:
        """As a PDU. There is no other kind: a scan cannot write."""
        return read_registers(self.address, self.count) if self.count else loop_back(NONCE)

    @property
    def function(self) -> int:
        """The function code."""
        return READ_HOLDING if self.count else LOOP_BACK

    def __str__(self) -> str:
        if not self.count:
            return "08H (loop-back)"
        last = f" to {self.address + self.count - 1:04X}H" if self.count > 1 else ""
        return f"{self.address:04X}H{last}"


LOOP = Ask(0, 0)


@dataclass(frozen=True, slots=True)
class Answer:
    """What came back: the reply and after how many seconds it began, or nothing that is one. ``noise``:
    something else came, which was not our own echo."""

    reply: Reply | None
    seconds: float = 0.0
    noise: bool = False


def is_plain(point: Point) -> bool:
    """True for a point that can be read whatever state the drive is in."""
    always = not point.when and not point.select and point.shift is None
    return always and point.access.readable and point.table is Table.HOLDING


def as_delivered(profile: Profile) -> Profile:
    """The profile with its settings at their defaults, or at their lowest value where there is none."""
    settings = {
        name: setting.default if setting.default is not None else setting.low or Fraction(0)
        for name, setting in profile.settings.items()
    }
    return specialise(profile, settings)


def runs(points: Sequence[Point]) -> list[list[Point]]:
    """Points in the order of their addresses, cut where a register between them belongs to none."""
    found: list[list[Point]] = []
    end = -1
    for point in sorted(points, key=lambda point: (point.address, point.words)):
        if not found or point.address > end:
            found.append([])
        found[-1].append(point)
        end = max(end, point.address + point.words)
    return found
