"""The adapter as a process, its end in every way, and a change of its configuration."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import msgspec
import pytest

from gateway.bridge.api import API_VERSION, BridgeError, Replaced
from gateway.bridge.messages import Promised, Watch, Welcome, body_length, pack, unpack_request
from gateway.northbound.mqtt.__main__ import BRIDGE_CLOSED, UNUSABLE
from gateway.northbound.mqtt.service import serve
from gateway.tag import Quality, Sample
from tests.fakes import FakeBridge, small_catalogue
from tests.mqtt.brokers import BrokerProcess
from tests.mqtt.conftest import adapter, section
from tests.mqtt.spy import Spy

GATEWAY = "plant7/_gateway/gw1/status"
FREQUENCY = "plant7/fan-1/state/output_frequency"


async def play_core(ours: socket.socket, settings: dict[str, Any]) -> None:
    """The core's side of the socket: a welcome, and a promise for every watch."""
    reader, writer = await asyncio.open_unix_connection(sock=ours)
    try:
        while True:
            request = unpack_request(await reader.readexactly(body_length(await reader.readexactly(4))))
            if isinstance(request, Watch):
                writer.write(pack(Promised(request.id, dict.fromkeys(request.wants, 1.0))))
            else:
                writer.write(pack(Welcome(API_VERSION, settings, small_catalogue())))
    except asyncio.IncompleteReadError:
        pass
    finally:
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()


@asynccontextmanager
async def process(
    settings: dict[str, Any],
) -> AsyncIterator[tuple[asyncio.subprocess.Process, asyncio.Task[None]]]:
    """The adapter's process, and the task that plays its core."""
    ours, theirs = socket.socketpair()
    command = (sys.executable, "-m", "gateway.northbound.mqtt", "--fd", str(theirs.fileno()))
    child = await asyncio.create_subprocess_exec(*command, pass_fds=(theirs.fileno(),))
    theirs.close()
    core = asyncio.create_task(play_core(ours, settings))
    try:
        yield child, core
    finally:
        with contextlib.suppress(ProcessLookupError):
            child.kill()
        await child.wait()
        core.cancel()
        await asyncio.wait((core,))


async def ended(child: asyncio.subprocess.Process) -> int:
    async with asyncio.timeout(10):
        return await child.wait()


async def test_killed_it_leaves_its_will(broker: BrokerProcess) -> None:
    async with Spy(broker.port, broker.version) as spy, process(section(broker.port)) as (child, _):
        await spy.until(GATEWAY, lambda d: d["status"] == "online")
        child.kill()
        gone = await spy.until(GATEWAY, lambda d: d["status"] == "offline")
        assert gone.json["reason"] == "connection lost"


async def test_terminated_it_ends_well(broker: BrokerProcess) -> None:
    async with Spy(broker.port, broker.version) as spy, process(section(broker.port)) as (child, _):
        await spy.until(GATEWAY, lambda d: d["status"] == "online")
        begun = time.monotonic()
        child.send_signal(signal.SIGTERM)
        assert await ended(child) == 0
        assert time.monotonic() - begun < 2.0
        gone = await spy.until(GATEWAY, lambda d: d["status"] == "offline")
        assert gone.json["reason"] == "the gateway is being stopped"


async def test_without_its_core_it_says_so_and_ends(broker: BrokerProcess) -> None:
    async with Spy(broker.port, broker.version) as spy, process(section(broker.port)) as (child, core):
        await spy.until(GATEWAY, lambda d: d["status"] == "online")
        core.cancel()
        assert await ended(child) == BRIDGE_CLOSED
        await spy.until(GATEWAY, lambda d: "core" in d.get("reason", ""))


async def test_a_section_that_cannot_be_used() -> None:
    async with process(section(1, broker="http://nowhere")) as (child, _):
        assert await ended(child) == UNUSABLE


async def test_when_the_bridge_closes_no_value_looks_live(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy:
        task = asyncio.create_task(serve(bridge, asyncio.Event()))
        bridge.push(Sample("fan-1.output_frequency", 50.0, Quality.GOOD, time.time_ns()))
        await spy.until(FREQUENCY, lambda d: d["v"] == 50.0)
        await bridge.close()
        with pytest.raises(BridgeError):
            await task
        await spy.until(FREQUENCY, lambda d: d["v"] is None and "core" in d["reason"])
        status = await spy.until("plant7/fan-1/status", lambda d: d["status"] == "offline")
        assert "core" in status.json["reason"]


async def test_a_new_configuration_takes_the_place_of_the_old(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        first = await spy.until(GATEWAY, lambda d: d["status"] == "online")
        await spy.until("plant7/fan-1/state/running")
        bridge.section = section(broker.port, publish=[{"points": ["output_*"], "rate": 2.0}])
        bridge.catalogue = msgspec.structs.replace(bridge.catalogue, generation=2)
        bridge.push_update(Replaced(2))
        epoch = first.json["epoch"]
        await spy.until(GATEWAY, lambda d: d["status"] == "online" and d["epoch"] != epoch)
        assert bridge.wants == {"fan-1.output_frequency": 2.0, "fan-1.output_voltage": 2.0}
        async with Spy(broker.port, broker.version) as late:
            await late.until(GATEWAY, lambda d: d["status"] == "online")
            await late.until("plant7/fan-1/state/output_voltage")
            bridge.push(Sample("fan-1.output_frequency", 7.0, Quality.GOOD, time.time_ns()))
            await late.until(FREQUENCY, lambda d: d["v"] == 7.0)
            assert "plant7/fan-1/state/running" not in {seen.topic for seen in late.seen}
