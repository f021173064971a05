"""What stands behind the nodes: which node shows which tag, which method is which command."""

from __future__ import annotations

from dataclasses import dataclass, field

from asyncua import ua

from gateway.bridge.api import ArgumentInfo, CommandInfo, PointInfo
from gateway.tag import ValueType

_INT32 = range(-(2**31), 2**31)


@dataclass(frozen=True, slots=True)
class TagNode:
    """A variable that shows a tag: its value, or (``text``) the name of its enumeration value."""

    tag: str
    point: PointInfo
    kind: ua.VariantType
    text: bool = False


@dataclass(frozen=True, slots=True)
class MethodNode:
    """A method that carries out a command. ``objects`` are the objects it may be called on."""

    drive: str
    command: CommandInfo
    objects: tuple[ua.NodeId, ...]


@dataclass(slots=True)
class Model:
    """All nodes behind which the core stands."""

    tags: dict[ua.NodeId, TagNode] = field(default_factory=dict)
    nodes: dict[str, list[ua.NodeId]] = field(default_factory=dict)
    """By tag, the nodes that show it."""
    methods: dict[ua.NodeId, MethodNode] = field(default_factory=dict)

    def add(self, node: ua.NodeId, shown: TagNode) -> None:
        """The node shows a tag."""
        self.tags[node] = shown
        self.nodes.setdefault(shown.tag, []).append(node)


def variant_type(of: PointInfo | ArgumentInfo) -> ua.VariantType:
    """The data type of a point or argument.

    Plain integers are Int64, since the catalogue does not tell how many bits they have; numbers of an
    enumeration fit Int32, which more clients handle well.
    """
    if of.type is ValueType.INTEGER and of.values and all(number in _INT32 for number in of.values):
        return ua.VariantType.Int32
    return {
        ValueType.BOOLEAN: ua.VariantType.Boolean,
        ValueType.INTEGER: ua.VariantType.Int64,
        ValueType.NUMBER: ua.VariantType.Double,
        ValueType.TEXT: ua.VariantType.String,
    }[of.type]
