"""A command as a method."""

from __future__ import annotations

from asyncua import ua

from gateway.bridge.api import ArgumentInfo, CommandInfo, DriveInfo
from gateway.northbound.opcua.model import MethodNode, Model, variant_type
from gateway.northbound.opcua.names import drive_node, member_node, own, part_of, standard
from gateway.northbound.opcua.nodes import NodeBuilder
from gateway.northbound.opcua.plain import node_id

OUTPUTS = (
    ("verdict", "confirmed, refused, failed, unknown, expired or superseded"),
    ("reason", "why it is not confirmed; empty when it is"),
)


def add_command(
    nodes: NodeBuilder, model: Model, drive: DriveInfo, parent: ua.NodeId, command: CommandInfo
) -> ua.NodeId:
    """Add the method of a command below ``parent``; it may be called on that object and on the drive."""
    node = member_node(drive, command)
    nodes.method(node, own(command), parent, command.help)
    if command.args:
        _add_arguments(nodes, node, "InputArguments", [input_argument(arg) for arg in command.args])
    _add_arguments(nodes, node, "OutputArguments", [_output_argument(*output) for output in OUTPUTS])
    model.methods[node] = MethodNode(drive.name, command, (parent, drive_node(drive)))
    return node


def input_argument(arg: ArgumentInfo) -> ua.Argument:
    """Name, type and, as description, unit and limits of an argument."""
    return _argument(arg.name, variant_type(arg), _limits(arg))


def _limits(arg: ArgumentInfo) -> str:
    if arg.values:
        return ", ".join(f"{number}: {name}" for number, name in sorted(arg.values.items()))
    unit = f" {arg.unit}" if arg.unit else ""
    if arg.low is not None and arg.high is not None:
        return f"{arg.low:g} to {arg.high:g}{unit}"
    return unit.strip()


def _output_argument(name: str, description: str) -> ua.Argument:
    return _argument(name, ua.VariantType.String, description)


def _argument(name: str, kind: ua.VariantType, description: str) -> ua.Argument:
    return ua.Argument(
        Name=name, DataType=node_id(kind.value), ValueRank=-1, Description=ua.LocalizedText(description)
    )


def _add_arguments(nodes: NodeBuilder, method: ua.NodeId, name: str, arguments: list[ua.Argument]) -> None:
    structure = ua.VariantType.ExtensionObject
    nodes.property(part_of(method, name), standard(name), method, arguments, structure, ua.ObjectIds.Argument)
