"""How a drive says that it has no such register, and how registers are told apart then. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from gateway.core.drive import Drive
from gateway.mapping.profile import Point, Profile

ILLEGAL_ADDRESS = 0x02
"""Exception code of the standard (application protocol V1.1b3, section 7)."""
ILLEGAL_ADDRESS_NAME = "illegal_address"
"""What profiles call it, whatever number their drives give it."""


def address_codes(profile: Profile) -> Collection[int]:
    """The exception codes by which a drive says that it has no such register."""
    named = {code for code, error in profile.errors.items() if error.name == ILLEGAL_ADDRESS_NAME}
    return named if ILLEGAL_ADDRESS in profile.errors else named | {ILLEGAL_ADDRESS}


def refusal(drive: Drive, code: int) -> str:
    """``the drive answers 02H illegal_address``: why a point has no value."""
    meaning = drive.profile.errors.get(code)
    return f"the drive answers {code:02X}H" + (f" {meaning.name}" if meaning else "")


def apart(points: Iterable[Point]) -> list[list[Point]]:
    """The points by registers that can be read by themselves: those that share some stay together."""
    found: list[list[Point]] = []
    end = -1
    for point in sorted(points, key=lambda point: (point.address, point.words)):
        if found and point.address < end:
            found[-1].append(point)
        else:
            found.append([point])
        end = max(end, point.address + point.words)
    return found
