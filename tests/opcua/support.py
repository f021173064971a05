"""A running adapter on a bridge in memory, and clients for it."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from asyncua import Client, Node, ua

from gateway.bridge.api import Catalogue
from gateway.northbound.opcua.server import Adapter, listening
from gateway.tag import Cause, Origin, Outcome, Quality, Role, Sample, Value, ValueType, Verdict
from gateway.users import add_user
from tests.fakes import FakeBridge

PASSWORD = "correct horse"
CHEAP = 10
"""Logarithm of scrypt's N for the passwords here; `test_users` takes the real one."""
CLIENT_URI = "urn:test:client"
FREQUENCY = "fan-1.output_frequency"
COMMAND = "fan-1.frequency_command"


def _refused(cause: Cause) -> Outcome:
    return Outcome(verdict=Verdict.REFUSED, cause=cause, reason=f"refused: {cause}")


def _is_wrong(value: Value, kind: ValueType) -> bool:
    takes = {ValueType.BOOLEAN: (bool,), ValueType.TEXT: (str,)}.get(kind, (int, float, str))
    wrong_bit = isinstance(value, bool) != (kind is ValueType.BOOLEAN)
    return wrong_bit or not isinstance(value, takes) or (kind is ValueType.NUMBER and isinstance(value, str))


class JudgingBridge(FakeBridge):
    """Refuses what is unknown, of the wrong type, or for another role, as the core's guard does, else gives
    `outcome`."""

    read_delay = 0.0

    def reset(self) -> None:
        """Forget what earlier tests did."""
        self.writes.clear()
        self.commands.clear()
        self.samples.clear()
        self.reads.clear()
        self.outcome, self.delay, self.read_delay = Outcome(verdict=Verdict.CONFIRMED), 0.0, 0.0

    async def read(self, tags: Any, max_age: float = 0.0) -> Any:
        self.reads.append((tuple(tags), max_age))
        await asyncio.sleep(self.read_delay)
        return await super().read(tags, max_age)

    def __init__(self, catalogue: Catalogue | None = None, section: Mapping[str, Any] | None = None) -> None:
        super().__init__(catalogue, section)
        self.reads: list[tuple[tuple[str, ...], float]] = []

    async def write(self, tag: str, value: Value, origin: Origin, *more: Any, **named: Any) -> Outcome:
        drive, _, name = tag.partition(".")
        info = next(d for d in self.catalogue.drives if d.name == drive)
        point = next((p for p in info.points if p.name == name), None)
        if point is None:
            return await super().write(tag, value, origin, *more, **named)
        if point.role is None or not origin.role.covers(point.role):
            return _refused(Cause.NO_RIGHTS)
        if _is_wrong(value, point.type):
            return _refused(Cause.WRONG_TYPE)
        return await super().write(tag, value, origin, *more, **named)

    async def command(
        self, drive: str, name: str, args: Mapping[str, Value], *more: Any, **named: Any
    ) -> Outcome:
        info = next(owner for owner in self.catalogue.owners if owner.name == drive)
        command = next((c for c in info.commands if c.name == name), None)
        if command is None:
            return await super().command(drive, name, args, *more, **named)
        if set(args) != {arg.name for arg in command.args}:
            return _refused(Cause.WRONG_ARGUMENTS)
        if any(_is_wrong(args[arg.name], arg.type) for arg in command.args):
            return _refused(Cause.WRONG_TYPE)
        return await super().command(drive, name, args, *more, **named)


@dataclass
class Running:
    """An adapter that runs, with its bridge and files."""

    bridge: JudgingBridge
    url: str
    folder: Path


@contextlib.asynccontextmanager
async def running(folder: Path, catalogue: Catalogue | None = None, **section: Any) -> AsyncIterator[Running]:
    """An adapter with three users; ``section`` overrides parts of the configuration."""
    users = folder / "users.json"
    with patch("gateway.users.COST", CHEAP):
        for role in (Role.VIEWER, Role.OPERATOR, Role.ENGINEER):
            add_user(users, role.value, role, PASSWORD)
    whole: dict[str, Any] = {
        "endpoint": "opc.tcp://127.0.0.1:0",
        "security": ["none", "sign_and_encrypt"],
        "anonymous": True,
        "users_file": str(users),
        "certificates": str(folder / "certificates"),
    }
    bridge = JudgingBridge(catalogue, whole | section)
    async with listening(bridge) as adapter:
        work = [asyncio.create_task(part) for part in _parts(adapter)]
        try:
            yield Running(bridge, adapter.url, folder)
        finally:
            for task in work:
                task.cancel()
            await asyncio.gather(*work, return_exceptions=True)


def _parts(adapter: Adapter) -> tuple[Coroutine[Any, Any, None], ...]:
    return adapter.follow(), adapter.keep_demands(), adapter.keep_leases()


def client_of(gateway: Running, user: str = "", password: str = PASSWORD) -> Client:
    """A client, not yet connected; without a user it is anonymous. It tells the server its time-out."""
    client = Client(gateway.url, timeout=10)
    client.session_timeout = 5_000
    if user:
        client.set_user(user)
        client.set_password(password)
    return client


def node(client: Client, name: str) -> Node:
    """The node of a tag, command or drive."""
    return client.get_node(ua.NodeId(name, 2))


async def write(client: Client, tag: str, value: ua.Variant | ua.DataValue) -> None:
    """Write as plain clients do, without a timestamp (asyncua's own ``write_value`` sends one)."""
    data = value if isinstance(value, ua.DataValue) else ua.DataValue(value)
    await node(client, tag).write_attribute(ua.AttributeIds.Value, data)


def double(value: float) -> ua.Variant:
    """A Double."""
    return ua.Variant(value, ua.VariantType.Double)


def good(tag: str, value: Value, *, text: str | None = None, at: int | None = None) -> Sample:
    """A good sample, of now if ``at`` is not given."""
    return Sample(tag, value, Quality.GOOD, at or time.time_ns(), text=text)


async def eventually(condition: Callable[[], bool], seconds: float = 10.0) -> None:
    """Wait until the condition holds; fail when it does not in time."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "did not happen in time"
        await asyncio.sleep(0.01)


async def subscribe(client: Client, interval: float) -> tuple[int, Collector]:
    """A bare subscription: its number, and what arrives for its items."""
    params = ua.CreateSubscriptionParameters(interval, 1000, 10, 0, True, 0)
    collector = Collector()
    result = await client.uaclient.create_subscription(params, collector)
    return result.SubscriptionId, collector


async def monitor(
    client: Client, number: int, tag: str = FREQUENCY, *, interval: float = 100.0, **more: Any
) -> ua.MonitoredItemCreateResult:
    """Create one monitored item with any parameters."""
    item = ua.MonitoredItemCreateRequest()
    item.ItemToMonitor = ua.ReadValueId(NodeId=ua.NodeId(tag, 2), AttributeId=ua.AttributeIds.Value)
    item.MonitoringMode = more.pop("mode", ua.MonitoringMode.Reporting)
    item.RequestedParameters.SamplingInterval = interval
    item.RequestedParameters.QueueSize = more.pop("queue", 1)
    item.RequestedParameters.Filter = more.pop("filter", None)
    params = ua.CreateMonitoredItemsParameters()
    params.SubscriptionId = number
    params.ItemsToCreate = [item]
    (result,) = await client.uaclient.create_monitored_items(params)
    return result


class Collector:
    """Keeps what a subscription delivers."""

    def __init__(self) -> None:
        self.values: list[ua.DataValue] = []

    def __call__(self, result: ua.PublishResult) -> None:
        for data in result.NotificationMessage.NotificationData or ():
            self.values += [item.Value for item in data.MonitoredItems]

    @property
    def contents(self) -> list[Any]:
        """The values alone."""
        return [value.Value.Value if value.Value else None for value in self.values]

    @property
    def codes(self) -> list[str]:
        """The names of the StatusCodes."""
        return [value.StatusCode.name for value in self.values]
