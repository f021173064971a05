"""Hammers a core with writes, kills it, and counts: what was on the wire against what is on record (R1, H3).

The core is a process of its own with a real journal; the drives count the frames that reach them. Run by hand
for as many writes as you like::

    python -m tests.core.hammer --writes 100000 --kills 20
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gateway.bridge.api import BridgeError
from gateway.bridge.client import SocketBridge, connect_path
from gateway.bridge.place import socket_path
from gateway.core.audit import check, passages
from gateway.core.disk import Folder
from gateway.tag import Origin, Outcome, Role, Verdict
from tests.core.fieldbus import PROFILE, TcpDrive, modbus_tcp

ANNA = Origin(through="cli", who="anna", role=Role.ADMIN)
START_SECONDS = 60.0
REPEATED = 1000
"""Commands asked for again after a kill, the latest: all of them younger than a minute."""
Words = tuple[str, tuple[int, ...]]
"""Drive and written words."""


def write_site(folder: Path, ports: list[int]) -> Path:
    """A site with one drive on each of these ports."""
    (folder / "bench.yaml").write_text(PROFILE)
    lines = "".join(
        f"  line-{n}: {{port: 'modbus://127.0.0.1:{port}', drives: "
        f"{{fan-{n}: {{profile: bench, unit: 5, control: {{lease: off}}}}}}}}\n"
        for n, port in enumerate(ports)
    )
    path = folder / "site.yaml"
    path.write_text(f"site: plant7\ngateway: gw1\nlines:\n{lines}writes: {{enabled: true}}\ndata: data\n")
    return path


@dataclass(slots=True)
class Hammer:
    """A site, its core, and everything that was asked of it: by id the drive, the value and the outcome."""

    folder: Path
    drives: list[TcpDrive]
    asked: dict[str, tuple[str, float, Outcome | None]] = field(default_factory=dict)
    kills: int = 0
    _process: asyncio.subprocess.Process | None = None

    @property
    def data(self) -> Path:
        """The data folder."""
        return self.folder / "data"

    async def start(self) -> SocketBridge:
        """Start the core and connect."""
        site = self.folder / "site.yaml"
        self._process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "gateway.core", "--site", str(site), stderr=asyncio.subprocess.DEVNULL
        )
        async with asyncio.timeout(START_SECONDS):
            while True:
                try:
                    return await connect_path(socket_path(self.data))
                except BridgeError:
                    await asyncio.sleep(0.01)

    async def kill(self) -> None:
        """As the power goes."""
        assert self._process is not None
        self._process.kill()
        await self._process.wait()
        self.kills += 1

    async def stop(self) -> None:
        """In good order."""
        assert self._process is not None
        self._process.terminate()
        await self._process.wait()

    async def write(self, bridge: SocketBridge, drive: int, ids: Iterator[int], most: int) -> None:
        """Write one value after another to a drive, until so many were asked for or the core is gone."""
        with contextlib.suppress(BridgeError):
            while len(self.asked) < most:
                number = next(ids)
                id, value = f"id-{number}", number % 6000 / 100 + 0.01
                self.asked[id] = (f"fan-{drive}", value, None)
                outcome = await bridge.write(f"fan-{drive}.frequency_command", value, ANNA, 5.0, id)
                self.asked[id] = (f"fan-{drive}", value, outcome)

    async def repeat(self, bridge: SocketBridge) -> list[str]:
        """Ask again for the latest, as an impatient client would: what was answered otherwise than before.
        (Their ids are still remembered; an id is another command's a minute after its outcome.)"""
        wrong = []
        for id, (drive, value, first) in list(self.asked.items())[-REPEATED:]:
            again = await bridge.write(f"{drive}.frequency_command", value, ANNA, 5.0, id)
            if again != first and again.verdict is not Verdict.UNKNOWN and first is not None:
                wrong.append(f"{id}: {first} and then {again}")
        return wrong

    def on_wire(self) -> Counter[Words]:
        """Every write frame that reached a drive."""
        return Counter(
            (f"fan-{n}", tuple(words))
            for n, drive in enumerate(self.drives)
            for _, words in drive.unit.writes
        )

    def entries(self) -> list[dict[str, Any]]:
        """Everything on record."""
        return [p.line.entry for p in passages(Folder(self.data)) if p.line.entry is not None]

    def faults(self) -> Iterator[str]:
        """What is wrong between wire and record."""
        checked = check(Folder(self.data))
        yield from (f"{b.file}:{b.line}: {b.problem}" for b in checked.breaks)
        entries = self.entries()
        unsent = {(e["ask"], e["frame"]) for e in entries if e["kind"] == "unsent"}
        intents = [e for e in entries if e["kind"] == "intent" and (e["ask"], e["frame"]) not in unsent]
        recorded = Counter((e["drive"], tuple(int(w[:-1], 16) for w in e["words"])) for e in intents)
        wire = self.on_wire()
        yield from (f"not on record: {frame}" for frame in (wire - recorded).elements())
        lost = (recorded - wire).total()
        if lost > self.kills * len(self.drives):
            yield f"{lost} frames are on record and were not sent; the core was killed {self.kills} times"
        ids = Counter(e["id"] for e in entries if e["kind"] == "intent" and "id" in e)
        yield from (f"{id} was sent {count} times" for id, count in ids.items() if count > 1)
        outcomes = Counter(e["ask"] for e in entries if e["kind"] == "outcome")
        yield from (f"ask {ask} has {count} outcomes" for ask, count in outcomes.items() if count > 1)
        yield from (f"ask {e['ask']} has none" for e in intents if e["ask"] not in outcomes)


@contextlib.asynccontextmanager
async def hammer(folder: Path, drives: int) -> AsyncIterator[Hammer]:
    """A site with so many drives, ready to start."""
    async with contextlib.AsyncExitStack() as stack:
        units = [await stack.enter_async_context(TcpDrive(modbus_tcp)) for _ in range(drives)]
        write_site(folder, [unit.port for unit in units])
        found = Hammer(folder, units)
        try:
            yield found
        finally:
            if found._process is not None and found._process.returncode is None:
                await found.kill()


async def hammered(folder: Path, writes: int, kills: int, drives: int, seed: int) -> list[str]:
    """So many writes with so many kills between them: everything that was wrong."""
    chance = random.Random(seed)
    ids = itertools.count()
    wrong: list[str] = []
    async with hammer(folder, drives) as plant:
        for life in range(kills + 1):
            bridge = await plant.start()
            if life:
                wrong += await plant.repeat(bridge)
            most = writes if life == kills else len(plant.asked) + chance.randint(1, writes // (kills + 1))
            tasks = [asyncio.create_task(plant.write(bridge, n, ids, most)) for n in range(drives)]
            if life < kills:
                while len(plant.asked) < most:
                    await asyncio.sleep(0.001)
                await asyncio.sleep(chance.uniform(0.0, 0.02))
                await plant.kill()
            await asyncio.gather(*tasks)
            await bridge.close()
        await plant.stop()
        return [*wrong, *plant.faults()]


def main() -> int:
    """Hammer by hand; the exit code is 1 if anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--writes", type=int, default=100_000)
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--drives", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        wrong = asyncio.run(hammered(Path(folder), args.writes, args.kills, args.drives, args.seed))
    took = time.monotonic() - begun
    print(*wrong[:20], sep="\n", end="\n" if wrong else "")
    print(f"{args.writes} writes, {args.kills} kills, {took:.0f} s: {len(wrong)} faults")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
