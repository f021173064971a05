"""What the settings of one drive do to its profile: addresses, the stop, and the line's death. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction

from gateway.mapping.commands import STOP
from gateway.mapping.finding import Report
from gateway.mapping.node import Path
from gateway.mapping.profile import Point, Profile
from gateway.mapping.specialise import shifted
from gateway.mapping.values import in_words

REGISTER = 16
_LAST = 0xFFFF
Settings = Mapping[str, Fraction]


def fit(profile: Profile, settings: Settings, place: Path, report: Report) -> bool:
    """False, with findings, when the profile's addresses cannot be shifted by these settings."""
    before = len(report.findings)
    for name in dict.fromkeys(point.shift for point in profile.points.values() if point.shift):
        if settings[name].denominator != 1:
            message = f"`{name}` is added to addresses, and {in_words(settings[name])} is no whole number"
            report.error((*place, "settings", name), message, "leave the decimals out")
    if len(report.findings) == before:
        _check_range(profile, settings, place, report)
    return len(report.findings) == before


def _check_range(profile: Profile, settings: Settings, place: Path, report: Report) -> None:
    for point in profile.points.values():
        address = shifted(point.address, point.shift, settings)
        if address < 0 or address + point.words - 1 > _LAST:
            message = f"`{point.shift}` moves `{point.name}` out of 0000H to FFFFH"
            report.error((*place, "settings", str(point.shift)), message, "correct it")


def check_settings(
    drive: str, profile: Profile, special: Profile, settings: Settings, place: Path, report: Report
) -> None:
    """Complain about what the settings of a drive make of its profile. ``special`` is the profile with
    these settings, ``place`` that of the drive."""
    _check_shifted(profile, special, place, report)
    if STOP in profile.commands and STOP not in special.commands:
        message = f"with these settings `{drive}` has no command `{STOP}`"
        report.error((*place, "settings"), message, "correct them", key=True)


def _check_shifted(profile: Profile, special: Profile, place: Path, report: Report) -> None:
    """Points that are shifted must not come to lie on others."""
    taken: dict[tuple[str, int], list[Point]] = {}
    for point in special.points.values():
        rivals = (other for bit in _bits(point) for other in taken.get(bit, ()))
        other = next((o for o in rivals if _meet(point, o) and _moved(profile, point, o)), None)
        if other is not None:
            shift = profile.points[point.name].shift or profile.points[other.name].shift or ""
            message = f"`{shift}` moves `{point.name}` and `{other.name}` to one place, {point.address:04X}H"
            report.error((*place, "settings", shift), message, "correct the setting or the profile", key=True)
        for bit in _bits(point):
            taken.setdefault(bit, []).append(point)


def _bits(point: Point) -> Iterator[tuple[str, int]]:
    first = point.address * REGISTER + point.encoding.bit
    width = point.encoding.width or REGISTER * point.words
    return ((point.table, bit) for bit in range(first, first + width))


def _meet(one: Point, other: Point) -> bool:
    """True unless one of them is only read and the other only written."""
    reads = one.access.readable and other.access.readable
    return reads or (one.access.writable and other.access.writable)


def _moved(profile: Profile, one: Point, other: Point) -> bool:
    """True when a shift brought the two together; what lay together before was judged with the profile."""
    return profile.points[one.name].shift != profile.points[other.name].shift
