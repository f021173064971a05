"""The monitored items of one subscription: each one on a tag is a demand as long as it is enabled.

asyncua compares each value with the one before (so that slow drift never passes a deadband), loses
changes of status under a deadband, takes the asked sampling interval for granted and knows one queue
policy. Its bookkeeping of items and handles is kept; what is reported when is ours.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

from asyncua import ua
from asyncua.server.address_space import AddressSpace
from asyncua.server.monitored_item_service import MonitoredItemData, MonitoredItemService

from gateway.northbound.opcua import plain
from gateway.northbound.opcua.demands import Demands
from gateway.northbound.opcua.filters import ItemError, make_rule
from gateway.northbound.opcua.interest import Item
from gateway.northbound.opcua.model import Model, TagNode
from gateway.northbound.opcua.reporting import Rule, enqueue

LEAST_PERIOD = 0.01
LONGEST_PERIOD = 3600.0
MOST_ITEMS = 20_000
"""Monitored items of one subscription."""


class Subscribed(Protocol):
    """What the items need of their subscription."""

    data: ua.CreateSubscriptionResult
    max_queue_size: int
    _triggered_datachanges: dict[int, list[ua.MonitoredItemNotification]]


class Items(MonitoredItemService):
    """The monitored items of one subscription."""

    def __init__(
        self, subscription: Any, space: AddressSpace, model: Model, demands: Demands, rates: dict[str, float]
    ) -> None:
        super().__init__(subscription, space)
        self._subscription: Subscribed = subscription
        self._model = model
        self._demands = demands
        self._rates = rates
        self._rules: dict[int, Rule] = {}
        self._wanted: dict[int, float] = {}
        """Per item on a tag, the period in seconds that its client asked for."""

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        return [await self._create(item) for item in params.ItemsToCreate]

    def revised(self, item: int) -> float | None:
        """Milliseconds between two samples of the item: what was asked, or what the plan can hold if that
        is longer. None for an item that is on no tag."""
        shown = self._shown(item)
        if shown is None or item not in self._wanted:
            return None
        return max(self._wanted[item], self._demands.promise(shown.tag) or 0.0) * 1000

    async def datachange_callback(
        self, handle: int, value: ua.DataValue, error: ua.StatusCode | None = None
    ) -> None:
        item = self._monitored_datachange[handle]
        data, rule = self._monitored_items[item], self._rules[item]
        if data.mode != ua.MonitoringMode.Reporting or not rule.due(value):
            return
        rule.reported = value
        notification = ua.MonitoredItemNotification(ClientHandle=_handle(data), Value=value)
        queue = self._subscription._triggered_datachanges.setdefault(item, [])
        enqueue(queue, notification, data.queue_size, discard_oldest=rule.discard_oldest)

    async def _create(self, params: ua.MonitoredItemCreateRequest) -> ua.MonitoredItemCreateResult:
        if len(self._monitored_items) >= MOST_ITEMS:
            return _refusal(ua.StatusCodes.BadTooManyMonitoredItems)
        if params.ItemToMonitor.AttributeId == ua.AttributeIds.EventNotifier:
            if not isinstance(params.RequestedParameters.Filter, ua.EventFilter):
                return _refusal(ua.StatusCodes.BadMonitoredItemFilterInvalid)
            return self._create_events_monitored_item(params)
        return await self._create_data_change_monitored_item(params)

    async def _create_data_change_monitored_item(
        self, params: ua.MonitoredItemCreateRequest
    ) -> ua.MonitoredItemCreateResult:
        try:
            rule = self._rule(params.ItemToMonitor, params.RequestedParameters)
        except ItemError as error:
            return _refusal(error.code)
        # asyncua counts the item's number up in the call below and then reports the first value at once.
        number = self._monitored_item_counter + 1
        self._rules[number] = rule
        result = await super()._create_data_change_monitored_item(params)
        if not result.StatusCode.is_good():
            del self._rules[number]
        elif (shown := self._shown(number)) is not None:
            self._wanted[number] = self._period(params.RequestedParameters.SamplingInterval, shown)
            self._declare(number)
        return result

    def _modify_monitored_item(self, params: ua.MonitoredItemModifyRequest) -> ua.MonitoredItemModifyResult:
        result = ua.MonitoredItemModifyResult()
        number, asked = int(params.MonitoredItemId), params.RequestedParameters
        data = self._monitored_items.get(number)
        if data is None or data.read_value_id is None:
            result.StatusCode = plain.status(ua.StatusCodes.BadMonitoredItemIdInvalid)
            return result
        if number in self._rules:
            try:
                self._rules[number] = self._rule(data.read_value_id, asked, self._rules[number].reported)
            except ItemError as error:
                result.StatusCode = plain.status(error.code)
                return result
        data.client_handle = asked.ClientHandle
        data.queue_size = self._revise_queue_size(asked.QueueSize)
        result.RevisedQueueSize = data.queue_size
        result.RevisedSamplingInterval = asked.SamplingInterval
        if (shown := self._shown(number)) is not None:
            self._wanted[number] = self._period(asked.SamplingInterval, shown)
            self._declare(number)
        return result

    async def _set_monitoring_mode(self, mode: ua.MonitoringMode, mid: int) -> ua.StatusCode:
        data = self._monitored_items.get(mid)
        if data is None:
            return plain.status(ua.StatusCodes.BadMonitoredItemIdInvalid)
        before, data.mode = data.mode, mode
        if mid in self._wanted:
            self._declare(mid)
        if mode != ua.MonitoringMode.Reporting:
            self._subscription._triggered_datachanges.pop(mid, None)
        elif before != mode and data.callback_handle is not None and data.read_value_id is not None:
            self._rules[mid].reported = None
            where = data.read_value_id
            await self.trigger_datachange(data.callback_handle, where.NodeId, where.AttributeId)
        return ua.StatusCode()

    def _delete_monitored_items(self, mid: int) -> ua.StatusCode:
        self._demands.drop(self._item(mid))
        self._rules.pop(mid, None)
        self._wanted.pop(mid, None)
        self._subscription._triggered_datachanges.pop(mid, None)
        return super()._delete_monitored_items(mid)

    def _revise_queue_size(self, requested: int) -> int:
        return max(1, min(int(requested), self._subscription.max_queue_size))

    def _declare(self, item: int) -> None:
        shown = self._shown(item)
        if shown is None or self._monitored_items[item].mode == ua.MonitoringMode.Disabled:
            self._demands.drop(self._item(item))
        else:
            self._demands.want(self._item(item), shown.tag, self._wanted[item])

    def _item(self, number: int) -> Item:
        return Item(int(self._subscription.data.SubscriptionId), number)

    def _shown(self, item: int) -> TagNode | None:
        """The tag that the item's node shows, if the item is on a node's value."""
        data = self._monitored_items.get(item)
        if data is None or data.read_value_id is None:
            return None
        if data.read_value_id.AttributeId != ua.AttributeIds.Value:
            return None
        return self._model.tags.get(data.read_value_id.NodeId)

    def _period(self, asked: float, shown: TagNode) -> float:
        """Seconds for a sampling interval in milliseconds. Negative: the publishing interval; 0 (or no
        number at all): the rate class of the point (OPC 10000-4 section 5.13.1.2)."""
        interval = float(self._subscription.data.RevisedPublishingInterval) if asked < 0 else float(asked)
        if math.isnan(interval) or interval == 0:
            return self._rates.get(shown.point.rate, 1.0)
        return min(LONGEST_PERIOD, max(LEAST_PERIOD, interval / 1000))

    def _rule(
        self, where: ua.ReadValueId, asked: ua.MonitoringParameters, reported: ua.DataValue | None = None
    ) -> Rule:
        shown = self._model.tags.get(where.NodeId)
        present = self.aspace.read_attribute_value(where.NodeId, where.AttributeId)
        rule = make_rule(where, asked.Filter, shown, present)
        rule.discard_oldest = bool(asked.DiscardOldest)
        rule.reported = reported
        return rule


def _handle(data: MonitoredItemData) -> Any:
    return data.client_handle


def _refusal(code: int) -> ua.MonitoredItemCreateResult:
    result = ua.MonitoredItemCreateResult()
    result.StatusCode = plain.status(code)
    return result
