"""The checks of a site file's northbound sections: open to whom, and do their rules mean anything."""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatchcase

from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.node import Path
from gateway.mapping.own import OF_A_LINE, OF_THE_GATEWAY, of_a_drive
from gateway.mapping.sections import Mqtt, is_loopback
from gateway.mapping.shape import closest
from gateway.mapping.site import Site
from gateway.mapping.sitefile import RawSite, label
from gateway.mapping.sites import broker_name
from gateway.tag import GATEWAY, means, own_name, split_tag, tag_of

_DRIVE = 4
"""Length of the way to a drive: lines, line, drives, drive."""


def check_sections(raw: RawSite, site: Site, report: Report) -> None:
    """Complain about everything in the northbound sections that does not fit."""
    _check_opcua(raw, report)
    _check_brokers(raw, report)
    _check_rules(raw, site, report)
    if raw.web is not None:
        report.warn(("web",), "the web page is not served by this version", "leave `web` out", key=True)


def check_label(name: str, place: Path, report: Report) -> None:
    """Complain about a name that can be no topic level."""
    try:
        label(name)
    except FormError as error:
        report.error(place, error.message, error.remedy, key=True)


def _check_opcua(raw: RawSite, report: Report) -> None:
    """Open to the network and open to everybody do not go together."""
    opcua = raw.opcua
    if opcua is None or is_loopback(opcua.endpoint):
        return
    if "none" in opcua.security:
        report.error(
            ("opcua", "security"),
            "security `none` on an address that others can reach",
            "leave `none` out, or use 127.0.0.1",
        )
    if opcua.anonymous != "off":
        report.error(
            ("opcua", "anonymous"),
            "anonymous reading on an address that others can reach",
            "write `off`, or use 127.0.0.1",
        )


def _check_brokers(raw: RawSite, report: Report) -> None:
    names: set[str] = set()
    for index, mqtt in enumerate(raw.mqtt):
        place: Path = ("mqtt", index)
        name = broker_name(mqtt, index)
        check_label(name, (*place, "name"), report)
        if name in names:
            report.error((*place, "name"), f"another broker is named `{name}`", "use another name")
        names.add(name)
        _check_client(mqtt, place, raw, report)
        if mqtt.password_file and not mqtt.user:
            report.error((*place, "password_file"), "a password without a `user`", "add `user`", key=True)
        if not is_loopback(mqtt.broker):
            _check_network(mqtt, place, report)


def _check_client(mqtt: Mqtt, place: Path, raw: RawSite, report: Report) -> None:
    """A broker throws out the first of two clients with one id."""
    first = next(other for other in raw.mqtt if other.client_id == mqtt.client_id)
    if mqtt.client_id is not None and first is not mqtt and first.broker == mqtt.broker:
        message = f"another client of this broker has the id `{mqtt.client_id}`"
        report.error((*place, "client_id"), message, "use another id")


def _check_network(mqtt: Mqtt, place: Path, report: Report) -> None:
    """Who may use a broker that others can reach, and who may listen."""
    if mqtt.user is None:
        remedy = "add `user` and `password_file`, or use 127.0.0.1"
        report.error((*place, "broker"), "a broker on the network without a `user`", remedy)
    elif mqtt.broker.startswith(("mqtt://", "ws://")):
        message = "passwords and commands can be read on the way to this broker"
        report.warn((*place, "broker"), message, "use mqtts://")


def _check_rules(raw: RawSite, site: Site, report: Report) -> None:
    """Every pattern of a publish rule must mean at least one point."""
    if _lines_lost(report):
        return
    there = {drive.name for drive in site.drives}
    unread = {name for line in raw.lines.values() for name in line.drives} - there
    tags = list(_tags(site))
    for place, pattern in _patterns(raw):
        drive, dot, point = pattern.partition(".")
        hidden = any(not dot or fnmatchcase(name, drive) for name in unread)
        known = not dot or any(fnmatchcase(name, drive) for name in there)
        if hidden or (known and report.lost.fitting(point or drive)):
            continue
        if not any(means(pattern, tag) for tag in tags):
            report.error(place, f"no point of any drive is named `{pattern}`", _meant(pattern, tags))


def _lines_lost(report: Report) -> bool:
    """True when drives were left out, of which nobody knows which points they have."""
    places = [path[2:3] for path in report.lost.paths if path[:1] == ("lines",) and len(path) <= _DRIVE]
    return any(place in ((), ("drives",)) for place in places)


def _meant(pattern: str, tags: list[str]) -> str:
    """The nearest spelling of a pattern that means something; what stands before a star at its end counts."""
    known = tags if "." in pattern else sorted({split_tag(tag)[1] for tag in tags})
    start = pattern.removesuffix("*")
    star = pattern[len(start) :]
    match = closest(start, sorted({name[: len(start)] for name in known}) if star else known)
    return f"did you mean `{match}{star}`?" if match else "correct the pattern"


def _patterns(raw: RawSite) -> Iterator[tuple[Path, str]]:
    for index, mqtt in enumerate(raw.mqtt):
        for number, rule in enumerate(mqtt.publish or []):
            for position, pattern in enumerate(rule.points):
                yield ("mqtt", index, "publish", number, "points", position), pattern


def _tags(site: Site) -> Iterator[str]:
    for drive in site.drives:
        yield from (tag_of(drive.name, name) for name in (*drive.profile.points, *of_a_drive(drive.profile)))
    for line in site.lines:
        yield from (tag_of(own_name(line.name), name) for name in OF_A_LINE)
    yield from (tag_of(GATEWAY, name) for name in OF_THE_GATEWAY)
