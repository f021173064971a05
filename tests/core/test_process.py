"""The core as a process: sockets, lock, signals, a pty that goes and comes."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import socket
import stat
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from gateway.bridge.api import Batch, BridgeError
from gateway.bridge.client import SocketBridge, connect_fd, connect_path
from gateway.bridge.place import running, socket_path
from gateway.core.direct import open_core
from gateway.tag import Cause, Origin, Quality, Role, Verdict
from tests.core.plant import load, simulated, write_site

ENGINEER = Origin(through="cli", who="erika", role=Role.ENGINEER)
STEP_1 = "05 10 00 01 00 02 04 00 01 17 70 78 87"


class CoreProcess:
    """``python -m gateway.core`` with the supervisor's end of its control socket."""

    def __init__(self, process: asyncio.subprocess.Process, control: socket.socket) -> None:
        self.process = process
        self.control = control

    def adapter(self, **header: object) -> int:
        """Hand over an adapter; returns the adapter's end of the pair."""
        ours, theirs = socket.socketpair()
        with theirs:
            socket.send_fds(self.control, [json.dumps(header).encode()], [theirs.fileno()])
        return ours.detach()


@contextlib.asynccontextmanager
async def core_process(site_file: Path) -> AsyncIterator[CoreProcess]:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours:
        with theirs:
            argv = ["-m", "gateway.core", "--site", str(site_file), "--control-fd", str(theirs.fileno())]
            process = await asyncio.create_subprocess_exec(sys.executable, *argv, pass_fds=[theirs.fileno()])
        ours.setblocking(False)
        ready = await asyncio.wait_for(asyncio.get_running_loop().sock_recv(ours, 4096), 15)
        assert json.loads(ready) == {"ready": True}
        try:
            yield CoreProcess(process, ours)
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()


async def first_good(bridge: SocketBridge, tag: str) -> object:
    async with asyncio.timeout(10):
        async for update in bridge.updates():
            if isinstance(update, Batch):
                for sample in update.samples:
                    if sample.tag == tag and sample.quality is Quality.GOOD:
                        return sample.value
    raise AssertionError("the updates ended")


@pytest.fixture
def site_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return write_site(tmp_path)


async def test_the_command_lines_socket_reads_watches_and_commands(site_file: Path) -> None:
    site = load(site_file)
    with simulated(site) as line:
        async with core_process(site_file):
            assert running(site.data)
            path = socket_path(site.data)
            assert stat.S_IMODE(path.stat().st_mode) == 0o600
            bridge = await connect_path(path)
            assert bridge.catalogue.drives[0].name == "fan-1"
            assert await bridge.watch({"fan-1.output_frequency": 0.2}) == {"fan-1.output_frequency": 0.2}
            assert await first_good(bridge, "fan-1.output_frequency") == 0.0
            outcome = await bridge.command("fan-1", "run_forward", {"frequency": 60.0}, ENGINEER)
            assert outcome.verdict is Verdict.CONFIRMED, outcome
            assert STEP_1 in [frame.data.hex(" ").upper() for frame in line.log]
            assert STEP_1 in [f.data.hex(" ").upper() for f in (await bridge.trace("north")).frames]
            health = await bridge.health()
            assert health.drives == {"fan-1": True}
            assert health.lines[0].up
            await bridge.close()


async def test_an_adapter_gets_its_section_and_its_ceiling(site_file: Path) -> None:
    site_file.write_text(site_file.read_text() + "mqtt:\n  - broker: mqtt://127.0.0.1:1883\n")
    with simulated(load(site_file)):
        async with core_process(site_file) as core:
            fd = core.adapter(adapter="mqtt", index=0, broker="mqtt://127.0.0.1:1999", ceiling="viewer")
            bridge = await connect_fd(fd, "mqtt 0")
            assert bridge.section["broker"] == "mqtt://127.0.0.1:1999"
            outcome = await bridge.write("fan-1.frequency_command", 10.0, ENGINEER)
            assert outcome.cause is Cause.NO_RIGHTS
            await bridge.close()


async def test_a_second_core_on_the_same_data_is_refused(site_file: Path) -> None:
    async with core_process(site_file):
        argv = ["-m", "gateway.core", "--site", str(site_file)]
        second = await asyncio.create_subprocess_exec(sys.executable, *argv, stderr=asyncio.subprocess.PIPE)
        _, errors = await second.communicate()
        assert second.returncode == 3
        assert b"another gateway runs" in errors
        with pytest.raises(BridgeError, match="another gateway runs"):
            async with open_core(load(site_file)):
                pass


async def test_sigterm_ends_it_cleanly_within_two_seconds(site_file: Path) -> None:
    site = load(site_file)
    with simulated(site):
        async with core_process(site_file) as core:
            bridge = await connect_path(socket_path(site.data))
            core.process.send_signal(signal.SIGTERM)
            assert await asyncio.wait_for(core.process.wait(), 2.0) == 0
            with pytest.raises(BridgeError):
                await bridge.health()
            assert not running(site.data)
            assert not socket_path(site.data).exists()
            await bridge.close()


async def test_the_core_ends_when_its_supervisor_is_gone(site_file: Path) -> None:
    async with core_process(site_file) as core:
        core.control.close()
        assert await asyncio.wait_for(core.process.wait(), 3.0) == 0


async def test_a_pty_that_goes_and_comes_back_is_used_again(site_file: Path) -> None:
    site = load(site_file)
    with simulated(site) as line:
        async with core_process(site_file):
            bridge = await connect_path(socket_path(site.data))
            await bridge.watch({"fan-1.output_frequency": 0.2})
            await first_good(bridge, "fan-1.output_frequency")
            line.close()
            async with asyncio.timeout(10):
                while (await bridge.health()).lines[0].up:
                    await asyncio.sleep(0.05)
            line.start()
            async with asyncio.timeout(15):
                while (await bridge.read(["fan-1.output_frequency"]))[0].quality is not Quality.GOOD:
                    await asyncio.sleep(0.05)
            await bridge.close()


async def test_a_core_of_ones_own_for_a_single_command(site_file: Path) -> None:
    site = load(site_file)
    with simulated(site):
        async with open_core(site) as bridge:
            [sample] = await bridge.read(["fan-1.output_frequency"])
            assert sample.value == 0.0
            outcome = await bridge.write("fan-1.frequency_command", 12.5, ENGINEER)
            assert (outcome.verdict, outcome.value) == (Verdict.CONFIRMED, 12.5)
    [journal] = site.data.glob("journal-*.jsonl")
    kinds = [json.loads(line)["kind"] for line in journal.read_text().splitlines()]
    assert kinds == ["snapshot", "boot", "intent", "outcome", "end"]


async def test_nonsense_on_the_socket_ends_only_that_connection(site_file: Path) -> None:
    site = load(site_file)
    with simulated(site):
        async with core_process(site_file):
            good = await connect_path(socket_path(site.data))
            for nonsense in (b"\xff" * 64, b"\0\0\0\4abcd", b"\0\0\0\1\x80", os.urandom(4096)):
                reader, writer = await asyncio.open_unix_connection(socket_path(site.data))
                writer.write(nonsense)
                await asyncio.wait_for(reader.read(), 5)
                writer.close()
            assert (await good.health()).drives is not None
            await good.close()


async def test_a_watcher_that_does_not_listen_holds_up_nobody(site_file: Path) -> None:
    site = load(site_file)
    tags = [
        f"fan-1.{point.name}" for point in site.drives[0].profile.points.values() if point.group == "monitor"
    ]
    with simulated(site):
        async with core_process(site_file):
            deaf = socket.socket(socket.AF_UNIX)
            deaf.connect(str(socket_path(site.data)))
            from gateway.bridge.api import API_VERSION
            from gateway.bridge.messages import Hello, Watch, pack

            deaf.sendall(pack(Hello(API_VERSION, "deaf")) + pack(Watch(1, dict.fromkeys(tags, 0.01))))
            bridge = await connect_path(socket_path(site.data))
            for _ in range(20):
                [sample] = await asyncio.wait_for(bridge.read(["fan-1.output_frequency"]), 5)
                assert sample.quality is Quality.GOOD
            await bridge.close()
            deaf.close()
