"""Values, StatusCodes and times of reads."""

from __future__ import annotations

import asyncio
import time
from datetime import UTC, datetime

import pytest
from asyncua import Client, ua

from gateway.tag import Quality, Sample, Severity
from tests.opcua.support import COMMAND, FREQUENCY, Running, client_of, eventually, good, monitor, subscribe

pytestmark = pytest.mark.asyncio(loop_scope="session")

AT = 1_700_000_000_123_456_000
STATUS = {
    Quality.GOOD: "Good",
    Quality.STALE: "UncertainLastUsableValue",
    Quality.WAITING: "BadWaitingForInitialData",
    Quality.NO_COMMUNICATION: "BadNoCommunication",
    Quality.LINE_DOWN: "BadNotConnected",
    Quality.REFUSED: "BadNotSupported",
    Quality.INVALID: "BadSensorFailure",
    Quality.NOT_APPLICABLE: "BadOutOfService",
    Quality.CONFIGURATION: "BadConfigurationError",
}


async def read(client: Client, name: str = FREQUENCY, **wanted: object) -> ua.DataValue:
    """Read a node's value with further parameters of the request."""
    index_range = wanted.pop("IndexRange", None)
    where = ua.ReadValueId(NodeId=ua.NodeId(name, 2), AttributeId=ua.AttributeIds.Value)
    where.IndexRange = index_range
    params = ua.ReadParameters(NodesToRead=[where], TimestampsToReturn=ua.TimestampsToReturn.Both)
    for field, value in wanted.items():
        setattr(params, field, value)
    (value,) = await client.uaclient.read(params)
    return value


async def test_an_unwatched_tag_is_read_from_the_core(gateway: Running) -> None:
    gateway.bridge.samples[FREQUENCY] = good(FREQUENCY, 12.5, at=AT)
    async with client_of(gateway) as client:
        value = await read(client, MaxAge=1500.0)
    assert value.Value == ua.Variant(12.5, ua.VariantType.Double)
    assert value.StatusCode.is_good()
    assert value.SourceTimestamp == datetime.fromtimestamp(AT // 10**9, UTC).replace(microsecond=123456)
    assert gateway.bridge.reads == [((FREQUENCY,), 1.5)]


@pytest.mark.parametrize(("quality", "status"), STATUS.items())
async def test_the_status_is_the_samples(gateway: Running, quality: Quality, status: str) -> None:
    kept = None if quality.severity is Severity.BAD else 7.0
    gateway.bridge.samples[FREQUENCY] = Sample(FREQUENCY, kept, quality, AT)
    async with client_of(gateway) as client:
        value = await read(client)
    assert value.StatusCode.name == status
    assert value.Value.Value == kept


async def test_no_quality_is_without_a_status() -> None:
    assert set(STATUS) == set(Quality)


async def test_enumerations_are_read_as_number_and_text(gateway: Running) -> None:
    tag = "fan-1.run_source"
    gateway.bridge.samples[tag] = good(tag, 1, text="operator_or_terminals", at=AT)
    async with client_of(gateway) as client:
        assert (await read(client, tag)).Value == ua.Variant(1, ua.VariantType.Int32)
        text = await read(client, f"{tag}/ValueAsText")
    assert text.Value.Value.Text == "operator_or_terminals"


async def test_a_watched_tag_is_answered_from_the_node_while_as_new_as_promised(
    gateway: Running,
) -> None:
    async with client_of(gateway) as client:
        number, collector = await subscribe(client, 100)
        await monitor(client, number, interval=30_000)
        gateway.bridge.push(good(FREQUENCY, 3.0))
        await eventually(lambda: 3.0 in collector.contents)
        assert (await read(client, MaxAge=0.0)).Value.Value == 3.0
        assert gateway.bridge.reads == []
        gateway.bridge.push(good(FREQUENCY, 4.0, at=time.time_ns() - 40 * 10**9))
        await eventually(lambda: 4.0 in collector.contents)
        await read(client, MaxAge=0.0)
        assert gateway.bridge.reads == [((FREQUENCY,), 0.0)]


async def test_only_the_wanted_timestamps_are_sent(gateway: Running) -> None:
    gateway.bridge.samples[FREQUENCY] = good(FREQUENCY, 1.0, at=AT)
    async with client_of(gateway) as client:
        neither = await read(client, TimestampsToReturn=ua.TimestampsToReturn.Neither)
        source = await read(client, TimestampsToReturn=ua.TimestampsToReturn.Source)
    assert (neither.SourceTimestamp, neither.ServerTimestamp) == (None, None)
    assert source.SourceTimestamp is not None
    assert source.ServerTimestamp is None


async def test_an_index_range_on_a_scalar_has_no_data(gateway: Running) -> None:
    async with client_of(gateway) as client:
        assert (await read(client, IndexRange="0:1")).StatusCode.name == "BadIndexRangeNoData"


async def test_a_negative_age_is_refused(gateway: Running) -> None:
    async with client_of(gateway) as client:
        with pytest.raises(ua.uaerrors.BadMaxAgeInvalid):
            await read(client, MaxAge=-1.0)


async def test_an_unknown_node_is_unknown(gateway: Running) -> None:
    async with client_of(gateway) as client:
        assert (await read(client, "fan-1.nothing")).StatusCode.name == "BadNodeIdUnknown"


async def test_a_slow_drive_holds_up_no_other_read_of_the_session(gateway: Running) -> None:
    gateway.bridge.read_delay = 0.5
    async with client_of(gateway) as client:
        slow = asyncio.create_task(read(client, COMMAND))
        await eventually(lambda: len(gateway.bridge.reads) == 1)
        await client.nodes.server_state.read_value()
        assert not slow.done()
        await slow


async def test_a_read_ends_before_its_client_gives_up(gateway: Running) -> None:
    gateway.bridge.read_delay = 5.0
    client = client_of(gateway)
    client.uaclient._timeout = 0.5
    async with client:
        client.uaclient.protocol.timeout = 0.5
        assert (await read(client)).StatusCode.name == "BadTimeout"
