"""A point as a variable of OPC 10000-8 (Data Access)."""

from __future__ import annotations

import math
from typing import Any

from asyncua import ua

from gateway.bridge.api import OwnerInfo, PointInfo
from gateway.northbound.opcua.model import Model, TagNode, variant_type
from gateway.northbound.opcua.names import member_node, own, part_of, standard
from gateway.northbound.opcua.nodes import READ, WRITE, NodeBuilder, Shape
from gateway.northbound.opcua.plain import node_id
from gateway.northbound.opcua.status import bad_value
from gateway.northbound.opcua.units import engineering_units
from gateway.tag import ValueType, tag_of


def add_point(
    nodes: NodeBuilder, model: Model, drive: OwnerInfo, parent: ua.NodeId, point: PointInfo, *, writes: bool
) -> ua.NodeId:
    """Add the variable of a point, with its properties; ``writes``: the site lets anything be written."""
    tag = tag_of(drive.name, point.name)
    node, kind = member_node(drive, point), variant_type(point)
    shape = Shape(
        node_id(kind.value),
        node_id(type_definition(point)),
        _access(point, writes),
        describe(point.help, point.source, point.doubt),
    )
    nodes.variable(node, own(point), parent, shape, bad_value(ua.StatusCodes.BadWaitingForInitialData))
    model.add(node, TagNode(tag, point, kind))
    _add_properties(nodes, node, point)
    if point.values:
        _add_value_as_text(nodes, model, node, TagNode(tag, point, ua.VariantType.LocalizedText, text=True))
    return node


def type_definition(point: PointInfo) -> int:
    """The Data Access type that says most about a point."""
    if point.values:
        return ua.ObjectIds.MultiStateValueDiscreteType
    if point.type is ValueType.BOOLEAN:
        return ua.ObjectIds.TwoStateDiscreteType
    if point.type is ValueType.TEXT:
        return ua.ObjectIds.DataItemType
    if _has_range(point):
        return ua.ObjectIds.AnalogItemType if point.unit is None else ua.ObjectIds.AnalogUnitRangeType
    return ua.ObjectIds.DataItemType if point.unit is None else ua.ObjectIds.AnalogUnitType


def describe(help: str, source: str = "", doubt: str = "") -> str:
    """Help, origin and doubt as one text."""
    parts = [help, f"Source: {source}." if source else "", f"Doubt: {doubt}." if doubt else ""]
    return " ".join(part for part in parts if part)


def _access(point: PointInfo, writes: bool) -> int:
    return (READ if point.readable else 0) | (WRITE if point.writable and writes else 0)


def _has_range(point: PointInfo) -> bool:
    return point.low is not None and point.high is not None


def _add_properties(nodes: NodeBuilder, node: ua.NodeId, point: PointInfo) -> None:
    def put(name: str, value: Any, kind: ua.VariantType, data_type: int | None = None) -> None:
        nodes.property(part_of(node, name), standard(name), node, value, kind, data_type)

    if point.register:
        put("Definition", f"register {point.register}", ua.VariantType.String)
    if point.values:
        put("EnumValues", enum_values(point), ua.VariantType.ExtensionObject, ua.ObjectIds.EnumValueType)
    elif point.type is ValueType.BOOLEAN:
        put("TrueState", ua.LocalizedText("true"), ua.VariantType.LocalizedText)
        put("FalseState", ua.LocalizedText("false"), ua.VariantType.LocalizedText)
    elif point.type is not ValueType.TEXT:
        _add_analog_properties(put, point)


def _add_analog_properties(put: Any, point: PointInfo) -> None:
    structure = ua.VariantType.ExtensionObject
    if _has_range(point):
        put("EURange", ua.Range(Low=point.low, High=point.high), structure, ua.ObjectIds.Range)
    if point.unit is not None:
        put("EngineeringUnits", engineering_units(point.unit), structure, ua.ObjectIds.EUInformation)
    if point.type is ValueType.NUMBER and point.step:
        put("ValuePrecision", decimals(point.step), ua.VariantType.Double)


def decimals(step: float) -> float:
    """Digits behind the decimal point that one count is worth (OPC 10000-8 section 5.3.1)."""
    return float(max(0, math.ceil(-math.log10(step) - 1e-9)))


def enum_values(point: PointInfo) -> list[ua.EnumValueType]:
    """The numbers and names of an enumeration, in the order of the numbers."""
    return [
        ua.EnumValueType(Value=number, DisplayName=ua.LocalizedText(name))
        for number, name in sorted(point.values.items())
    ]


def _add_value_as_text(nodes: NodeBuilder, model: Model, parent: ua.NodeId, shown: TagNode) -> None:
    node = part_of(parent, "ValueAsText")
    nodes.property(node, standard("ValueAsText"), parent, ua.LocalizedText(""), ua.VariantType.LocalizedText)
    nodes.set_value(node, bad_value(ua.StatusCodes.BadWaitingForInitialData))
    model.add(node, shown)
