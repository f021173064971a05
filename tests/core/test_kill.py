"""R1, H3: killed at any moment, the gateway has on record what it sent, and sends nothing twice."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from gateway.bridge.client import connect_path
from gateway.bridge.place import socket_path
from gateway.core.audit import check, passages
from gateway.core.disk import Folder
from gateway.tag import Verdict
from tests.core.hammer import ANNA, hammered
from tests.core.plant import load, simulated, write_site
from tests.core.test_process import STEP_1, core_process


async def test_r1_h3_killed_again_and_again_under_load(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The chain is whole, no write frame is without its intent, no id is carried out twice."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert await hammered(tmp_path, writes=200, kills=3, drives=2, seed=7) == []


async def test_r1_as_many_intents_as_write_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At small scale; ``python -m tests.core.hammer --writes 100000`` does it at large."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert await hammered(tmp_path, writes=300, kills=0, drives=3, seed=7) == []


async def test_h3_killed_while_a_command_is_proved_on_a_simulated_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run is on the wire and not proved yet: after the restart it is unknown, and stays one run."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    site_file = write_site(tmp_path)
    site = load(site_file)
    with simulated(site) as line:

        def runs() -> int:
            return sum(frame.data.hex(" ").upper() == STEP_1 for frame in line.log)

        async with core_process(site_file):
            bridge = await connect_path(socket_path(site.data))
            asked = asyncio.create_task(
                bridge.command("fan-1", "run_forward", {"frequency": 60.0}, ANNA, id="r1")
            )
            async with asyncio.timeout(60):
                while not runs():
                    await asyncio.sleep(0.002)
        with pytest.raises(Exception, match="went away"):
            await asked
        await bridge.close()
        async with core_process(site_file):
            bridge = await connect_path(socket_path(site.data))
            again = await bridge.command("fan-1", "run_forward", {"frequency": 60.0}, ANNA, id="r1")
            assert again.verdict is Verdict.UNKNOWN
            stopped = await bridge.command("fan-1", "stop", {}, ANNA)
            assert stopped.verdict is Verdict.CONFIRMED
            await bridge.close()
        assert runs() == 1
    checked = check(Folder(site.data))
    assert (checked.breaks, len(checked.unended)) == ([], 1)
    outcomes = [
        p.line.entry["outcome"]["verdict"]
        for p in passages(Folder(site.data))
        if p.line.entry and p.line.entry["kind"] == "outcome"
    ]
    assert outcomes == ["unknown", "confirmed"]
