"""A supervisor over stand-ins, and ways to watch it."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

from gateway.mapping.profile import SerialFormat
from gateway.mapping.site import LineConfig, Rs485, Site
from gateway.supervisor import Supervisor

HERE = Path(__file__).parent


def small_site(folder: Path, port: str = "/dev/null") -> Site:
    """A site with one line, OPC UA and two brokers."""
    line = LineConfig(
        name="north",
        port=port,
        framing="rtu",
        baud=9600,
        format=SerialFormat(8, "N", 2),
        rs485=Rs485(),
        drives=(),
    )
    return Site(
        site="plant7",
        gateway="gw1",
        path=folder / "site.yaml",
        lines=(line,),
        rates={"fast": 0.2, "normal": 1.0, "slow": 30.0},
        writes_enabled=True,
        data=folder / "data",
        opcua={"endpoint": "opc.tcp://127.0.0.1:4840"},
        mqtt=(
            {"broker": "mqtt://127.0.0.1:1883"},
            {"broker": "mqtt://127.0.0.1:1884", "commands": {"role": "operator"}},
        ),
        digest="0" * 64,
    )


class Stage:
    """Implements `gateway.supervise.programs.Programs` with stand-ins that write down what they do."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(exist_ok=True)
        self._notes = folder / "notes"
        self._notes.touch()
        self.ports: Mapping[str, str] = {}
        self.core_words: tuple[str, ...] = ()
        self.adapter_words: tuple[str, ...] = ()

    @property
    def notes(self) -> list[str]:
        return self._notes.read_text().splitlines()

    def core(self, control: int, ports: Mapping[str, str]) -> Sequence[str]:
        self.ports = ports
        return self._run("fake_core.py", str(control), *self.core_words)

    def adapter(self, kind: str, bridge: int) -> Sequence[str]:
        return self._run("fake_adapter.py", str(bridge), *self.adapter_words)

    def simulator(self, line: str, folder: Path) -> Sequence[str]:
        return (sys.executable, "-S", str(HERE / "fake_simulator.py"), str(folder / line))

    def _run(self, script: str, *words: str) -> Sequence[str]:
        return (sys.executable, "-S", str(HERE / script), str(self._notes), *words)


@asynccontextmanager
async def performing(stage: Stage, site: Site) -> AsyncIterator[Supervisor]:
    """Run a supervisor until the block ends; whatever ended it early is raised."""
    supervisor = Supervisor(site, programs=stage)
    task = asyncio.create_task(supervisor.run())
    try:
        yield supervisor
    finally:
        supervisor.stop()
        await task


async def until(condition: Callable[[], bool], seconds: float = 10.0) -> None:
    """Return when the condition holds; fail when it does not within so many seconds."""
    async with asyncio.timeout(seconds):
        while not condition():
            await asyncio.sleep(0.01)


def lives(pid: int | None) -> bool:
    """True while a process runs (a zombie does not)."""
    try:
        return pid is not None and Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def kill(pid: int | None, number: int) -> None:
    """Send a signal to a process that must be there."""
    assert pid is not None
    os.kill(pid, number)
