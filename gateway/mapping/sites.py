"""From the shape of a site file to the resolved site, given the profiles that it names."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any

from gateway.mapping import sitefile
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError, duration, number
from gateway.mapping.node import Path as Place
from gateway.mapping.profile import Pace, Profile, SerialFormat
from gateway.mapping.ruledout import ruled_out
from gateway.mapping.sections import Mqtt, Opcua, Publish
from gateway.mapping.settingcheck import check_settings, fit
from gateway.mapping.shape import closest, nearest
from gateway.mapping.site import Control, DriveConfig, LineConfig, LossDemand, Rs485, Site, StartGroup
from gateway.mapping.sitefile import RawSite
from gateway.mapping.specialise import specialise
from gateway.mapping.values import single_value
from gateway.tag import Role

RATES = {"fast": 0.2, "normal": 1.0, "slow": 30.0}
"""Seconds of the classes that always exist."""
_NETWORK_SPEED = (115200, SerialFormat(8, "N", 1))
"""What planning assumes for Modbus TCP, where nobody tells the speed behind the socket."""


def resolve_site(
    raw: RawSite, path: Path, profiles: Mapping[str, Profile], digest: str, report: Report
) -> Site:
    """The site that a file means. ``path`` is absolute; drives without a profile are left out."""
    folder = path.parent
    data = folder / raw.data
    rates = RATES | raw.rates
    return Site(
        site=raw.site,
        gateway=raw.gateway,
        path=path,
        lines=tuple(_line(name, raw, profiles, folder, report) for name in raw.lines),
        rates=MappingProxyType(rates),
        writes_enabled=raw.writes.enabled,
        wear_per_day=raw.writes.wear_per_day,
        data=data,
        opcua=_opcua(raw.opcua, folder, data) if raw.opcua else None,
        mqtt=tuple(_mqtt(raw, index, folder, data, rates, report) for index in range(len(raw.mqtt))),
        starts=tuple(StartGroup(name, tuple(g.drives), g.apart) for name, g in raw.starts.items()),
        digest=digest,
    )


def _line(
    name: str, site: RawSite, profiles: Mapping[str, Profile], folder: Path, report: Report
) -> LineConfig:
    place: Place = ("lines", name)
    raw = site.lines[name]
    network = raw.port.startswith("modbus://")
    if raw.serial is None and not network and not report.lost.hurts(place):
        report.error(
            place, "`serial` is missing", "write the speed and format, like serial: 9600 8N2", key=True
        )
    if network and raw.framing is not None:
        report.error((*place, "framing"), "`framing` stands beside a modbus:// port", "leave it out")
    baud, form = raw.serial or _NETWORK_SPEED
    drives = (_drive(drive, name, site, profiles, report) for drive in raw.drives)
    return LineConfig(
        name=name,
        port=_port(raw.port, folder),
        framing="tcp" if network else raw.framing or "rtu",
        baud=baud,
        format=form,
        rs485=Rs485(raw.rs485.echo, raw.rs485.rts),
        drives=tuple(drive for drive in drives if drive is not None),
        broadcast=Role(raw.broadcast.role) if raw.broadcast else None,
    )


def _port(text: str, folder: Path) -> str:
    return text if "://" in text or text == sitefile.SIMULATED else str(folder / text)


def _drive(
    name: str, line: str, site: RawSite, profiles: Mapping[str, Profile], report: Report
) -> DriveConfig | None:
    raw = site.lines[line].drives[name]
    profile = profiles.get(raw.profile)
    if profile is None:
        return None
    place: Place = ("lines", line, "drives", name)
    ranges = {point: (ends[0], ends[1]) for point, ends in raw.ranges.items()}
    settings = _settings(raw, profile, (*place, "settings"), report)
    special = _special(name, profile, settings, place, report)
    return DriveConfig(
        name=name,
        line=line,
        profile=special,
        ruled_out=ruled_out(profile, special, settings),
        unit=raw.unit,
        ranges=MappingProxyType(ranges),
        settings=MappingProxyType(settings),
        limits=MappingProxyType({point: _pace(limit) for point, limit in raw.limits.items()}),
        wear_per_day=MappingProxyType(dict(raw.wear_per_day)),
        control=_control(raw.control or sitefile.Control()),
        comm_loss=_loss(raw.comm_loss or site.comm_loss),
    )


def _pace(raw: sitefile.Limit) -> Pace:
    return Pace(raw.step, raw.slew, raw.interval or 0.0)


def _control(raw: sitefile.Control) -> Control:
    action = raw.on_expiry or ""
    setpoint = number(action.removeprefix("setpoint: ")) if action.startswith("setpoint: ") else None
    return Control(raw.lease, raw.ttl, raw.on_expiry, setpoint, Role(raw.takeover), raw.on_reappear)


def _loss(raw: sitefile.LossDemand | None) -> LossDemand | None:
    return None if raw is None else LossDemand(raw.action, raw.within)


def _special(
    drive: str, profile: Profile, settings: Mapping[str, Fraction], place: Place, report: Report
) -> Profile:
    """The profile as the drive's settings have it; as it stands where they cannot be applied."""
    if not settings.keys() >= profile.settings.keys() or not fit(profile, settings, place, report):
        return profile
    special = specialise(profile, settings)
    check_settings(drive, profile, special, settings, place, report)
    return special


def _settings(raw: sitefile.Drive, profile: Profile, place: Place, report: Report) -> dict[str, Fraction]:
    """Every setting of the profile that has a value here or a default."""
    values: dict[str, Fraction] = {}
    unknown = raw.settings.keys() - profile.settings.keys()
    meant = {closest(name, list(profile.settings)) for name in unknown}
    for name, setting in profile.settings.items():
        text = raw.settings.get(name)
        if text is not None:
            try:
                values[name] = single_value(text, setting)
            except FormError as error:
                report.error((*place, name), error.message, error.remedy)
        elif setting.default is not None:
            values[name] = setting.default
        elif name not in meant and not report.lost.inside((*place, name)):
            message = f"the setting `{name}` of `{profile.name}` has no default"
            report.error(place, message, "give its value under `settings`", key=True)
    for name in unknown:
        message = f"`{profile.name}` has no setting `{name}`"
        report.unknown_name((*place, name), name, message, nearest(name, list(profile.settings)), key=True)
    return values


def _opcua(raw: Opcua, folder: Path, data: Path) -> Mapping[str, Any]:
    return {
        "endpoint": raw.endpoint,
        "security": list(raw.security),
        "anonymous": raw.anonymous == "read",
        "users_file": str(folder / raw.users_file if raw.users_file else data / "users.yaml"),
        "certificates": str(folder / raw.certificates if raw.certificates else data / "certificates"),
    }


def broker_name(raw: Mqtt, index: int) -> str:
    """The name of a broker section: its own, else mqtt, mqtt-2, ..."""
    return raw.name or ("mqtt" if index == 0 else f"mqtt-{index + 1}")


def _mqtt(
    site: RawSite, index: int, folder: Path, data: Path, rates: Mapping[str, float], report: Report
) -> Mapping[str, Any]:
    raw = site.mqtt[index]
    name = broker_name(raw, index)
    rules = [
        _publish(rule, rates, ("mqtt", index, "publish", i), report)
        for i, rule in enumerate(raw.publish or [])
    ]
    return {
        "name": name,
        "broker": raw.broker,
        "user": raw.user,
        "password_file": _beside(raw.password_file, folder),
        "ca_file": _beside(raw.ca_file, folder),
        "client_id": raw.client_id or f"{site.site}-{site.gateway}-{name}",
        "commands": {"role": raw.commands.role} if raw.commands else None,
        "publish": None if raw.publish is None else rules,
        "data": str(data / name),
    }


def _beside(text: str | None, folder: Path) -> str | None:
    return str(folder / text) if text is not None else None


def _publish(raw: Publish, rates: Mapping[str, float], place: Place, report: Report) -> dict[str, Any]:
    rate = rates.get(raw.rate, 0.0)
    if raw.rate not in rates:
        try:
            rate = duration(raw.rate)
        except FormError:
            meant, known = closest(raw.rate, list(rates)), ", ".join(rates)
            report.unknown_name(
                (*place, "rate"),
                raw.rate,
                f"`{raw.rate}` is neither a rate of this site nor a time",
                f"did you mean `{meant}`?" if meant else f"use one of {known}, or a time like 500ms",
            )
    return {
        "points": list(raw.points),
        "rate": rate,
        "deadband": None if raw.deadband is None else float(raw.deadband),
        "max_silence": raw.max_silence,
    }
