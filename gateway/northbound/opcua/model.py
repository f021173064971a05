"""What stands behind the nodes: which node shows which tag, which method is which command."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field

from asyncua import ua

from gateway.bridge.api import ArgumentInfo, Bridge, PointInfo
from gateway.northbound.opcua.names import INSTANCE
from gateway.tag import Origin, Outcome, Role, Value, ValueType, split_tag

_INT32 = range(-(2**31), 2**31)
MOST_NAME = 128
"""Characters of a name that is asked for although there is nothing of that name."""


@dataclass(frozen=True, slots=True)
class TagNode:
    """A variable that shows a tag: its value, or (``text``) the name of its enumeration value."""

    tag: str
    point: PointInfo
    kind: ua.VariantType
    text: bool = False


AskCore = Callable[[Bridge, Sequence[Value], Origin, float], Awaitable[Outcome]]
"""How the core is asked for what a method does: given values, who asks, and the time to live in seconds."""


@dataclass(frozen=True, slots=True)
class MethodNode:
    """A method. ``role`` is the least one that may call it, ``objects`` are what it may be called on,
    ``takes`` the types of its arguments (Variant: any). ``is_lock``: it answers a number, as locks do.
    ``is_command``: the core can be asked with wrong arguments too, and says what is wrong."""

    what: str
    role: Role
    objects: tuple[ua.NodeId, ...]
    takes: tuple[ua.VariantType, ...]
    ask: AskCore
    is_lock: bool = False
    is_command: bool = False


@dataclass(slots=True)
class Model:
    """All nodes behind which the core stands."""

    tags: dict[ua.NodeId, TagNode] = field(default_factory=dict)
    nodes: dict[str, list[ua.NodeId]] = field(default_factory=dict)
    """By tag, the nodes that show it."""
    methods: dict[ua.NodeId, MethodNode] = field(default_factory=dict)

    members: dict[str, frozenset[str]] = field(default_factory=dict)
    """By drive, and by line that can be commanded, the names of its points and commands."""

    def missing(self, node: ua.NodeId) -> tuple[str, str] | None:
        """The drive, and the name of what it has not, if a node would be that of a point or command."""
        if node.NamespaceIndex != INSTANCE or not isinstance(node.Identifier, str):
            return None
        drive, name = split_tag(node.Identifier)
        missing = name not in self.members.get(drive, (name,)) and 0 < len(name) <= MOST_NAME
        return (drive, name) if missing else None

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
