"""An OPC UA client in a process of its own: monitored items, writes at random times, a flood and a stop."""

from __future__ import annotations

import asyncio
import time
from dataclasses import asdict
from typing import Any

from asyncua import Client, ua

from benchmarks.limit.asks import ask_at_random
from benchmarks.limit.talk import asked, say, settings

NAMESPACE = 2
PUBLISHING = 500.0
"""Milliseconds between two publishings."""
PARAMETERS = [f"preset_frequency_{n}" for n in range(1, 9)] + ["jog_frequency"]
"""What a flood writes of each drive."""


class Items:
    """One subscription with many items, and how many notifications came."""

    def __init__(self) -> None:
        self.notifications = 0

    async def create(self, client: Client, tags: list[str], interval: float) -> list[float]:
        """Create an item on each tag; the revised sampling intervals in milliseconds."""
        asked = ua.CreateSubscriptionParameters(PUBLISHING, 1000, 10, 0, True, 0)
        made = await client.uaclient.create_subscription(asked, self._arrived)
        params = ua.CreateMonitoredItemsParameters()
        params.SubscriptionId = made.SubscriptionId
        params.ItemsToCreate = [_item(tag, number, interval) for number, tag in enumerate(tags)]
        results = await client.uaclient.create_monitored_items(params)
        for result in results:
            result.StatusCode.check()
        return [result.RevisedSamplingInterval for result in results]

    def _arrived(self, result: ua.PublishResult) -> None:
        for data in result.NotificationMessage.NotificationData or ():
            if isinstance(data, ua.DataChangeNotification):
                self.notifications += len(data.MonitoredItems)


def _item(tag: str, handle: int, interval: float) -> ua.MonitoredItemCreateRequest:
    item = ua.MonitoredItemCreateRequest()
    item.ItemToMonitor = ua.ReadValueId(NodeId=_node(tag), AttributeId=ua.AttributeIds.Value)
    item.MonitoringMode = ua.MonitoringMode.Reporting
    item.RequestedParameters.ClientHandle = handle
    item.RequestedParameters.SamplingInterval = interval
    item.RequestedParameters.QueueSize = 1
    return item


def _node(name: str) -> ua.NodeId:
    return ua.NodeId(ua.String(name), ua.Int16(NAMESPACE))


class Writer:
    """Writes and commands through one session."""

    def __init__(self, client: Client) -> None:
        self._client = client

    async def setpoint(self, drive: str, value: float) -> str:
        """Write a frequency."""
        return await self._write(f"{drive}.frequency_command", ua.Variant(value, ua.VariantType.Double))

    async def flood(self, drives: list[str], number: int, wait: float) -> dict[str, Any]:
        """Write ``number`` parameters with one request, and after ``wait`` seconds stop the first drive."""
        names = [f"{drive}.{name}" for name in PARAMETERS for drive in drives]
        tags = [(names[n % len(names)], n) for n in range(number)]
        writing = asyncio.create_task(self._write_all(tags))
        await asyncio.sleep(wait)
        at, waits = time.monotonic(), not writing.done()
        stop = await self.command(drives[0], "stop")
        writing.cancel()
        return {"at": at, "waits": waits, "outcome": stop}

    async def _write_all(self, tags: list[tuple[str, int]]) -> None:
        params = ua.WriteParameters()
        for tag, value in tags:
            item = ua.WriteValue(NodeId=_node(tag), AttributeId=ua.AttributeIds.Value)
            item.Value = ua.DataValue(ua.Variant(value, ua.VariantType.Int64))
            params.NodesToWrite.append(item)
        await self._client.uaclient.write(params)

    async def command(self, drive: str, name: str, *values: float) -> str:
        """Give a command."""
        try:
            arguments = [ua.Variant(value, ua.VariantType.Double) for value in values]
            await self._client.get_node(_node(drive)).call_method(_node(f"{drive}.{name}"), *arguments)
        except ua.UaStatusCodeError as error:
            return type(error).__name__
        return "Good"

    async def _write(self, tag: str, value: ua.Variant) -> str:
        node = self._client.get_node(_node(tag))
        try:
            await node.write_attribute(ua.AttributeIds.Value, ua.DataValue(value))
        except ua.UaError as error:
            return type(error).__name__
        except TimeoutError:
            return "Timeout"
        return "Good"


async def main() -> None:
    """Connect, create the items, and do what standard input asks."""
    given = settings()
    client = Client(given["url"], timeout=30)
    client.session_timeout = 60_000
    client.set_user(given["user"])
    client.set_password(given["password"])
    async with client:
        items, writer = Items(), Writer(client)
        say({"revised": await items.create(client, given["tags"], given["interval"])})
        async for what in asked():
            if "write" in what:
                done = await ask_at_random(writer.setpoint, **what["write"])
                say([asdict(ask) for ask in done])
            elif "flood" in what:
                say(await writer.flood(**what["flood"]))
            elif "stream" in what:
                say(await _stream(writer, **what["stream"]))
            else:
                say({"notifications": items.notifications})


async def _stream(writer: Writer, drive: str, first: int, number: int) -> list[str]:
    """A stream of setpoints to one drive, faster than the line can carry; what became of each."""
    tasks = []
    for raw in range(first, first + number):
        tasks.append(asyncio.create_task(writer.setpoint(drive, raw / 100)))
        await asyncio.sleep(0.002)
    return list(await asyncio.gather(*tasks))


if __name__ == "__main__":
    asyncio.run(main())
