"""The address space: the catalogue as nodes, in the manner of OPC 10000-100 (Devices).

No conformance to that specification is claimed: its nodeset is not loaded, only its shape and its names
are used, so that a later import of it is a change of types and namespaces.
"""

from __future__ import annotations

from collections.abc import Mapping

from asyncua import ua
from asyncua.server.address_space import AddressSpace

from gateway.bridge.api import DIAGNOSTIC, Catalogue, DriveInfo, OwnerInfo
from gateway.northbound.opcua.commands import add_command
from gateway.northbound.opcua.locking import add_administration, add_lock
from gateway.northbound.opcua.model import Model
from gateway.northbound.opcua.names import (
    DEVICE_SET,
    DRIVE_TYPE,
    FUNCTIONAL_GROUP_TYPE,
    GATEWAY,
    drive_node,
    own,
    part_of,
    structural,
)
from gateway.northbound.opcua.nodes import ORGANIZES, NodeBuilder
from gateway.northbound.opcua.plain import node_id
from gateway.northbound.opcua.points import add_point

_OBJECTS = node_id(ua.ObjectIds.ObjectsFolder)


def build_space(space: AddressSpace, catalogue: Catalogue) -> Model:
    """Put all drives of the catalogue into the address space; returns what stands behind the nodes."""
    nodes, model = NodeBuilder(space), Model(members=_members(catalogue))
    _add_types(nodes)
    _add_gateway(nodes, model, catalogue)
    nodes.object(DEVICE_SET, structural("DeviceSet"), _OBJECTS, description="The drives of this gateway.")
    for drive in catalogue.drives:
        _add_drive(nodes, model, drive, writes=catalogue.writes_enabled)
    return model


def _members(catalogue: Catalogue) -> dict[str, frozenset[str]]:
    owners = (*catalogue.drives, *(line for line in catalogue.lines if line.commands))
    return {
        owner.name: frozenset([p.name for p in owner.points] + [c.name for c in owner.commands])
        for owner in owners
    }


def _add_types(nodes: NodeBuilder) -> None:
    nodes.object_type(
        DRIVE_TYPE,
        structural("DriveType"),
        node_id(ua.ObjectIds.BaseObjectType),
        "A variable-frequency drive.",
    )
    nodes.object_type(
        FUNCTIONAL_GROUP_TYPE,
        structural("FunctionalGroupType"),
        node_id(ua.ObjectIds.FolderType),
        "Parameters and methods of a device that belong together.",
    )


def _add_gateway(nodes: NodeBuilder, model: Model, catalogue: Catalogue) -> None:
    nodes.object(GATEWAY, structural("Gateway"), _OBJECTS, description="This gateway.")
    facts = {
        "Site": catalogue.site,
        "Name": catalogue.gateway,
        "SoftwareVersion": catalogue.version,
        "ConfigurationDigest": catalogue.digest,
    }
    _add_texts(nodes, GATEWAY, facts)
    generation = part_of(GATEWAY, "ConfigurationGeneration")
    name = structural("ConfigurationGeneration")
    nodes.property(generation, name, GATEWAY, catalogue.generation, ua.VariantType.UInt32)
    for gateway in catalogue.own:
        _add_own_points(nodes, model, GATEWAY, gateway)
    lines = part_of(GATEWAY, "Lines")
    nodes.object(lines, structural("Lines"), GATEWAY, description="How the lines are doing.")
    for line in catalogue.lines:
        nodes.object(drive_node(line), own(line), lines, description=f"{line.title}.")
        _add_own_points(nodes, model, drive_node(line), line)
        if line.commands:
            _add_methods(nodes, model, line, "What all its drives can be told to do at once.")


def _add_own_points(nodes: NodeBuilder, model: Model, parent: ua.NodeId, owner: OwnerInfo) -> None:
    """What the gateway itself tells of a drive, a line or itself: no register stands behind it."""
    for point in owner.points:
        if point.kind == DIAGNOSTIC:
            add_point(nodes, model, owner, parent, point, writes=False)


def _add_drive(nodes: NodeBuilder, model: Model, drive: DriveInfo, *, writes: bool) -> None:
    node = drive_node(drive)
    nodes.object(
        node,
        own(drive),
        DEVICE_SET,
        type_definition=DRIVE_TYPE,
        description=f"{drive.title}, unit {drive.unit} on line {drive.line}.",
    )
    _add_identification(nodes, node, drive)
    _add_parameters(nodes, model, node, drive, writes=writes)
    _add_methods(nodes, model, drive, "What the drive can be told to do.")
    add_lock(nodes, model, drive)
    add_administration(nodes, model, drive)


def _add_methods(nodes: NodeBuilder, model: Model, owner: OwnerInfo, description: str) -> None:
    node = drive_node(owner)
    methods = part_of(node, "MethodSet")
    nodes.object(methods, structural("MethodSet"), node, description=description)
    for command in owner.commands:
        add_command(nodes, model, owner, methods, command)


def _add_identification(nodes: NodeBuilder, node: ua.NodeId, drive: DriveInfo) -> None:
    facts = {
        "Manufacturer": drive.maker,
        "Model": drive.model,
        "ProductCode": drive.profile,
        "Line": drive.line,
        "UnitAddress": str(drive.unit),
    }
    plate = _add_texts(nodes, node, facts)
    group = part_of(node, "Identification")
    _add_group(nodes, node, group, "Identification", "The nameplate.")
    nodes.link(group, ORGANIZES, plate)


def _add_texts(nodes: NodeBuilder, owner: ua.NodeId, facts: Mapping[str, str]) -> list[ua.NodeId]:
    for name, text in facts.items():
        nodes.property(part_of(owner, name), structural(name), owner, text, ua.VariantType.String)
    return [part_of(owner, name) for name in facts]


def _add_parameters(
    nodes: NodeBuilder, model: Model, node: ua.NodeId, drive: DriveInfo, *, writes: bool
) -> None:
    parameters = part_of(node, "ParameterSet")
    nodes.object(parameters, structural("ParameterSet"), node, description="All values of the drive.")
    groups: dict[str, list[ua.NodeId]] = {}
    for point in (point for point in drive.points if point.kind != DIAGNOSTIC):
        variable = add_point(nodes, model, drive, parameters, point, writes=writes)
        groups.setdefault(point.group, []).append(variable)
    for name, members in groups.items():
        group = part_of(node, f"group/{name}")
        _add_group(nodes, node, group, name, "")
        nodes.link(group, ORGANIZES, members)
    diagnostics = part_of(node, "Diagnostics")
    _add_group(nodes, node, diagnostics, "Diagnostics", "How the gateway gets on with the drive.")
    _add_own_points(nodes, model, diagnostics, drive)


def _add_group(nodes: NodeBuilder, drive: ua.NodeId, group: ua.NodeId, name: str, description: str) -> None:
    nodes.object(
        group, structural(name), drive, type_definition=FUNCTIONAL_GROUP_TYPE, description=description
    )
