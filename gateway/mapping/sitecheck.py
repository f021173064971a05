"""The checks of a site file that go beyond form: do lines, drives, profiles and sections fit."""

from __future__ import annotations

from fractions import Fraction

from gateway.mapping.broadcastcheck import check_line
from gateway.mapping.controlcheck import bounds_of, check_control, check_limits, check_starts
from gateway.mapping.finding import Report
from gateway.mapping.lossdemand import judge, settings_of
from gateway.mapping.node import Path
from gateway.mapping.profile import Point
from gateway.mapping.sectioncheck import check_label, check_sections
from gateway.mapping.shape import nearest
from gateway.mapping.site import DriveConfig, LineConfig, Site
from gateway.mapping.sitefile import RawSite
from gateway.mapping.values import in_words
from gateway.mapping.wearcheck import check_wear
from gateway.tag import GATEWAY, own_name

KEEP_RUNNING = "keep_running"
"""The name that profiles give to a comm-loss action that stops nothing."""
_MESSAGE = 8
"""Characters of the shortest request and, about, of its reply."""
_GAP = 3.5
"""Characters of silence before each message."""


def check_site(raw: RawSite, site: Site, report: Report) -> None:
    """Complain about everything in a site that does not fit."""
    _check_rates(raw, report)
    _check_ports(raw, report)
    _check_drive_names(raw, report)
    for line in site.lines:
        _check_line(line, raw, report)
        check_line(line, report)
    for drive in site.drives:
        _check_comm_loss(drive, report)
        _check_ranges(drive, report)
        check_limits(drive, report)
        check_control(drive, raw, report)
    check_starts(site, report)
    check_wear(site, report)
    check_sections(raw, site, report)


def _place(drive: DriveConfig) -> Path:
    return ("lines", drive.line, "drives", drive.name)


def _check_rates(raw: RawSite, report: Report) -> None:
    for name, seconds in raw.rates.items():
        if seconds <= 0:
            report.error(("rates", name), f"the rate `{name}` is not above zero", "write it like 200ms")


def _check_ports(raw: RawSite, report: Report) -> None:
    """One master per line: no port may stand twice."""
    first: dict[str, str] = {}
    for name, line in raw.lines.items():
        check_label(name, ("lines", name), report)
        if own_name(name) == GATEWAY:
            message = f"tags of the gateway itself begin with `{GATEWAY}`, and those of this line would too"
            report.error(("lines", name), message, "use another name", key=True)
        if line.port in first and line.port != "simulated:":
            report.error(
                ("lines", name, "port"),
                f"line `{first[line.port]}` has this port already",
                "put the drives on that line",
            )
        first.setdefault(line.port, name)


def _check_drive_names(raw: RawSite, report: Report) -> None:
    """Tags begin with the drive's name, so it may stand once in the whole site."""
    first: dict[str, str] = {}
    for line, entry in raw.lines.items():
        for name in entry.drives:
            place = ("lines", line, "drives", name)
            check_label(name, place, report)
            if name in first:
                report.error(
                    place, f"line `{first[name]}` has a drive `{name}` already", "use another name", key=True
                )
            first.setdefault(name, line)


def _check_line(line: LineConfig, raw: RawSite, report: Report) -> None:
    place: Path = ("lines", line.name)
    units: dict[int, str] = {}
    for drive in line.drives:
        _check_unit(drive, units, report)
        if line.framing != "tcp":
            _check_serial(drive, line, raw, report)
    fitting = min((_fitting(line, drive) for drive in line.drives), default=None)
    if fitting is not None and fitting < len(line.drives):
        report.warn(
            place,
            f"{len(line.drives)} drives cannot all be spoken to before the first of them takes the "
            f"line for dead; {fitting} can",
            "raise the speed, or split the line",
            key=True,
        )


def _fitting(line: LineConfig, drive: DriveConfig) -> int:
    """How many shortest exchanges fit into the drive's time-out; no bound if it has none."""
    after = drive.profile.serial.comm_loss.after
    if after is None:
        return len(line.drives)
    characters = 2 * (_MESSAGE + _GAP)
    exchange = characters * line.format.bits_per_character / line.baud + drive.profile.serial.reply_usual
    return int(after / exchange)


def _check_unit(drive: DriveConfig, units: dict[int, str], report: Report) -> None:
    place = (*_place(drive), "unit")
    low, high = drive.profile.serial.units
    if not low <= drive.unit <= high:
        report.error(
            place, f"`{drive.profile.name}` has unit addresses {low} to {high}", "correct the address"
        )
    if drive.unit in units:
        report.error(
            place,
            f"`{units[drive.unit]}` has the unit address {drive.unit} already",
            "give each drive of a line its own",
        )
    units.setdefault(drive.unit, drive.name)


def _check_serial(drive: DriveConfig, line: LineConfig, raw: RawSite, report: Report) -> None:
    """Speed, framing and format must be among those that the drive speaks."""
    facts, name = drive.profile.serial, drive.profile.name
    place = ("lines", line.name, "serial")
    written = raw.lines[line.name]
    formats = facts.rtu if line.framing == "rtu" else facts.ascii
    if not formats:
        message = f"`{name}` does not speak {line.framing}"
        report.error((*_place(drive), "profile"), message, "correct `framing`")
    if facts.rtu and facts.ascii and written.framing is None:
        message = f"`{drive.name}` ({name}) may speak rtu or ascii"
        report.error(("lines", line.name), message, "write `framing`", key=True)
    if written.serial is None:
        return
    if line.baud not in facts.baud:
        message = f"`{drive.name}` ({name}) does not speak {line.baud} bit/s"
        report.error(place, message, f"use one of {', '.join(map(str, facts.baud))}")
    if formats and line.format not in formats:
        message = f"`{drive.name}` ({name}) does not speak {line.format} in {line.framing}"
        report.error(place, message, f"use one of {', '.join(map(str, formats))}")


def _check_comm_loss(drive: DriveConfig, report: Report) -> None:
    """A drive that runs on when the line dies cannot be stopped from here: unless the site demands just
    that, it should know."""
    if drive.comm_loss is not None:
        judgement = judge(drive.profile.serial.comm_loss, drive.comm_loss, settings_of(drive))
        if judgement.met is False:
            message = f"nothing but a stop will be written to `{drive.name}`: {judgement.reason}"
            report.warn(_place(drive), message, "change that on the panel and here, or demand less", key=True)
    elif (text := _runs_on(drive)) is not None:
        message = f"`{drive.name}` keeps running when the line dies{text}"
        report.warn(
            _place(drive), message, "change that on the panel and here, or say comm_loss: any", key=True
        )


def _runs_on(drive: DriveConfig) -> str | None:
    """Why a drive runs on, as far as its settings tell; None if they do not."""
    loss = drive.profile.serial.comm_loss
    if loss.blind:
        return ": its settings tell it not to watch the line"
    action = settings_of(drive)(loss.action or "")
    return "" if action is not None and action.text == KEEP_RUNNING else None


def _check_ranges(drive: DriveConfig, report: Report) -> None:
    for name, (low, high) in drive.ranges.items():
        place = (*_place(drive), "ranges", name)
        point = drive.profile.points.get(name)
        if point is None:
            remedy = nearest(name, [p.name for p in drive.profile.points.values() if p.limits])
            report.error(place, f"`{drive.profile.name}` has no point `{name}`", remedy, key=True)
        elif not point.access.writable:
            report.error(place, f"`{name}` is never written, so it has no range", "leave it out", key=True)
        elif low > high:
            report.error(place, "the range is empty", "put the lower end first")
        else:
            _check_narrower(drive, point, low, high, report)


def _check_narrower(drive: DriveConfig, point: Point, low: Fraction, high: Fraction, report: Report) -> None:
    least, most = bounds_of(drive, point)
    if (least is not None and low < least) or (most is not None and high > most):
        allowed = (
            f"{'any' if least is None else in_words(least)} to {'any' if most is None else in_words(most)}"
        )
        report.error(
            (*_place(drive), "ranges", point.name),
            f"the profile allows {allowed} {point.encoding.symbol or ''}".rstrip(),
            "a site can only narrow a range",
        )
