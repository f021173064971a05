"""The supervisor over stand-in programs: real processes, real sockets, real signals."""

from __future__ import annotations

import asyncio
import json
import signal
import socket
import sys
import time
from pathlib import Path

import pytest

from gateway.bridge.place import lock_path
from gateway.supervise.keeper import StartRefusedError
from gateway.supervisor import Supervisor
from tests.supervisor.family import Stage, kill, lives, performing, small_site, until


@pytest.fixture
def stage(tmp_path: Path) -> Stage:
    return Stage(tmp_path / "stage")


async def test_core_is_told_of_each_adapter(stage: Stage, tmp_path: Path) -> None:
    async with performing(stage, small_site(tmp_path)) as supervisor:
        await asyncio.wait_for(supervisor.ready.wait(), 10)
        await until(lambda: sum(note.startswith("given") for note in stage.notes) == 3)
    headers = [json.loads(note.removeprefix("given ")) for note in stage.notes if note.startswith("given")]
    assert sorted(headers, key=str) == [
        {"adapter": "mqtt", "index": 0, "ceiling": "viewer"},
        {"adapter": "mqtt", "index": 1, "ceiling": "operator"},
        {"adapter": "opcua", "ceiling": "admin"},
    ]


async def test_a_killed_adapter_returns_and_the_others_stay(stage: Stage, tmp_path: Path) -> None:
    async with performing(stage, small_site(tmp_path)) as supervisor:
        await asyncio.wait_for(supervisor.ready.wait(), 10)
        opcua, *mqtt = supervisor.adapters
        before = [supervisor.core.pid, *(adapter.pid for adapter in mqtt)]
        old = opcua.pid
        kill(old, signal.SIGKILL)
        await until(lambda: opcua.pid not in (None, old))
        assert [supervisor.core.pid, *(adapter.pid for adapter in mqtt)] == before


async def test_a_killed_core_returns_with_all_adapters(stage: Stage, tmp_path: Path) -> None:
    async with performing(stage, small_site(tmp_path)) as supervisor:
        await asyncio.wait_for(supervisor.ready.wait(), 10)
        old = [supervisor.core.pid, *(adapter.pid for adapter in supervisor.adapters)]
        kill(supervisor.core.pid, signal.SIGKILL)
        await until(lambda: sum(note.startswith("given") for note in stage.notes) == 6)
        await until(lambda: all(adapter.alive.is_set() for adapter in supervisor.adapters))
        new = [supervisor.core.pid, *(adapter.pid for adapter in supervisor.adapters)]
        assert not set(old) & set(new)


async def test_stop_takes_adapters_before_the_core(stage: Stage, tmp_path: Path) -> None:
    async with performing(stage, small_site(tmp_path)) as supervisor:
        await asyncio.wait_for(supervisor.ready.wait(), 10)
        await until(lambda: stage.notes.count("adapter started") == 3)
    assert stage.notes[-4:] == ["adapter stopped"] * 3 + ["core stopped"]


async def test_deaf_adapters_do_not_hold_the_end_up(stage: Stage, tmp_path: Path) -> None:
    stage.adapter_words = ("deaf",)
    async with performing(stage, small_site(tmp_path)) as supervisor:
        await until(lambda: stage.notes.count("adapter started") == 3)
        pids = [adapter.pid for adapter in supervisor.adapters]
        asked = time.monotonic()
    assert time.monotonic() - asked < 2.0
    assert not any(lives(pid) for pid in pids)


async def test_a_simulated_line_is_there_before_the_core(stage: Stage, tmp_path: Path) -> None:
    site = small_site(tmp_path, port="simulated:")
    link = site.data / "simulated" / "north"
    link.parent.mkdir(parents=True)
    link.symlink_to(tmp_path / "left over from a run before")
    async with performing(stage, site) as supervisor:
        await asyncio.wait_for(supervisor.ready.wait(), 10)
        assert stage.ports == {"north": str(link)}
        assert link.exists()


async def test_a_port_given_by_hand_needs_no_simulator(stage: Stage, tmp_path: Path) -> None:
    supervisor = Supervisor(small_site(tmp_path, port="simulated:"), {"north": "/dev/ttyX"}, programs=stage)
    assert supervisor.helpers == []


async def test_exit_code_3_of_the_core_is_final(stage: Stage, tmp_path: Path) -> None:
    stage.core_words = ("3",)
    with pytest.raises(StartRefusedError, match="cannot be had"):
        await asyncio.wait_for(Supervisor(small_site(tmp_path), programs=stage).run(), 10)


async def test_a_core_that_dies_early_is_tried_again(stage: Stage, tmp_path: Path) -> None:
    stage.core_words = ("1",)
    async with performing(stage, small_site(tmp_path)) as supervisor:
        stage.core_words = ()
        await asyncio.wait_for(supervisor.ready.wait(), 10)


async def test_another_gateway_on_the_data_folder_is_seen_first(stage: Stage, tmp_path: Path) -> None:
    import fcntl

    site = small_site(tmp_path)
    site.data.mkdir()
    with lock_path(site.data).open("wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(StartRefusedError, match="already running"):
            await Supervisor(site, programs=stage).run()
    assert stage.notes == []


async def test_systemd_is_told(stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        async with performing(stage, small_site(tmp_path)) as supervisor:
            await asyncio.wait_for(supervisor.ready.wait(), 10)
            assert systemd.recv(64) == b"READY=1"
        assert systemd.recv(64) == b"STOPPING=1"


async def test_children_die_with_a_killed_supervisor(tmp_path: Path) -> None:
    script = Path(__file__).with_name("run_family.py")
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        str(script),
        str(tmp_path),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
    )
    try:
        assert process.stdout is not None
        pids = [int(word) for word in (await asyncio.wait_for(process.stdout.readline(), 20)).split()]
        assert len(pids) == 4
        assert all(lives(pid) for pid in pids)
    finally:
        process.kill()
        await process.wait()
    await until(lambda: not any(lives(pid) for pid in pids), 2.0)
