"""The same seen by mqtt.js, which shares no code with paho or with us."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import time
from pathlib import Path
from typing import Any

import pytest

from gateway.tag import Outcome, Quality, Sample, Verdict
from tests.fakes import FakeBridge
from tests.mqtt.brokers import BrokerProcess
from tests.mqtt.conftest import adapter, section

CLIENTS = Path(__file__).parent.parent / "node"
SCRIPT = Path(__file__).parent / "client.mjs"
NODE = shutil.which("node")

pytestmark = [
    pytest.mark.needs_node,
    pytest.mark.skipif(NODE is None, reason="Node.js is not installed"),
    pytest.mark.skipif(
        not (CLIENTS / "node_modules" / "mqtt").is_dir(),
        reason="the npm package mqtt is not installed (npm ci in tests/node)",
    ),
]


async def run_client(broker: BrokerProcess) -> dict[str, Any]:
    """What the client saw; fails with its output if it did not see everything."""
    assert NODE is not None
    process = await asyncio.create_subprocess_exec(
        NODE,
        str(SCRIPT),
        f"mqtt://127.0.0.1:{broker.port}",
        str(broker.version),
        env={**os.environ, "CLIENTS": str(CLIENTS)},
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    out, errors = await process.communicate()
    assert process.returncode == 0, (out, errors)
    seen: dict[str, Any] = json.loads(out)
    return seen


async def test_an_independent_client_reads_writes_and_stops(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    bridge.outcome = Outcome(verdict=Verdict.CONFIRMED, value=12.5)
    async with adapter(bridge):
        bridge.push(Sample("fan-1.output_frequency", 49.98, Quality.GOOD, time.time_ns()))
        seen = await run_client(broker)
    assert seen["plant7/fan-1/state/output_frequency"]["v"] == 49.98
    assert seen["plant7/fan-1/meta"]["points"]["frequency_command"]["unit"] == "Hz"
    assert seen["plant7/fan-1/ack/frequency_command"]["id"] == "js-1"
    assert seen["plant7/fan-1/ack/frequency_command"]["v"] == 12.5
    assert seen["plant7/fan-1/ack/stop"]["verdict"] == "confirmed"
    assert bridge.writes[0][:2] == ("fan-1.frequency_command", 12.5)
    assert [command[1] for command in bridge.commands] == ["stop"]
