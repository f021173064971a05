"""Nodes put straight into asyncua's address space.

Its own ``add_nodes`` scans all children of the parent for each new child, so that adding is quadratic,
and gives each node its own copy of attributes that never differ. A drive has hundreds of variables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

from asyncua import ua
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from gateway.northbound.opcua.plain import node_id
from gateway.northbound.opcua.settings import SettingsError

HAS_COMPONENT = node_id(ua.ObjectIds.HasComponent)
HAS_PROPERTY = node_id(ua.ObjectIds.HasProperty)
ORGANIZES = node_id(ua.ObjectIds.Organizes)
_HAS_SUBTYPE = node_id(ua.ObjectIds.HasSubtype)
_HAS_TYPE_DEFINITION = node_id(ua.ObjectIds.HasTypeDefinition)
_BASE_OBJECT_TYPE = node_id(ua.ObjectIds.BaseObjectType)
_PROPERTY_TYPE = node_id(ua.ObjectIds.PropertyType)

READ = 1 << ua.AccessLevel.CurrentRead
WRITE = 1 << ua.AccessLevel.CurrentWrite

_INDETERMINATE = -1.0
"""MinimumSamplingInterval of a server that cannot promise one (OPC 10000-3 section 5.6.2)."""


def _constant(value: object, kind: ua.VariantType) -> AttributeValue:
    return AttributeValue(ua.DataValue(ua.Variant(value, kind)))


_NODE_CLASS = {node_class: _constant(node_class, ua.VariantType.Int32) for node_class in ua.NodeClass}
_WRITE_MASK = _constant(0, ua.VariantType.UInt32)
_NO_EVENTS = _constant(0, ua.VariantType.Byte)
_ACCESS = {level: _constant(level, ua.VariantType.Byte) for level in (0, READ, WRITE, READ | WRITE)}
_SCALAR = _constant(ua.ValueRank.Scalar, ua.VariantType.Int32)
_ARRAY = _constant(ua.ValueRank.OneDimension, ua.VariantType.Int32)
_FALSE = _constant(False, ua.VariantType.Boolean)
_TRUE = _constant(True, ua.VariantType.Boolean)
_SAMPLING = _constant(_INDETERMINATE, ua.VariantType.Double)


@dataclass(frozen=True, slots=True)
class Shape:
    """What a variable can hold and who may do what; ``access`` is made of `READ` and `WRITE`."""

    data_type: ua.NodeId
    type_definition: ua.NodeId
    access: int = READ
    description: str = ""


class NodeBuilder:
    """Adds nodes. Every node hangs below a parent that is there already.

    Raises:
        SettingsError: by each method that adds a node, if there is one of the same NodeId.
    """

    def __init__(self, space: AddressSpace) -> None:
        self._space = space

    def object(
        self,
        node: ua.NodeId,
        name: ua.QualifiedName,
        parent: ua.NodeId,
        *,
        reference: ua.NodeId = HAS_COMPONENT,
        type_definition: ua.NodeId = _BASE_OBJECT_TYPE,
        description: str = "",
    ) -> None:
        """An object."""
        data = self._node(node, name, ua.NodeClass.Object, description)
        data.attributes[ua.AttributeIds.EventNotifier] = _NO_EVENTS
        self._place(data, parent, reference, type_definition)

    def object_type(
        self, node: ua.NodeId, name: ua.QualifiedName, supertype: ua.NodeId, description: str
    ) -> None:
        """A concrete object type below another."""
        data = self._node(node, name, ua.NodeClass.ObjectType, description)
        data.attributes[ua.AttributeIds.IsAbstract] = _FALSE
        self._place(data, supertype, _HAS_SUBTYPE, None)

    def variable(
        self,
        node: ua.NodeId,
        name: ua.QualifiedName,
        parent: ua.NodeId,
        shape: Shape,
        value: ua.DataValue,
        reference: ua.NodeId = HAS_COMPONENT,
    ) -> None:
        """A scalar variable with its first value."""
        data = self._node(node, name, ua.NodeClass.Variable, shape.description)
        data.attributes |= {
            ua.AttributeIds.Value: AttributeValue(value),
            ua.AttributeIds.DataType: _constant(shape.data_type, ua.VariantType.NodeId),
            ua.AttributeIds.ValueRank: _SCALAR,
            ua.AttributeIds.AccessLevel: _ACCESS[shape.access],
            ua.AttributeIds.UserAccessLevel: _ACCESS[shape.access],
            ua.AttributeIds.MinimumSamplingInterval: _SAMPLING,
            ua.AttributeIds.Historizing: _FALSE,
        }
        self._place(data, parent, reference, shape.type_definition)

    def property(
        self,
        node: ua.NodeId,
        name: ua.QualifiedName,
        parent: ua.NodeId,
        value: Any,
        kind: ua.VariantType,
        data_type: int | None = None,
    ) -> None:
        """A read-only property with a constant value. ``data_type`` tells which structure it holds."""
        shape = Shape(node_id(kind.value if data_type is None else data_type), _PROPERTY_TYPE)
        variant = ua.Variant(value, kind, is_array=isinstance(value, list))
        self.variable(node, name, parent, shape, ua.DataValue(variant), HAS_PROPERTY)
        if isinstance(value, list):
            self._space[node].attributes[ua.AttributeIds.ValueRank] = _ARRAY

    def method(self, node: ua.NodeId, name: ua.QualifiedName, parent: ua.NodeId, description: str) -> None:
        """A method that may be called."""
        data = self._node(node, name, ua.NodeClass.Method, description)
        data.attributes |= {ua.AttributeIds.Executable: _TRUE, ua.AttributeIds.UserExecutable: _TRUE}
        self._place(data, parent, HAS_COMPONENT, None)

    def set_value(self, node: ua.NodeId, value: ua.DataValue) -> None:
        """Give a variable another first value."""
        self._space[node].attributes[ua.AttributeIds.Value] = AttributeValue(value)

    def link(self, source: ua.NodeId, reference: ua.NodeId, targets: Sequence[ua.NodeId]) -> None:
        """Further references, seen from both ends."""
        for target in targets:
            self._refer(self._space[source], reference, self._space[target], forward=True)
            self._refer(self._space[target], reference, self._space[source], forward=False)

    def _node(self, node: ua.NodeId, name: ua.QualifiedName, node_class: ua.NodeClass, text: str) -> NodeData:
        if node in self._space:
            taken = node.to_string()
            raise SettingsError(f"two nodes would be {taken} (give one another name in the site file)")
        data = NodeData(node)
        data.attributes = {
            ua.AttributeIds.NodeId: _constant(node, ua.VariantType.NodeId),
            ua.AttributeIds.NodeClass: _NODE_CLASS[node_class],
            ua.AttributeIds.BrowseName: _constant(name, ua.VariantType.QualifiedName),
            ua.AttributeIds.DisplayName: _constant(ua.LocalizedText(name.Name), ua.VariantType.LocalizedText),
            ua.AttributeIds.Description: _constant(ua.LocalizedText(text), ua.VariantType.LocalizedText),
            ua.AttributeIds.WriteMask: _WRITE_MASK,
            ua.AttributeIds.UserWriteMask: _WRITE_MASK,
        }
        return data

    def _place(
        self, data: NodeData, parent: ua.NodeId, reference: ua.NodeId, definition: ua.NodeId | None
    ) -> None:
        self._space[data.nodeid] = data
        if definition is not None:
            self._refer(data, _HAS_TYPE_DEFINITION, self._space[definition], forward=True)
        self.link(parent, reference, [data.nodeid])

    def _refer(self, source: NodeData, reference: ua.NodeId, target: NodeData, *, forward: bool) -> None:
        source.references.append(
            ua.ReferenceDescription(
                ReferenceTypeId=reference,
                IsForward=forward,
                NodeId=target.nodeid,
                BrowseName=_attribute(target, ua.AttributeIds.BrowseName),
                DisplayName=_attribute(target, ua.AttributeIds.DisplayName),
                NodeClass=ua.NodeClass(_attribute(target, ua.AttributeIds.NodeClass)),
                TypeDefinition=_definition_of(target),
            )
        )


def _attribute(node: NodeData, attribute: ua.AttributeIds) -> Any:
    value = node.attributes[attribute].value
    if value is None or value.Value is None:
        raise ValueError(f"{node.nodeid.to_string()} has no {attribute.name}")
    return value.Value.Value


def _definition_of(node: NodeData) -> ua.NodeId:
    for reference in node.references:
        if reference.ReferenceTypeId == _HAS_TYPE_DEFINITION and reference.IsForward:
            return cast("ua.NodeId", reference.NodeId)
    return ua.NodeId()
