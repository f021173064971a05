"""What there is to know of a tag that the gateway tells by itself: no register stands behind it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from gateway.bridge.api import Demand, OwnerInfo, PointInfo
from gateway.tag import tag_of
from gateway.terminal.explained import node_text, wanted_text


@dataclass(frozen=True, slots=True)
class ExplainedOwn:
    """A point that the gateway adds to a drive, a line or itself."""

    owner: OwnerInfo
    info: PointInfo
    demand: Demand
    running: bool

    @property
    def tag(self) -> str:
        """``_north.utilisation``."""
        return tag_of(self.owner.name, self.info.name)

    @property
    def node(self) -> str:
        """NodeId on the OPC UA server."""
        return node_text(self.info.node or self.tag)

    @property
    def topic(self) -> str:
        """Where a publish rule that names it puts it."""
        return f"{self.owner.topic}/state/{self.info.name}"


def explained_object(found: ExplainedOwn) -> dict[str, Any]:
    """For programs; the shape stands in docs/cli.md."""
    info = found.info
    return {
        "tag": found.tag,
        "name": info.name,
        "kind": info.kind,
        "value_type": info.type,
        "unit": info.unit,
        "values": info.values,
        "help": info.help,
        "running": found.running,
        "wanted": [{"who": who, "period": period} for who, period in found.demand.wanted],
        "node": found.node,
        "browse": info.browse or info.name,
        "topic": found.topic,
    }


def explained_lines(found: ExplainedOwn) -> Iterator[str]:
    """For people: a headline, then one fact a line."""
    yield f"{found.tag}: {found.info.help}"
    yield f"  {'origin':9} the gateway itself; no register stands behind it ({found.owner.title})"
    yield f"  {'value':9} {found.info.type}" + (f" in {found.info.unit}" if found.info.unit else "")
    yield f"  {'wanted by':9} {wanted_text(found.demand, found.running)}"
    yield f"  {'OPC UA':9} {found.node}, browse name {found.info.browse or found.info.name}"
    yield f"  {'MQTT':9} {found.topic}, where a publish rule names it"
