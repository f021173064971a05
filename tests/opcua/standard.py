"""OPC UA's own nodes, built once per test process: building takes more than a second of processor time."""

from __future__ import annotations

from typing import Any

import pytest
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData
from asyncua.server.standard_address_space import standard_address_space

_build = standard_address_space.fill_address_space
_built: dict[Any, NodeData] = {}


def reuse(patch: pytest.MonkeyPatch) -> None:
    """From now on servers get copies of the nodes that asyncua itself made the first time."""
    patch.setattr(standard_address_space, "fill_address_space", _fill)


def _fill(service: Any) -> None:
    space: AddressSpace = service._aspace
    if not _built:
        _build(service)
        _built.update(_copies(space._nodes))
    else:
        space._nodes.update(_copies(_built))


def _copies(nodes: dict[Any, NodeData]) -> dict[Any, NodeData]:
    return {node_id: _copy(node) for node_id, node in nodes.items()}


def _copy(node: NodeData) -> NodeData:
    """Values are replaced and never changed in place, so they may be shared; what holds them may not."""
    copy = NodeData(node.nodeid)
    for attribute, held in node.attributes.items():
        assert held.value is not None
        copy.attributes[attribute] = AttributeValue(held.value)
    copy.references = list(node.references)
    return copy
