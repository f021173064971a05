"""A command as a method."""

from __future__ import annotations

from collections.abc import Awaitable, Sequence

from asyncua import ua

from gateway.bridge.api import ArgumentInfo, Bridge, CommandInfo, OwnerInfo
from gateway.northbound.opcua.model import AskCore, MethodNode, Model, variant_type
from gateway.northbound.opcua.names import drive_node, member_node, own, part_of, standard
from gateway.northbound.opcua.nodes import NodeBuilder
from gateway.northbound.opcua.plain import node_id
from gateway.tag import Origin, Outcome, Value, tag_of

OUTPUTS = (
    ("verdict", "confirmed, refused, failed, unknown, expired or superseded"),
    ("reason", "why it is not confirmed; empty when it is"),
)


def add_command(
    nodes: NodeBuilder, model: Model, drive: OwnerInfo, parent: ua.NodeId, command: CommandInfo
) -> ua.NodeId:
    """Add the method of a command below ``parent``; it may be called on that object and on the drive (or
    line)."""
    node = member_node(drive, command)
    nodes.method(node, own(command), parent, command.help)
    if command.args:
        add_arguments(nodes, node, "InputArguments", [input_argument(arg) for arg in command.args])
    add_arguments(nodes, node, "OutputArguments", [argument(*output) for output in OUTPUTS])
    model.methods[node] = MethodNode(
        tag_of(drive.name, command.name),
        command.role,
        (parent, drive_node(drive)),
        tuple(variant_type(arg) for arg in command.args),
        _ask_for(drive.name, command),
        is_command=True,
    )
    return node


def _ask_for(drive: str, command: CommandInfo) -> AskCore:
    names = [arg.name for arg in command.args]

    def ask(bridge: Bridge, values: Sequence[Value], origin: Origin, ttl: float) -> Awaitable[Outcome]:
        return bridge.command(drive, command.name, named(values, names), origin, ttl)

    return ask


def named(values: Sequence[Value], names: Sequence[str] = ()) -> dict[str, Value]:
    """Values by the names of their arguments; what is too much has its number as name."""
    more = (f"argument {number}" for number in range(len(names) + 1, len(values) + 1))
    return dict(zip([*names, *more], values, strict=False))


def input_argument(arg: ArgumentInfo) -> ua.Argument:
    """Name, type and, as description, unit and limits of an argument."""
    return argument(arg.name, _limits(arg), variant_type(arg))


def _limits(arg: ArgumentInfo) -> str:
    if arg.values:
        return ", ".join(f"{number}: {name}" for number, name in sorted(arg.values.items()))
    unit = f" {arg.unit}" if arg.unit else ""
    if arg.low is not None and arg.high is not None:
        return f"{arg.low:g} to {arg.high:g}{unit}"
    return unit.strip()


def argument(name: str, description: str, kind: ua.VariantType = ua.VariantType.String) -> ua.Argument:
    """An argument of a method."""
    return ua.Argument(
        Name=name, DataType=node_id(kind.value), ValueRank=-1, Description=ua.LocalizedText(description)
    )


def add_arguments(nodes: NodeBuilder, method: ua.NodeId, name: str, arguments: list[ua.Argument]) -> None:
    """Add ``InputArguments`` or ``OutputArguments`` to a method."""
    structure = ua.VariantType.ExtensionObject
    nodes.property(part_of(method, name), standard(name), method, arguments, structure, ua.ObjectIds.Argument)
