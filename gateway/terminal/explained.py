"""Everything there is to know of one tag: where it comes from, how it is read, who gets it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from gateway.bridge.api import CommandInfo, Demand, DriveInfo, PointInfo, Reading
from gateway.mapping.profile import Command, Point, Profile
from gateway.mapping.site import DriveConfig, Site
from gateway.terminal.losing import loss_text
from gateway.terminal.output import gap_object
from gateway.terminal.points import point_object
from gateway.terminal.profiles import command_object
from gateway.terminal.sheet import command_text, doubt_text, notes, place_text, source_text

INSTANCE = 2
"""Index of the OPC UA namespace that holds a site's drives; see gateway/northbound/opcua/names.py."""


@dataclass(frozen=True, slots=True)
class Explained:
    """A point or command of a site, under the names it has inside and outside.

    ``demand`` is that of the running gateway, or of a plan for everything monitored when ``running`` is
    False.
    """

    site: Site
    config: DriveConfig
    drive: DriveInfo
    info: PointInfo | CommandInfo
    demand: Demand
    running: bool

    @property
    def tag(self) -> str:
        """``fan-1.output_frequency``."""
        return f"{self.config.name}.{self.info.name}"

    @property
    def profile(self) -> Profile:
        """The drive's profile, as its settings make it."""
        return self.config.profile

    @property
    def subject(self) -> Point | Command:
        """What the profile says of it."""
        name = self.info.name
        return self.profile.points.get(name) or self.profile.commands[name]

    @property
    def node(self) -> str:
        """NodeId on the OPC UA server."""
        return node_text(self.info.node or self.tag)

    def topic(self, kind: str) -> str:
        """An MQTT topic of it: ``state``, ``cmd``."""
        base = self.drive.topic or f"{self.site.site}/{self.config.name}"
        return f"{base}/{kind}/{self.info.topic or self.info.name}"

    @property
    def is_shown(self) -> bool:
        """It has a value that can be read."""
        return isinstance(self.info, PointInfo) and self.info.readable

    @property
    def takes_writes(self) -> bool:
        """A client may write it, or run it."""
        return isinstance(self.info, CommandInfo) or self.info.writable


def node_text(name: str) -> str:
    """A node of the site on the OPC UA server."""
    return f"ns={INSTANCE};s={name}"


def explained_object(found: Explained) -> dict[str, Any]:
    """For programs; the shape stands in docs/cli.md."""
    subject = found.subject
    points = found.profile.points
    about = point_object(subject) if isinstance(subject, Point) else command_object(subject, points)
    document = found.profile.documents.get(subject.provenance.document)
    return {
        "tag": found.tag,
        "line": found.config.line,
        "unit_address": found.config.unit,
        "profile": found.profile.name,
        "document": document.title if document else None,
        "section": subject.provenance.place,
        **about,
        **_reading_object(found.demand.reading),
        "gaps": [gap_object(gap) for gap in found.demand.gaps],
        "running": found.running,
        "wanted": [{"who": who, "period": period} for who, period in found.demand.wanted],
        "node": found.node,
        "browse": found.info.browse or found.info.name,
        "topic": found.topic("state") if found.is_shown else None,
        "command_topic": found.topic("cmd") if found.takes_writes else None,
    }


def explained_lines(found: Explained) -> Iterator[str]:
    """For people: a headline, then one fact a line."""
    yield f"{found.tag}: {found.subject.help}".rstrip(": ")
    for title, text in _facts(found):
        yield f"  {title:9} {text}"


def _facts(found: Explained) -> Iterator[tuple[str, str]]:
    subject = found.subject
    yield "document", source_text(subject.provenance, found.profile.documents)
    if doubt := doubt_text(subject.provenance):
        yield "doubt", doubt
    if isinstance(subject, Point):
        yield from _point_facts(found, subject)
    else:
        yield from (("command", line) for line in command_text(subject, found.profile.points))
    yield "OPC UA", f"{found.node}, browse name {found.info.browse or found.info.name}"
    topics = [found.topic("state")] if found.is_shown else []
    yield "MQTT", ", ".join([*topics, found.topic("cmd")] if found.takes_writes else topics)


def _point_facts(found: Explained, point: Point) -> Iterator[tuple[str, str]]:
    yield "register", f"{place_text(point)} ({point.table}), unit {found.config.unit} on {found.config.line}"
    encoding = point.encoding
    symbol = f", {encoding.scale} {encoding.symbol} a count" if encoding.symbol and not point.cases else ""
    yield (
        "value",
        f"{encoding.type}{symbol}"
        if not encoding.width
        else f"{encoding.width} bit{'s' if encoding.width > 1 else ''}{symbol}",
    )
    if point.limits and isinstance(found.info, PointInfo):
        yield "range", f"{found.info.low}..{found.info.high} {encoding.symbol or ''}".rstrip()
    for text in notes(point, doubts=False):
        yield "note", text
    if point.name in found.profile.serial.comm_loss.names:
        yield "line dies", f"decides what {found.config.name} does then: {loss_text(found.config)}"
    yield (
        "access",
        f"{point.access}, rate {point.rate}" + (f", written by {point.role}" if point.role else ""),
    )
    yield "read", _reading_text(found)
    yield from (("gap", gap.text) for gap in found.demand.gaps)
    yield "wanted by", wanted_text(found.demand, found.running)


def _reading_object(reading: Reading | None) -> dict[str, Any]:
    if reading is None:
        return {"block": None, "period": None, "age": None}
    last = reading.address + reading.count - 1
    block = {"first": f"{reading.address:04X}H", "last": f"{last:04X}H", "cost": reading.cost}
    return {"block": block, "period": reading.period, "age": reading.age}


def _reading_text(found: Explained) -> str:
    reading = found.demand.reading
    planned = "" if found.running else " (planned)"
    if reading is None:
        return f"not at present{planned}"
    last = reading.address + reading.count - 1
    return (
        f"with {reading.address:04X}H-{last:04X}H every {reading.period:g} s, which takes "
        f"{reading.cost * 1000:.1f} ms; oldest value {reading.age:.2f} s{planned}"
    )


def wanted_text(demand: Demand, running: bool) -> str:
    """Who wants a tag, and how often."""
    if not running:
        return "nobody: no gateway is running"
    return ", ".join(f"{who} every {period:g} s" for who, period in demand.wanted) or "nobody"
