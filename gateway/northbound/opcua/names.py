"""Namespaces and NodeIds: the names that clients store in their projects."""

from __future__ import annotations

from asyncua import ua

from gateway.northbound.opcua.plain import node_id

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


def node_of(name: str) -> ua.NodeId:
    """NodeId of a drive (``fan-1``), a tag or a command (``fan-1.output_frequency``, ``fan-1.stop``)."""
    return node_id(name, INSTANCE)


def part_of(owner: ua.NodeId, part: str) -> ua.NodeId:
    """NodeId of something that belongs to a node: ``fan-1/ParameterSet``. No drive or point holds a slash."""
    return node_id(f"{owner.Identifier!s}/{part}", owner.NamespaceIndex)


def own(name: str) -> ua.QualifiedName:
    """Browse name of a drive, point or command."""
    return ua.QualifiedName(name, INSTANCE)


def structural(name: str) -> ua.QualifiedName:
    """Browse name of a part of the structure: ``ParameterSet``."""
    return ua.QualifiedName(name, TYPES)


def standard(name: str) -> ua.QualifiedName:
    """Browse name that OPC UA itself gives: ``EURange``."""
    return ua.QualifiedName(name, 0)
