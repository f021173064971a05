"""The site as clients may browse it. Pure."""

from __future__ import annotations

from fractions import Fraction

import msgspec

from gateway.bridge.api import (
    ArgumentInfo,
    Catalogue,
    CommandInfo,
    ControlInfo,
    DriveInfo,
    OwnerInfo,
    PointInfo,
)
from gateway.core.broadcasting import everybody
from gateway.core.drive import Drive
from gateway.core.meaning import is_fixed
from gateway.core.own import OwnTags
from gateway.mapping.profile import Command, Point, Provenance
from gateway.mapping.site import LineConfig, Site
from gateway.tag import GATEWAY, ValueType, own_name, tag_of


def catalogue_of(site: Site, drives: list[Drive], own: OwnTags, version: str, generation: int) -> Catalogue:
    """The catalogue of a site."""
    return Catalogue(
        site=site.site,
        gateway=site.gateway,
        version=version,
        generation=generation,
        digest=site.digest,
        rates=dict(site.rates),
        writes_enabled=site.writes_enabled,
        drives=tuple(_drive_info(drive, own) for drive in drives),
        lines=tuple(_line_info(site, line, everybody(line, _on(drives, line)), own) for line in site.lines),
        own=(_gateway_info(site, own),),
    )


def _on(drives: list[Drive], line: LineConfig) -> list[Drive]:
    return [drive for drive in drives if drive.line == line.name]


def _line_info(site: Site, line: LineConfig, all_: Drive | None, own: OwnTags) -> OwnerInfo:
    name = own_name(line.name)
    return OwnerInfo(
        name=name,
        browse=line.name,
        topic=f"{site.site}/{GATEWAY}/{site.gateway}/lines/{line.name}",
        title=f"Line {line.name} at {line.port}",
        points=own.infos(name),
        commands=tuple(_command_info(all_, command) for command in all_.profile.commands.values())
        if all_
        else (),
    )


def _gateway_info(site: Site, own: OwnTags) -> OwnerInfo:
    topic = f"{site.site}/{GATEWAY}/{site.gateway}"
    return OwnerInfo(name=GATEWAY, topic=topic, title="This gateway", points=own.infos(GATEWAY))


def _own_points(drive: Drive, own: OwnTags) -> tuple[PointInfo, ...]:
    """What the gateway tells of a drive, beside its node and in its topics."""
    names = drive.config.names
    node = names.node if names else drive.name
    return tuple(
        msgspec.structs.replace(info, node=tag_of(node, info.name)) for info in own.infos(drive.name)
    )


def _drive_info(drive: Drive, own: OwnTags) -> DriveInfo:
    profile = drive.profile
    return DriveInfo(
        name=drive.name,
        node=drive.config.names.node if drive.config.names else "",
        browse=drive.config.names.browse if drive.config.names else "",
        topic=drive.config.names.topic if drive.config.names else "",
        line=drive.line,
        unit=drive.unit,
        profile=profile.name,
        title=profile.title,
        maker=profile.maker,
        model=", ".join(profile.models),
        points=(
            *(_point_info(drive, point) for point in profile.points.values()),
            *_own_points(drive, own),
        ),
        commands=tuple(_command_info(drive, command) for command in profile.commands.values()),
        control=_control_info(drive),
    )


def _control_info(drive: Drive) -> ControlInfo:
    control = drive.config.control
    return ControlInfo(
        lease=control.lease, ttl=control.ttl, on_expiry=control.on_expiry or "", takeover=control.takeover
    )


def _point_info(drive: Drive, point: Point) -> PointInfo:
    low, high = _limits(drive, point)
    encoding = point.encoding
    return PointInfo(
        name=point.name,
        **_names(drive, point.name),
        group=point.group,
        kind=point.kind.value,
        type=encoding.value_type,
        rate=point.rate,
        unit=encoding.symbol,
        low=low,
        high=high,
        values=dict(encoding.values),
        readable=point.access.readable,
        writable=point.access.writable and not point.by_command_only,
        role=point.role,
        step=_step(drive, point),
        register=register_text(point),
        help=point.help,
        source=_source(point.provenance),
        doubt=_doubt(point.provenance),
    )


def _step(drive: Drive, point: Point) -> float | None:
    """What one count is worth, where that is the same in every state of the drive."""
    encoding = point.encoding
    if encoding.value_type is not ValueType.NUMBER or not is_fixed(drive, point):
        return None
    times = Fraction(1) if encoding.times is None else drive.config.settings[encoding.times]
    return float(encoding.scale * times)


def _names(drive: Drive, name: str) -> dict[str, str]:
    """How a point or command is called outside."""
    names = drive.config.names.points.get(name) if drive.config.names else None
    return {} if names is None else {"node": names.node, "browse": names.browse, "topic": names.topic}


def _command_info(drive: Drive, command: Command) -> CommandInfo:
    return CommandInfo(
        name=command.name,
        **_names(drive, command.name),
        args=tuple(_argument_info(drive, name, point) for name, point in command.args.items()),
        role=command.role,
        help=command.help,
    )


def _argument_info(drive: Drive, name: str, point_name: str) -> ArgumentInfo:
    point = drive.profile.points[point_name]
    low, high = _limits(drive, point)
    return ArgumentInfo(
        name=name,
        point=point_name,
        type=point.encoding.value_type,
        unit=point.encoding.symbol,
        low=low,
        high=high,
        values=dict(point.encoding.values),
    )


def _limits(drive: Drive, point: Point) -> tuple[float | None, float | None]:
    """The range for writing, as far as it is the same in every state of the drive."""
    known = point.limits
    for bound in (known.low, known.high) if known else ():
        if isinstance(bound, str) and bound not in drive.config.settings:
            known = None
    limits = drive.limits(point, known)
    return (None, None) if limits is None else (float(limits[0]), float(limits[1]))


def register_text(point: Point) -> str:
    """A point's place as the manual writes it: ``0024H``, ``Cn-02``, ``0020H.3``, ``0107H.2-3``."""
    place = point.notation or f"{point.address:04X}H"
    first, width = point.encoding.bit, point.encoding.width
    if not width:
        return place
    return f"{place}.{first}" if width == 1 else f"{place}.{first}-{first + width - 1}"


def _source(provenance: Provenance) -> str:
    return f"{provenance.document} {provenance.place}".strip()


def _doubt(provenance: Provenance) -> str:
    similar = "similar model, unverified" if provenance.similar else ""
    return "; ".join(text for text in (similar, provenance.doubt or "") if text)
