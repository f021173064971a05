"""Brokers and a running adapter."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from gateway.northbound.mqtt import link
from gateway.northbound.mqtt.service import serve
from tests.fakes import FakeBridge
from tests.mqtt.brokers import MOSQUITTO, BrokerProcess


@pytest.fixture(params=["nats", pytest.param("mosquitto", marks=pytest.mark.needs_mosquitto)])
def broker(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[BrokerProcess]:
    if request.param == "mosquitto" and MOSQUITTO is None:
        pytest.skip("Debian's mosquitto is not installed")
    process = BrokerProcess(request.param, tmp_path)
    process.start()
    yield process
    process.kill()


@pytest.fixture(autouse=True)
def short_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reconnect quickly."""
    monkeypatch.setattr(link, "FIRST_PAUSE", 0.05)
    monkeypatch.setattr(link, "LONGEST_PAUSE", 0.2)


def section(port: int, **changes: Any) -> dict[str, Any]:
    """A section as the core hands it over."""
    return {
        "name": "mqtt",
        "broker": f"mqtt://127.0.0.1:{port}",
        "user": None,
        "password_file": None,
        "ca_file": None,
        "client_id": "gw1",
        "commands": {"role": "operator"},
        "publish": None,
        "data": "data",
    } | changes


@asynccontextmanager
async def adapter(bridge: FakeBridge) -> AsyncIterator[asyncio.Event]:
    """The adapter, running; gives the event that stops it."""
    stop = asyncio.Event()
    task = asyncio.create_task(serve(bridge, stop))
    try:
        yield stop
    finally:
        stop.set()
        async with asyncio.timeout(5):
            await task
