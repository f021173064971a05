"""The Read service (OPC 10000-4 section 5.11.2): watched tags from the node, others from the core."""

from __future__ import annotations

import asyncio
import dataclasses
import math
import time
from collections.abc import Iterable, Sequence

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.server.address_space import AddressSpace

from gateway.bridge.api import Bridge
from gateway.northbound.opcua.demands import Demands
from gateway.northbound.opcua.live import Live, shown
from gateway.northbound.opcua.login import Client
from gateway.northbound.opcua.model import Model, TagNode
from gateway.northbound.opcua.nodes import WRITE
from gateway.northbound.opcua.status import bad_value
from gateway.tag import Quality, Sample

LONGEST_AGE = 86_400.0
"""Seconds; a MaxAge beyond that (Int32's greatest value and more mean "whatever there is") is cut to it."""


class Reader:
    """Answers Read requests."""

    def __init__(
        self, space: AddressSpace, model: Model, bridge: Bridge, demands: Demands, live: Live
    ) -> None:
        self._space = space
        self._model = model
        self._bridge = bridge
        self._demands = demands
        self._live = live

    async def read(
        self, params: ua.ReadParameters, client: Client, patience: float | None
    ) -> list[ua.DataValue]:
        """One value per node, in order; the core has ``patience`` seconds.

        Raises:
            ServiceError: if the request as a whole makes no sense.
        """
        max_age = _max_age(params.MaxAge)
        if params.TimestampsToReturn not in list(ua.TimestampsToReturn)[:4]:
            raise ServiceError(ua.StatusCodes.BadTimestampsToReturnInvalid)
        known = [self._known(where, client, max_age) for where in params.NodesToRead]
        missing = [
            self._model.tags[where.NodeId]
            for where, value in zip(params.NodesToRead, known, strict=True)
            if value is None
        ]
        fetched = iter(await self._fetch(missing, max_age, patience))
        values = (value if value is not None else next(fetched) for value in known)
        return [_stamped(value, params.TimestampsToReturn) for value in values]

    def _known(self, where: ua.ReadValueId, client: Client, max_age: float) -> ua.DataValue | None:
        """The answer, if it can be given without the core."""
        if where.IndexRange:
            return bad_value(ua.StatusCodes.BadIndexRangeNoData)
        node = self._model.tags.get(where.NodeId)
        if node is not None and where.AttributeId == ua.AttributeIds.Value:
            return self._present(node, max_age)
        value = self._space.read_attribute_value(where.NodeId, where.AttributeId)
        return self._for_client(where, value, client)

    def _present(self, node: TagNode, max_age: float) -> ua.DataValue | None:
        if not node.point.readable:
            return bad_value(ua.StatusCodes.BadNotReadable)
        sample = self._live.sample(node.tag)
        if sample is None or not self._demands.watched(node.tag):
            return None
        age = max(max_age, self._demands.promise(node.tag) or 0.0)
        return shown(sample, node) if _current(sample, age, time.time_ns()) else None

    def _for_client(self, where: ua.ReadValueId, value: ua.DataValue, client: Client) -> ua.DataValue:
        """UserAccessLevel and UserExecutable say what this client may do."""
        node, method = self._model.tags.get(where.NodeId), self._model.methods.get(where.NodeId)
        needed = node.point.role if node is not None else method.role if method is not None else None
        may = needed is not None and not client.anonymous and client.rights.covers(needed)
        if may or value.Value is None:
            return value
        if node is not None and where.AttributeId == ua.AttributeIds.UserAccessLevel:
            return ua.DataValue(ua.Variant(value.Value.Value & ~WRITE, ua.VariantType.Byte))
        if method is not None and where.AttributeId == ua.AttributeIds.UserExecutable:
            return ua.DataValue(ua.Variant(False, ua.VariantType.Boolean))
        return value

    async def _fetch(
        self, nodes: Sequence[TagNode], max_age: float, patience: float | None
    ) -> Iterable[ua.DataValue]:
        if not nodes:
            return []
        tags = list(dict.fromkeys(node.tag for node in nodes))
        try:
            async with asyncio.timeout(patience):
                samples = await self._bridge.read(tags, max_age)
        except TimeoutError:
            return [bad_value(ua.StatusCodes.BadTimeout) for _ in nodes]
        by_tag = dict(zip(tags, samples, strict=True))
        return [shown(by_tag[node.tag], node) for node in nodes]


def _max_age(milliseconds: float) -> float:
    if math.isnan(milliseconds) or milliseconds < 0:
        raise ServiceError(ua.StatusCodes.BadMaxAgeInvalid)
    return min(milliseconds / 1000, LONGEST_AGE)


def _current(sample: Sample, age: float, now: int) -> bool:
    """True when the core would tell nothing newer: it tells each loss of quality by itself."""
    if sample.quality is Quality.GOOD:
        return now - sample.time <= age * 1e9
    return sample.quality is not Quality.WAITING


def _stamped(value: ua.DataValue, wanted: ua.TimestampsToReturn) -> ua.DataValue:
    """A copy with the timestamps that the client asked for."""
    source = wanted in (ua.TimestampsToReturn.Source, ua.TimestampsToReturn.Both)
    server = wanted in (ua.TimestampsToReturn.Server, ua.TimestampsToReturn.Both)
    return dataclasses.replace(
        value,
        SourceTimestamp=value.SourceTimestamp if source else None,
        ServerTimestamp=value.ServerTimestamp if server else None,
    )
