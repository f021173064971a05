"""Monitored items are demands while they live, and report what they should."""

from __future__ import annotations

import pytest
from asyncua import Client, ua

from gateway.bridge.api import Periods
from gateway.tag import Quality, Sample
from tests.opcua.support import COMMAND, FREQUENCY, Running, client_of, eventually, good, monitor, subscribe

pytestmark = pytest.mark.asyncio(loop_scope="session")


def cut(client: Client) -> None:
    """The cable is pulled: no goodbye of any sort."""
    client.uaclient.protocol.transport.abort()


async def remove(client: Client, number: int, item: ua.MonitoredItemCreateResult) -> None:
    params = ua.DeleteMonitoredItemsParameters(number, [item.MonitoredItemId])
    (status,) = await client.uaclient.delete_monitored_items(params)
    status.check()


def deadband(kind: ua.DeadbandType, size: float) -> ua.DataChangeFilter:
    return ua.DataChangeFilter(
        Trigger=ua.DataChangeTrigger.StatusValue, DeadbandType=kind, DeadbandValue=size
    )


async def test_an_item_is_a_demand_until_it_is_deleted(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, _ = await subscribe(client, 100)
        item = await monitor(client, number, interval=250)
        assert gateway.bridge.wants == {FREQUENCY: 0.25}
        await remove(client, number, item)
        await eventually(lambda: gateway.bridge.wants == {})


async def test_the_fastest_item_counts(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, _ = await subscribe(client, 100)
        await monitor(client, number, interval=1000)
        fast = await monitor(client, number, interval=200)
        assert gateway.bridge.wants == {FREQUENCY: 0.2}
        await remove(client, number, fast)
        await eventually(lambda: gateway.bridge.wants == {FREQUENCY: 1.0})
    await eventually(lambda: gateway.bridge.wants == {})


async def test_a_deleted_subscription_wants_nothing(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, _ = await subscribe(client, 100)
        await monitor(client, number)
        await client.uaclient.delete_subscriptions([number])
        await eventually(lambda: gateway.bridge.wants == {})


async def test_a_vanished_client_wants_nothing_once_its_session_has_timed_out(gateway: Running) -> None:
    client = client_of(gateway)
    client.session_timeout = 1000
    await client.connect()
    number, _ = await subscribe(client, 100)
    await monitor(client, number)
    assert gateway.bridge.wants == {FREQUENCY: 0.1}
    cut(client)
    await eventually(lambda: gateway.bridge.wants == {})
    await client.disconnect()


async def test_disabled_items_do_not_count(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, collector = await subscribe(client, 100)
        item = (await monitor(client, number, mode=ua.MonitoringMode.Disabled)).MonitoredItemId
        assert gateway.bridge.wants == {}
        await client.uaclient.set_monitoring_mode(
            ua.SetMonitoringModeParameters(number, ua.MonitoringMode.Sampling, [item])
        )
        await eventually(lambda: gateway.bridge.wants == {FREQUENCY: 0.1})
        await client.uaclient.set_monitoring_mode(
            ua.SetMonitoringModeParameters(number, ua.MonitoringMode.Disabled, [item])
        )
        await eventually(lambda: gateway.bridge.wants == {})
        assert collector.values == []


@pytest.mark.parametrize(
    ("asked", "wanted", "revised"),
    [
        (50.0, 0.05, 100.0),
        (700.0, 0.7, 700.0),
        (0.0, 0.2, 200.0),
        (-1.0, 0.3, 300.0),
        (float("nan"), 0.2, 200.0),
    ],
    ids=["faster than the plan", "slower", "as the profile says", "as published", "no number"],
)
async def test_the_sampling_interval_is_what_the_plan_can_hold(
    gateway: Running, asked: float, wanted: float, revised: float
) -> None:
    async with client_of(gateway) as client:
        number, _ = await subscribe(client, 300)
        result = await monitor(client, number, interval=asked)
        assert result.RevisedSamplingInterval == revised
        assert gateway.bridge.wants == {FREQUENCY: wanted}
    await eventually(lambda: gateway.bridge.wants == {})


async def test_a_modified_item_changes_its_demand(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, _ = await subscribe(client, 100)
        item = (await monitor(client, number)).MonitoredItemId
        gateway.bridge.push_update(Periods({FREQUENCY: 0.4}))
        change = ua.MonitoredItemModifyRequest(item, ua.MonitoringParameters(SamplingInterval=2000.0))
        unknown = ua.MonitoredItemModifyRequest(9999, ua.MonitoringParameters())
        params = ua.ModifyMonitoredItemsParameters(number, ItemsToModify=[change, unknown])
        good_one, bad_one = await client.uaclient.modify_monitored_items(params)
        assert good_one.RevisedSamplingInterval == 2000.0
        assert bad_one.StatusCode.name == "BadMonitoredItemIdInvalid"
        assert gateway.bridge.wants == {FREQUENCY: 2.0}
    await eventually(lambda: gateway.bridge.wants == {})


async def test_samples_arrive_with_their_status_and_time(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, collector = await subscribe(client, 50)
        await monitor(client, number)
        sample = good(FREQUENCY, 12.25)
        gateway.bridge.push(sample)
        await eventually(lambda: 12.25 in collector.contents)
        gateway.bridge.push(Sample(FREQUENCY, None, Quality.NO_COMMUNICATION, sample.time, reason="silent"))
        await eventually(lambda: collector.codes[-1] == "BadNoCommunication")
        reported = collector.values[collector.contents.index(12.25)]
        assert int(reported.SourceTimestamp.timestamp() * 1e6) == sample.time // 1000


async def test_a_value_that_nobody_watches_any_more_is_not_shown_to_the_next(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, collector = await subscribe(client, 50)
        item = await monitor(client, number)
        gateway.bridge.push(good(FREQUENCY, 77.0))
        await eventually(lambda: 77.0 in collector.contents)
        await remove(client, number, item)
        await eventually(lambda: gateway.bridge.wants == {})
        gateway.bridge.samples.clear()
        later, second = await subscribe(client, 50)
        await monitor(client, later)
        await eventually(lambda: len(second.values) > 0)
        assert second.codes[0] == "BadWaitingForInitialData"


async def test_a_change_of_status_passes_the_deadband(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, collector = await subscribe(client, 50)
        wide = deadband(ua.DeadbandType.Absolute, 10.0)
        await monitor(client, number, filter=wide, queue=20)
        moves = [(20.0, Quality.GOOD), (21.0, Quality.GOOD), (None, Quality.NO_COMMUNICATION)]
        moves += [(22.0, Quality.GOOD), (22.0, Quality.STALE), (40.0, Quality.STALE)]
        for value, quality in moves:
            gateway.bridge.push(Sample(FREQUENCY, value, quality, 1_700_000_000_000_000_000))
        await eventually(lambda: 40.0 in collector.contents)
        assert collector.contents[-5:] == [20.0, None, 22.0, 22.0, 40.0]


@pytest.mark.parametrize(
    ("tag", "wanted", "code"),
    [
        (COMMAND, deadband(ua.DeadbandType.Percent, 5.0), "Good"),
        (COMMAND, deadband(ua.DeadbandType.Percent, 500.0), "BadDeadbandFilterInvalid"),
        (FREQUENCY, deadband(ua.DeadbandType.Percent, 5.0), "BadFilterNotAllowed"),
        (FREQUENCY, deadband(ua.DeadbandType.Absolute, -1.0), "BadDeadbandFilterInvalid"),
        ("fan-1.running", deadband(ua.DeadbandType.Absolute, 1.0), "BadFilterNotAllowed"),
        (FREQUENCY, ua.EventFilter(), "BadMonitoredItemFilterUnsupported"),
    ],
)
async def test_filters_that_cannot_be_kept_are_refused(
    gateway: Running, tag: str, wanted: object, code: str
) -> None:
    async with client_of(gateway) as client:
        number, _ = await subscribe(client, 100)
        result = await monitor(client, number, tag, filter=wanted)
        assert result.StatusCode.name == code
    await eventually(lambda: gateway.bridge.wants == {})


async def test_an_item_on_an_unknown_node_leaves_no_demand(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, _ = await subscribe(client, 100)
        result = await monitor(client, number, "fan-1.nothing")
        assert result.StatusCode.name == "BadNodeIdUnknown"
        assert gateway.bridge.wants == {}


@pytest.mark.parametrize(("asked", "revised"), [(0.0001, 50.0), (0.0, 50.0), (250.0, 250.0), (1e12, 3.6e6)])
async def test_publishing_intervals_have_bounds(gateway: Running, asked: float, revised: float) -> None:
    params = ua.CreateSubscriptionParameters(asked, 10, 3, 0, True, 0)
    async with client_of(gateway) as client:
        result = await client.uaclient.create_subscription(params, lambda _: None)
        assert result.RevisedPublishingInterval == revised
        assert result.RevisedLifetimeCount >= 3 * result.RevisedMaxKeepAliveCount


async def test_a_modified_subscription_changes(gateway: Running) -> None:
    async with client_of(gateway) as client:
        number, collector = await subscribe(client, 3_600_000)
        await monitor(client, number)
        changed = ua.ModifySubscriptionParameters(number, 60.0, 100, 10, 0, 0)
        result = await client.uaclient.update_subscription(changed)
        assert result.RevisedPublishingInterval == 60.0
        gateway.bridge.push(good(FREQUENCY, 8.0))
        await eventually(lambda: 8.0 in collector.contents)


async def test_nobody_can_touch_anothers_subscription(gateway: Running) -> None:
    async with client_of(gateway, "operator") as owner, client_of(gateway) as stranger:
        number, _ = await subscribe(owner, 100)
        await monitor(owner, number)
        with pytest.raises(ua.uaerrors.BadSubscriptionIdInvalid):
            await monitor(stranger, number)
        (status,) = await stranger.uaclient.delete_subscriptions([number])
        assert status.name == "BadSubscriptionIdInvalid"
        assert gateway.bridge.wants == {FREQUENCY: 0.1}


async def test_a_long_queue_is_sent_in_as_many_messages_as_it_takes(gateway: Running) -> None:
    sizes: list[int] = []
    values: list[float] = []

    def keep(result: ua.PublishResult) -> None:
        for data in result.NotificationMessage.NotificationData:
            sizes.append(len(data.MonitoredItems))
            values.extend(item.Value.Value.Value for item in data.MonitoredItems)

    async with client_of(gateway) as client:
        params = ua.CreateSubscriptionParameters(100, 100, 10, 3, True, 0)
        number = (await client.uaclient.create_subscription(params, keep)).SubscriptionId
        await monitor(client, number, queue=20)
        gateway.bridge.push(*(good(FREQUENCY, float(n)) for n in range(8)))
        await eventually(lambda: 7.0 in values)
    assert max(sizes) <= 3
    assert [value for value in values if value is not None] == [float(n) for n in range(8)]
