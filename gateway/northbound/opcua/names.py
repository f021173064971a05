"""Namespaces and NodeIds: the names that clients store in their projects."""

from __future__ import annotations

from asyncua import ua

from gateway.bridge.api import CommandInfo, OwnerInfo, PointInfo
from gateway.northbound.opcua.plain import node_id
from gateway.tag import tag_of

INSTANCE = 2
"""Index of ``urn:gateway:<site>``; promised to clients, never another."""
TYPES = 3
"""Index of ``urn:gateway:drives``."""
TYPES_URI = "urn:gateway:drives"

DEVICE_SET = node_id("DeviceSet", TYPES)
DRIVE_TYPE = node_id("DriveType", TYPES)
FUNCTIONAL_GROUP_TYPE = node_id("FunctionalGroupType", TYPES)
GATEWAY = node_id("Gateway", TYPES)


def instance_uri(site: str) -> str:
    """URI of the namespace that holds a site's drives."""
    return f"urn:gateway:{site}"


def application_uri(site: str, gateway: str) -> str:
    """The ApplicationUri of one gateway."""
    return f"urn:gateway:{site}:{gateway}"


def drive_node(drive: OwnerInfo) -> ua.NodeId:
    """NodeId of a drive or line: what the site calls it, else its name."""
    return node_id(drive.node or drive.name, INSTANCE)


def member_node(drive: OwnerInfo, member: PointInfo | CommandInfo) -> ua.NodeId:
    """NodeId of a point or command: what the site calls it, else ``<drive>.<point>``."""
    return node_id(member.node or tag_of(drive.name, member.name), INSTANCE)


def part_of(owner: ua.NodeId, part: str) -> ua.NodeId:
    """NodeId of something that belongs to a node: ``fan-1/ParameterSet``."""
    return node_id(f"{owner.Identifier!s}/{part}", owner.NamespaceIndex)


def own(named: OwnerInfo | PointInfo | CommandInfo) -> ua.QualifiedName:
    """Browse name of a drive, line, point or command."""
    return ua.QualifiedName(named.browse or named.name, INSTANCE)


def structural(name: str) -> ua.QualifiedName:
    """Browse name of a part of the structure: ``ParameterSet``."""
    return ua.QualifiedName(name, TYPES)


def standard(name: str) -> ua.QualifiedName:
    """Browse name that OPC UA itself gives: ``EURange``."""
    return ua.QualifiedName(name, 0)
