"""Subscriptions: each session has a service of its own, so that no client can touch another's.

asyncua keeps one service for all sessions and numbers subscriptions upwards, so that anyone could delete
or modify anyone's. Transfer between sessions finds nothing here (BadSubscriptionIdInvalid); clients then
subscribe anew. Intervals and counts are clamped, and a modified subscription really changes.
"""

from __future__ import annotations

import asyncio
import itertools
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.server.address_space import AddressSpace
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_subscription import InternalSubscription
from asyncua.server.subscription_service import SubscriptionService

from gateway.northbound.opcua.demands import Demands
from gateway.northbound.opcua.items import Items
from gateway.northbound.opcua.model import Model

LEAST_PUBLISHING = 50.0
"""Milliseconds. asyncua takes any: at 0.0001 one subscription fills a processor core."""
LONGEST_PUBLISHING = 3_600_000.0
KEEP_ALIVES = 10
"""Publishing intervals between keep-alives when the client leaves the choice to us."""
PER_SESSION = 50
UNACKNOWLEDGED = 100
"""Messages kept per subscription for Republish."""


@dataclass(slots=True)
class Sources:
    """What all subscriptions of a server share."""

    space: AddressSpace
    model: Model
    demands: Demands
    rates: dict[str, float]
    numbers: Iterator[int] = field(default_factory=lambda: itertools.count(1))


class Subscription(InternalSubscription):
    """One subscription."""

    monitored_item_srv: Items

    def __init__(self, data: ua.CreateSubscriptionResult, sources: Sources, **options: Any) -> None:
        super().__init__(data, sources.space, no_acks_limit=UNACKNOWLEDGED, **options)
        self.monitored_item_srv = Items(self, sources.space, sources.model, sources.demands, sources.rates)
        self.most_notifications = 0
        """Notifications in one message at most; 0: any number."""
        self._changed = asyncio.Event()

    def modify(self, asked: ua.ModifySubscriptionParameters) -> None:
        """Take over new intervals and counts, within our bounds, from now on."""
        _revise(self.data, asked)
        self.most_notifications = int(asked.MaxNotificationsPerPublish)
        self._changed.set()

    async def publish_results(self, requestdata: Any = None) -> bool:
        """Publish what waits; as many messages as it takes, while publish requests are at hand."""
        published = await super().publish_results(requestdata)
        more = published
        while more and self._publishing_enabled and self._triggered_datachanges:
            more = await super().publish_results()
        return published

    async def _subscription_loop(self) -> None:
        due = time.monotonic()
        while not self._closing:
            await self.publish_results()
            due = await self._rest(due)

    async def _rest(self, since: float) -> float:
        """Wait for the next publishing time, or for a new interval; returns when it was due."""
        self._changed.clear()
        due = max(since + float(self.data.RevisedPublishingInterval) / 1000, time.monotonic())
        try:
            async with asyncio.timeout(due - time.monotonic()):
                await self._changed.wait()
        except TimeoutError:
            return due
        return time.monotonic()

    def _pop_publish_result(self) -> ua.PublishResult:
        result = super()._pop_publish_result()
        result.MoreNotifications = bool(self._triggered_datachanges)
        return result

    def _pop_triggered_datachanges(self, result: ua.PublishResult) -> None:
        kept = self._hold_back()
        super()._pop_triggered_datachanges(result)
        self._triggered_datachanges = kept

    def _hold_back(self) -> dict[int, list[ua.MonitoredItemNotification]]:
        """Take out of the queues what does not fit into one message."""
        room = self.most_notifications or math.inf
        now: dict[int, list[ua.MonitoredItemNotification]] = {}
        later: dict[int, list[ua.MonitoredItemNotification]] = {}
        for item, queue in self._triggered_datachanges.items():
            fits = int(min(room, len(queue)))
            room -= fits
            if fits:
                now[item] = queue[:fits]
            if queue[fits:]:
                later[item] = queue[fits:]
        self._triggered_datachanges = now
        return later


class Subscriptions(SubscriptionService):
    """The subscriptions of one session."""

    def __init__(self, sources: Sources, server: InternalServer) -> None:
        super().__init__(sources.space, server)
        self._sources = sources

    async def create_subscription(
        self,
        params: ua.CreateSubscriptionParameters,
        callback: Callable[..., Any],
        session_id: ua.NodeId,
        request_callback: Callable[..., Any] | None = None,
    ) -> ua.CreateSubscriptionResult:
        if len(self.subscriptions) >= PER_SESSION:
            raise ServiceError(ua.StatusCodes.BadTooManySubscriptions)
        result = ua.CreateSubscriptionResult()
        number: Any = next(self._sources.numbers)
        result.SubscriptionId = number
        _revise(result, params)
        subscription = Subscription(
            result,
            self._sources,
            callback=callback,
            session_id=session_id,
            request_callback=request_callback,
            delete_callback=lambda: self.subscriptions.pop(number, None),
            max_queue_size=self.iserver.max_monitored_item_queue_size if self.iserver else 1,
            publishing_enabled=params.PublishingEnabled,
        )
        subscription.most_notifications = int(params.MaxNotificationsPerPublish)
        self.subscriptions[number] = subscription
        await subscription.start()
        return result

    def modify_subscription(self, params: ua.ModifySubscriptionParameters) -> ua.ModifySubscriptionResult:
        subscription = self._get(params.SubscriptionId)
        subscription.modify(params)
        result = ua.ModifySubscriptionResult()
        result.RevisedPublishingInterval = subscription.data.RevisedPublishingInterval
        result.RevisedLifetimeCount = subscription.data.RevisedLifetimeCount
        result.RevisedMaxKeepAliveCount = subscription.data.RevisedMaxKeepAliveCount
        return result

    def republish(self, params: ua.RepublishParameters) -> ua.NotificationMessage:
        subscription = self._get(params.SubscriptionId)
        result = subscription._not_acknowledged_results.get(int(params.RetransmitSequenceNumber))
        if result is None:
            raise ServiceError(ua.StatusCodes.BadMessageNotAvailable)
        message: ua.NotificationMessage = result.NotificationMessage
        return message

    def revised(self, subscription: int, item: int) -> float | None:
        """The item's sampling interval in milliseconds as the plan now holds it; None: no tag's."""
        return self._get(subscription).monitored_item_srv.revised(item)

    def _get(self, number: int) -> Subscription:
        subscription = self.subscriptions.get(int(number))
        if not isinstance(subscription, Subscription):
            raise ServiceError(ua.StatusCodes.BadSubscriptionIdInvalid)
        return subscription


def _revise(result: ua.CreateSubscriptionResult, asked: Any) -> None:
    """Fill in interval and counts: the asked ones within our bounds (OPC 10000-4 section 5.14.2)."""
    revised: Any = result
    revised.RevisedPublishingInterval = _interval(float(asked.RequestedPublishingInterval))
    keep_alives = int(asked.RequestedMaxKeepAliveCount) or KEEP_ALIVES
    revised.RevisedMaxKeepAliveCount = min(keep_alives, 5_000)
    revised.RevisedLifetimeCount = min(
        15_000, max(int(asked.RequestedLifetimeCount), 3 * revised.RevisedMaxKeepAliveCount)
    )


def _interval(asked: float) -> float:
    if math.isnan(asked):
        return LEAST_PUBLISHING
    return min(LONGEST_PUBLISHING, max(LEAST_PUBLISHING, asked))
