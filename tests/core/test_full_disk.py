"""R2 on a real disk: a core whose journal cannot grow, or is taken away, and gets it back."""

from __future__ import annotations

import asyncio
import errno
import os
import resource
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from gateway.bridge.api import BridgeError
from gateway.bridge.client import SocketBridge, connect_path
from gateway.bridge.place import socket_path
from gateway.core.audit import check, passages
from gateway.core.direct import open_core
from gateway.core.disk import Folder
from gateway.tag import Cause, Origin, Outcome, Quality, Role, Verdict
from tests.core.plant import load, simulated, write_site
from tests.core.test_process import core_process

ANNA = Origin(through="cli", who="anna", role=Role.ADMIN)
TAG = "fan-1.frequency_command"
PATIENCE = 60.0
UNLIMITED = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)


@dataclass
class Plant:
    """A running motor and the core that runs it."""

    bridge: SocketBridge
    data: Path
    pid: int

    async def write(self, value: float) -> Outcome:
        return await self.bridge.write(TAG, value, ANNA)

    async def stop(self) -> Outcome:
        return await self.bridge.command("fan-1", "stop", {}, ANNA)

    async def until_journal(self, well: bool) -> str:
        async with asyncio.timeout(PATIENCE):
            while (not (said := (await self.bridge.health()).journal)) is not well:
                await asyncio.sleep(0.02)
        return said

    def outcomes(self) -> list[str]:
        entries = [passage.line.entry or {} for passage in passages(Folder(self.data))]
        return [entry["outcome"]["verdict"] for entry in entries if entry.get("kind") == "outcome"]


@pytest.fixture
async def plant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Plant]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    site_file = write_site(tmp_path)
    site = load(site_file)
    with simulated(site):
        async with core_process(site_file) as core:
            bridge = await connect_path(socket_path(site.data))
            try:
                await until_line_up(bridge)
                run = await bridge.command("fan-1", "run_forward", {"frequency": 3.0}, ANNA)
                assert run.verdict is Verdict.CONFIRMED, run
                yield Plant(bridge, site.data, core.process.pid)
            finally:
                await bridge.close()


async def until_line_up(bridge: SocketBridge) -> None:
    """The core answers before its port is open; a command would be told that the line is down."""
    async with asyncio.timeout(PATIENCE):
        while not (await bridge.health()).lines[0].up:
            await asyncio.sleep(0.02)


async def test_r2_a_file_that_cannot_grow(plant: Plant) -> None:
    [journal] = plant.data.glob("journal-*.jsonl")
    resource.prlimit(plant.pid, resource.RLIMIT_FSIZE, (journal.stat().st_size + 100, UNLIMITED[1]))
    refused = await plant.write(30.0)
    assert (refused.verdict, refused.cause) == (Verdict.REFUSED, Cause.JOURNAL)
    assert "too large" in await plant.until_journal(well=False)
    assert [alarm.key for alarm in (await plant.bridge.health()).alarms] == ["_gateway.journal"]
    assert (await plant.write(0.0)).verdict is Verdict.CONFIRMED
    assert (await plant.stop()).verdict is Verdict.CONFIRMED
    assert plant.outcomes() == ["confirmed"]
    resource.prlimit(plant.pid, resource.RLIMIT_FSIZE, UNLIMITED)
    await plant.until_journal(well=True)
    assert (await plant.write(30.0)).verdict is Verdict.CONFIRMED
    await plant.until_journal(well=True)
    assert plant.outcomes()[:4] == ["confirmed", "refused", "confirmed", "confirmed"]
    assert check(Folder(plant.data)).breaks == []


async def test_r2_a_core_starts_on_a_disk_that_became_read_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing can be put on record, so nothing is written; but drives are watched, and can be stopped."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    site = load(write_site(tmp_path))
    (site.data).mkdir()
    (site.data / "lock").touch()
    opened, write = Path.open, os.O_APPEND | os.O_CREAT
    real = os.open

    def open_path(path: Path, mode: str = "r", *more: Any, **others: Any) -> Any:
        if path.parent == site.data and "a" in mode:
            raise OSError(errno.EROFS, "Read-only file system")
        return opened(path, mode, *more, **others)

    def open_file(path: Any, flags: int, *more: Any) -> int:
        if Path(path).parent == site.data and flags & write:
            raise OSError(errno.EROFS, "Read-only file system")
        return real(path, flags, *more)

    monkeypatch.setattr(Path, "open", open_path)
    monkeypatch.setattr(os, "open", open_file)
    with simulated(site):
        async with open_core(site) as bridge:
            [sample] = await bridge.read(["fan-1.output_frequency"])
            assert sample.quality is Quality.GOOD
            refused = await bridge.write(TAG, 30.0, ANNA)
            assert (refused.verdict, refused.cause) == (Verdict.REFUSED, Cause.JOURNAL)
            assert "Read-only" in refused.reason
            assert (await bridge.command("fan-1", "stop", {}, ANNA)).verdict is Verdict.CONFIRMED


async def test_h3_a_core_does_not_start_when_it_cannot_read_what_it_must_remember(tmp_path: Path) -> None:
    site = load(write_site(tmp_path))
    (site.data / "journal-000000000001.jsonl").mkdir(parents=True)
    with pytest.raises(BridgeError, match="the journal cannot be read"):
        async with open_core(site):
            pass


async def test_r2_a_folder_that_is_taken_away(plant: Plant) -> None:
    away = plant.data.with_name("away")
    plant.data.rename(away)
    refused = await plant.write(30.0)
    assert (refused.verdict, refused.cause) == (Verdict.REFUSED, Cause.JOURNAL)
    await plant.until_journal(well=False)
    assert (await plant.stop()).verdict is Verdict.CONFIRMED
    assert not plant.data.exists()
    away.rename(plant.data)
    await plant.until_journal(well=True)
    assert (await plant.write(30.0)).verdict is Verdict.CONFIRMED
    assert {"refused", "confirmed"} <= set(plant.outcomes())


async def test_r2_a_journal_that_is_deleted_is_begun_anew_and_an_alarm_says_so(plant: Plant) -> None:
    for journal in plant.data.glob("journal-*.jsonl"):
        journal.unlink()
    refused = await plant.write(30.0)
    assert (refused.verdict, refused.cause) == (Verdict.REFUSED, Cause.JOURNAL)
    await plant.until_journal(well=True)
    assert (await plant.write(30.0)).verdict is Verdict.CONFIRMED
    [alarm] = (await plant.bridge.health()).alarms
    assert (alarm.key, alarm.cleared > 0) == ("_gateway.journal", True)
    assert "somebody else" in alarm.text
    checked = check(Folder(plant.data))
    assert checked.breaks == []
    assert checked.first is not None
    assert checked.first.n > 1, "what was there before is missed"
