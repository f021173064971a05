"""The checks of a site file that go beyond form: do lines, drives, profiles and sections fit."""

from __future__ import annotations

from fractions import Fraction

from gateway.mapping.broadcastcheck import check_line as check_broadcasting
from gateway.mapping.controlcheck import bounds_of, check_control, check_limits, check_starts
from gateway.mapping.finding import Report
from gateway.mapping.lossdemand import judge, settings_of
from gateway.mapping.node import Path
from gateway.mapping.profile import Point
from gateway.mapping.sectioncheck import check_label, check_sections
from gateway.mapping.serialcheck import check_line
from gateway.mapping.shape import closest, nearest
from gateway.mapping.site import SHORTEST, DriveConfig, Site
from gateway.mapping.sitefile import RawSite
from gateway.mapping.sites import RATES
from gateway.mapping.values import in_words
from gateway.mapping.wearcheck import check_wear
from gateway.tag import GATEWAY, own_name

KEEP_RUNNING = "keep_running"
"""The name that profiles give to a comm-loss action that stops nothing."""


def check_site(raw: RawSite, site: Site, report: Report) -> None:
    """Complain about everything in a site that does not fit."""
    _check_rates(raw, report)
    _check_ports(raw, report)
    _check_drive_names(raw, report)
    _check_units(raw, report)
    for line in site.lines:
        check_line(line, raw, report)
        check_broadcasting(line, report)
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
    """A class of its own is good for publish rules only."""
    used = {rule.rate for mqtt in raw.mqtt for rule in mqtt.publish or []}
    for name, seconds in raw.rates.items():
        if seconds <= 0:
            report.error(("rates", name), f"the rate `{name}` is not above zero", "write it like 200ms")
        elif seconds < SHORTEST:
            message = f"nothing is read more often than every {1000 * SHORTEST:g} ms"
            report.warn(("rates", name), message, "write a longer time")
        if name not in RATES and name not in used and not report.lost.use(name) and not report.meant(name):
            meant = closest(name, list(RATES))
            remedy = f"did you mean `{meant}`?" if meant else "leave it out"
            report.warn(("rates", name), f"nothing uses the rate `{name}`", remedy, key=True)


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


def _check_units(raw: RawSite, report: Report) -> None:
    """No two drives of a line may have one address."""
    for name, line in raw.lines.items():
        place: Path = ("lines", name, "drives")
        first: dict[int, str] = {}
        for drive, config in line.drives.items():
            if report.lost.covers((*place, drive, "unit")):
                continue
            if config.unit in first:
                message = f"`{first[config.unit]}` has the unit address {config.unit} already"
                report.error((*place, drive, "unit"), message, "give each drive of a line its own")
            first.setdefault(config.unit, drive)


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
            message = f"`{drive.profile.name}` has no point `{name}`"
            report.unknown_name(place, name, message, remedy, key=True)
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
