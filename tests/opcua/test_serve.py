"""The life of the adapter process: how it starts, ends and tells why."""

from __future__ import annotations

import asyncio
import os
import socket
import time
from pathlib import Path

import pytest

from gateway.bridge.api import BridgeError, DriveState, Replaced
from gateway.northbound.opcua.__main__ import run
from gateway.northbound.opcua.server import serve
from gateway.northbound.opcua.settings import SettingsError
from tests.fakes import FakeBridge
from tests.opcua.support import client_of, eventually, running


def bridge_of(folder: Path, **section: object) -> FakeBridge:
    whole = {"endpoint": "opc.tcp://127.0.0.1:0", "certificates": str(folder)}
    return FakeBridge(section=whole | section)


async def test_it_stops_when_told(tmp_path: Path) -> None:
    stop = asyncio.Event()
    serving = asyncio.create_task(serve(bridge_of(tmp_path), stop))
    await eventually((tmp_path / "trusted").exists)
    stop.set()
    begun = time.monotonic()
    await asyncio.wait_for(serving, 10)
    assert time.monotonic() - begun < 5


async def test_a_core_that_goes_away_ends_it(tmp_path: Path) -> None:
    bridge = bridge_of(tmp_path)
    await bridge.close()
    with pytest.raises(BridgeError, match="went away"):
        await serve(bridge, asyncio.Event())


async def test_a_new_configuration_ends_it(tmp_path: Path) -> None:
    bridge = bridge_of(tmp_path)
    bridge.push_update(Replaced(generation=2))
    with pytest.raises(BridgeError, match="generation 2"):
        await serve(bridge, asyncio.Event())


async def test_wrong_settings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError):
        await serve(bridge_of(tmp_path, security=["perhaps"]), asyncio.Event())


async def test_a_port_that_is_taken_is_an_error(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        endpoint = f"opc.tcp://127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(OSError, match="address"):
            await serve(bridge_of(tmp_path, endpoint=endpoint), asyncio.Event())


async def test_without_a_core_the_process_asks_to_be_started_again() -> None:
    ours, theirs = socket.socketpair()
    theirs.close()
    assert await run(ours.detach()) == os.EX_TEMPFAIL


async def test_lost_drives_lower_the_service_level(tmp_path: Path) -> None:
    async with running(tmp_path) as gateway, client_of(gateway) as client:
        level = client.nodes.server.get_child("0:ServiceLevel")
        level_node = await level
        assert await level_node.read_value() == 255
        for up, expected in ((False, 1), (True, 255)):
            gateway.bridge.push_update(DriveState("fan-1", up=up, time=1))
            async with asyncio.timeout(5):
                while await level_node.read_value() != expected:
                    await asyncio.sleep(0.01)
