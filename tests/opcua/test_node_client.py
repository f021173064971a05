"""The same adapter seen by node-opcua, which shares no code with it."""

from __future__ import annotations

import asyncio
import json
import shutil
import time
from pathlib import Path
from typing import Any

import pytest

from tests.opcua.support import COMMAND, FREQUENCY, PASSWORD, Running, eventually, good

SCRIPT = Path(__file__).with_name("client.mjs")
MODULES = Path(__file__).parents[1] / "node" / "node_modules"
LONGEST = 60.0

pytestmark = [
    pytest.mark.asyncio(loop_scope="session"),
    pytest.mark.needs_node,
    pytest.mark.skipif(shutil.which("node") is None, reason="there is no Node.js here (apt install nodejs)"),
    pytest.mark.skipif(
        not (MODULES / "node-opcua").exists(), reason="node-opcua is not installed (npm ci in tests/node)"
    ),
]


async def start(gateway: Running, user: str, *steps: dict[str, Any]) -> asyncio.subprocess.Process:
    # ES modules are looked up beside the script, so it runs from a link in the modules' folder.
    link = gateway.folder / "client.mjs"
    if not link.exists():
        shutil.copy(SCRIPT, link)
        (gateway.folder / "node_modules").symlink_to(MODULES)
    return await asyncio.create_subprocess_exec(
        "node", str(link), gateway.url, user, PASSWORD, json.dumps(steps),
        stdout=asyncio.subprocess.PIPE, cwd=gateway.folder,
        env={"HOME": str(gateway.folder), "PATH": "/usr/local/bin:/usr/bin:/bin:" + _node_folder()},
    )  # fmt: skip


def _node_folder() -> str:
    return str(Path(shutil.which("node") or "").parent)


async def results(process: asyncio.subprocess.Process) -> list[Any]:
    """What the steps saw, in order; the library prints lines of its own between them."""
    output, _ = await asyncio.wait_for(process.communicate(), LONGEST)
    return [json.loads(line) for line in output.decode().splitlines() if line.startswith(("{", "[", '"'))]


async def run(gateway: Running, user: str, *steps: dict[str, Any]) -> list[Any]:
    return await results(await start(gateway, user, *steps))


async def test_an_operator_sees_writes_and_commands(gateway: Running) -> None:
    gateway.bridge.samples[FREQUENCY] = good(FREQUENCY, 12.5, at=1_700_000_000_123_000_000)
    gateway.bridge.delay = 0.2
    devices, parts, value, analog, written, refused, called, order = await run(
        gateway,
        "operator",
        {"do": "browse", "node": "ns=3;s=DeviceSet"},
        {"do": "browse", "children": "fan-1"},
        {"do": "read", "tag": FREQUENCY},
        {"do": "analog", "tag": COMMAND},
        {"do": "write", "tag": COMMAND, "value": 30.5},
        {"do": "write", "tag": FREQUENCY, "value": 30.5},
        {"do": "call", "drive": "fan-1", "command": "run_forward", "args": [60.0]},
        {"do": "both", "slow": {"tag": COMMAND, "value": 1.0}, "fast": {"tag": FREQUENCY}},
    )
    assert devices == ["2:fan-1"]
    assert {"3:ParameterSet", "3:MethodSet", "3:Identification", "3:monitor"} <= set(parts)
    assert value == {"value": 12.5, "type": "Double", "status": "Good", "time": "2023-11-14T22:13:20.123Z"}
    assert analog == {"low": 0, "high": 60, "unit": "Hz", "code": 4740186}
    assert (written, refused) == ("Good", "BadUserAccessDenied")
    assert called == {"status": "Good", "outputs": ["confirmed", ""]}
    assert order == ["read", "write"], "the slow write held up a read of its session"
    assert [(tag, value) for tag, value, *_ in gateway.bridge.writes] == [(COMMAND, 30.5), (COMMAND, 1.0)]
    assert [(name, args) for _, name, args, *_ in gateway.bridge.commands] == [
        ("run_forward", {"frequency": 60.0})
    ]


async def test_an_anonymous_reader_demands_and_changes_nothing(gateway: Running) -> None:
    process = await start(
        gateway,
        "-",
        {"do": "write", "tag": COMMAND, "value": 1.0},
        {"do": "call", "drive": "fan-1", "command": "stop"},
        {"do": "monitor", "tag": FREQUENCY, "interval": 70, "until": 55.5},
    )
    await eventually(lambda: gateway.bridge.wants == {FREQUENCY: 0.07}, LONGEST)
    sample = good(FREQUENCY, 55.5)
    gateway.bridge.push(sample)
    written, called, _, seen = await results(process)
    assert (written, called["status"]) == ("BadUserAccessDenied", "BadUserAccessDenied")
    assert gateway.bridge.writes == []
    assert gateway.bridge.commands == []
    assert (seen["value"], seen["status"], seen["revised"]) == (55.5, "Good", 100)
    moment = time.gmtime(sample.time // 10**9)
    assert seen["time"].startswith(time.strftime("%Y-%m-%dT%H:%M:%S", moment))
    await eventually(lambda: gateway.bridge.wants == {})


async def test_a_killed_client_wants_nothing_once_its_session_has_timed_out(gateway: Running) -> None:
    process = await start(gateway, "-", {"do": "monitor", "tag": FREQUENCY, "interval": 70, "until": None})
    await eventually(lambda: gateway.bridge.wants == {FREQUENCY: 0.07}, LONGEST)
    process.kill()
    await process.wait()
    # Its lifetime: 100 publishing intervals of 50 ms without a publish request.
    await eventually(lambda: gateway.bridge.wants == {}, LONGEST)
