"""Data change filters (OPC 10000-4 section 7.22.2): those that can be kept become a `Rule`, the others are
refused. Pure."""

from __future__ import annotations

import math
from typing import Any

from asyncua import ua
from asyncua.ua import uaprotocol_auto

from gateway.northbound.opcua.model import TagNode
from gateway.northbound.opcua.reporting import Rule

_NUMBERS = (
    ua.VariantType.SByte,
    ua.VariantType.Byte,
    ua.VariantType.Int16,
    ua.VariantType.UInt16,
    ua.VariantType.Int32,
    ua.VariantType.UInt32,
    ua.VariantType.Int64,
    ua.VariantType.UInt64,
    ua.VariantType.Float,
    ua.VariantType.Double,
)


class ItemError(Exception):
    """The item cannot be made as asked; ``code`` is the StatusCode."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def make_rule(where: ua.ReadValueId, wanted: Any, shown: TagNode | None, present: ua.DataValue) -> Rule:
    """What an item on ``where`` with the filter ``wanted`` reports.

    ``shown`` is the tag behind the node, if any, and ``present`` its value now.

    Raises:
        ItemError: with the reason as StatusCode.
    """
    if where.IndexRange:
        raise ItemError(ua.StatusCodes.BadIndexRangeNoData)
    if shown is not None and not shown.point.readable and where.AttributeId == ua.AttributeIds.Value:
        raise ItemError(ua.StatusCodes.BadNotReadable)
    if _is_absent(wanted):
        return Rule()
    if not isinstance(wanted, uaprotocol_auto.DataChangeFilter):
        raise ItemError(ua.StatusCodes.BadMonitoredItemFilterUnsupported)
    if where.AttributeId != ua.AttributeIds.Value:
        raise ItemError(ua.StatusCodes.BadFilterNotAllowed)
    return Rule(wanted.Trigger, _deadband(wanted, shown, present))


def _is_absent(wanted: Any) -> bool:
    return wanted is None or (isinstance(wanted, ua.ExtensionObject) and wanted.TypeId == ua.NodeId())


def _deadband(wanted: Any, shown: TagNode | None, present: ua.DataValue) -> float:
    """The deadband in the unit of the value; 0: none."""
    kind, size = wanted.DeadbandType, float(wanted.DeadbandValue)
    if kind == ua.DeadbandType.None_:
        return 0.0
    if not math.isfinite(size) or size < 0:
        raise ItemError(ua.StatusCodes.BadDeadbandFilterInvalid)
    if _variant_type(shown, present) not in _NUMBERS:
        raise ItemError(ua.StatusCodes.BadFilterNotAllowed)
    return size if kind == ua.DeadbandType.Absolute else _percent(size, shown)


def _percent(size: float, shown: TagNode | None) -> float:
    if shown is None or shown.point.low is None or shown.point.high is None:
        raise ItemError(ua.StatusCodes.BadFilterNotAllowed)  # there is no EURange to take a part of
    if size > 100:
        raise ItemError(ua.StatusCodes.BadDeadbandFilterInvalid)
    return size / 100 * (shown.point.high - shown.point.low)


def _variant_type(shown: TagNode | None, present: ua.DataValue) -> ua.VariantType | None:
    if shown is not None:
        return shown.kind
    return present.Value.VariantType if present.Value is not None else None
