"""A catalogue whose site calls its drive and some of what belongs to it otherwise."""

from __future__ import annotations

from typing import TypeVar

import msgspec

from gateway.bridge.api import Catalogue, CommandInfo, PointInfo
from tests.fakes import small_catalogue

Member = TypeVar("Member", PointInfo, CommandInfo)

NAMES = {
    "output_frequency": {"node": "F1:speed", "browse": "Speed", "topic": "speed/hz"},
    "frequency_command": {"node": "F1:set", "browse": "SpeedSetpoint", "topic": "speed/set"},
    "stop": {"node": "F1:halt", "browse": "Halt", "topic": "halt"},
}


def named_catalogue() -> Catalogue:
    """`small_catalogue` with `NAMES`; the drive is ``Hall2.Fan`` in OPC UA and ``hall2/fan`` in MQTT."""
    catalogue = small_catalogue()
    (fan,) = catalogue.drives
    renamed = msgspec.structs.replace(
        fan,
        node="Hall2.Fan",
        browse="Fan",
        topic="hall2/fan",
        points=tuple(_named(point) for point in fan.points),
        commands=tuple(_named(command) for command in fan.commands),
    )
    return msgspec.structs.replace(catalogue, drives=(renamed,))


def _named(member: Member) -> Member:
    return msgspec.structs.replace(member, **NAMES.get(member.name, {}))
