"""Does a line speak as its drives do: addresses, speed, framing, format?"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from gateway.mapping.device import SerialFacts
from gateway.mapping.finding import Report
from gateway.mapping.node import Path
from gateway.mapping.site import DriveConfig, LineConfig
from gateway.mapping.sitefile import RawSite


def check_line(line: LineConfig, raw: RawSite, report: Report) -> None:
    """Complain about everything on a line that its drives do not speak, once for all drives alike."""
    place: Path = ("lines", line.name)
    if not line.drives:
        if not raw.lines[line.name].drives and not report.lost.inside(place):
            report.warn(
                place, f"line `{line.name}` has no drives", "add one, or leave the line out", key=True
            )
        return
    for drive in line.drives:
        _check_unit(drive, report)
    if line.framing != "tcp" and not report.lost.inside((*place, "framing")):
        _check_framing(line, raw, report)
        if raw.lines[line.name].serial is not None:
            _check_serial(line, raw, report)


def _check_unit(drive: DriveConfig, report: Report) -> None:
    low, high = drive.profile.serial.units
    if not low <= drive.unit <= high:
        place = ("lines", drive.line, "drives", drive.name, "unit")
        message = f"`{drive.profile.name}` has unit addresses {low} to {high}"
        report.error(place, message, "correct the address")


def _check_framing(line: LineConfig, raw: RawSite, report: Report) -> None:
    """The framing must be written where it could be either, and be one that every drive speaks."""
    place: Path = ("lines", line.name)
    written = raw.lines[line.name].framing is not None
    unsure = [d for d in line.drives if d.profile.serial.rtu and d.profile.serial.ascii]
    if unsure and not written:
        report.error(place, f"{_who(unsure)} may speak rtu or ascii", "write `framing`", key=True)
    mute = [d for d in line.drives if not _formats(line, d) and not report.lost.name(line.framing)]
    if mute and written:
        remedy = f"write {_common(mute, _framings) or 'another framing, or use another line'}"
        report.error((*place, "framing"), f"{_who(mute)} {_do(mute)} not speak {line.framing}", remedy)
    elif mute:
        message = f"{_who(mute)} {_do(mute)} not speak rtu"
        report.error(place, message, "add framing: ascii", key=True)


def _check_serial(line: LineConfig, raw: RawSite, report: Report) -> None:
    """Speed and format must be among those that every drive speaks."""
    place: Path = ("lines", line.name, "serial")
    mute = [d for d in line.drives if d.profile.serial.baud and line.baud not in d.profile.serial.baud]
    if mute:
        remedy = _use(_common(line.drives, lambda serial: map(str, serial.baud)), "speed")
        report.error(place, f"{_who(mute)} {_do(mute)} not speak {line.baud} bit/s", remedy)
    mute = [d for d in line.drives if (formats := _formats(line, d)) and line.format not in formats]
    if raw.lines[line.name].framing is None:  # of those that may speak either, that is told already
        mute = [d for d in mute if not (d.profile.serial.rtu and d.profile.serial.ascii)]
    if mute:
        remedy = _use(_common(line.drives, lambda serial: map(str, _of(serial, line))), "format")
        message = f"{_who(mute)} {_do(mute)} not speak {line.format} in {line.framing}"
        report.error(place, message, remedy)


def _formats(line: LineConfig, drive: DriveConfig) -> tuple[object, ...]:
    return _of(drive.profile.serial, line)


def _of(serial: SerialFacts, line: LineConfig) -> tuple[object, ...]:
    """The formats of a drive in the framing of its line."""
    return serial.ascii if line.framing == "ascii" else serial.rtu


def _framings(serial: SerialFacts) -> Iterable[str]:
    return [name for name, formats in (("rtu", serial.rtu), ("ascii", serial.ascii)) if formats]


def _common(drives: Iterable[DriveConfig], spoken: Callable[[SerialFacts], Iterable[str]]) -> str:
    """What all drives speak, in the order of the first; empty where they have nothing in common. Drives of
    which nothing is known are not asked."""
    known = [list(found) for drive in drives if (found := list(spoken(drive.profile.serial)))]
    return ", ".join(word for word in known[0] if all(word in other for other in known[1:])) if known else ""


def _use(common: str, what: str) -> str:
    return f"use one of {common}" if common else f"they have no {what} in common: use two lines"


def _who(drives: list[DriveConfig]) -> str:
    """Drives with their profiles: `` `fan-1`, `fan-2` (s2000)``."""
    profiles = dict.fromkeys(drive.profile.name for drive in drives)
    named = (
        ", ".join(f"`{d.name}`" for d in drives if d.profile.name == name) + f" ({name})" for name in profiles
    )
    return ", ".join(named)


def _do(drives: list[DriveConfig]) -> str:
    return "does" if len(drives) == 1 else "do"
