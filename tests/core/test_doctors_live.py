"""The doctor on real ptys: a core, a simulated line with an illness, and the diagnosis within ten seconds."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import monotonic

import pytest

from gateway.bridge.api import Bridge
from gateway.core.direct import open_core
from gateway.mapping.site import Site
from gateway.simulator.faults import Collision, CorruptByte, OtherSpeed
from gateway.simulator.live import SimulatedLine
from tests.core.plant import load
from tests.line.bench import frame

SOON = 10.0
TAGS = ("output_frequency", "output_current", "control_source", "running")


def site_of(folder: Path) -> Site:
    drives = "".join(f"      fan-{n}: {{profile: teco-7200gs, unit: {n}}}\n" for n in (1, 2, 3))
    (folder / "lines").mkdir()
    path = folder / "site.yaml"
    path.write_text(
        "site: plant7\ngateway: gw1\nlines:\n  north:\n    port: lines/north\n    serial: 9600 8N2\n"
        f"    drives:\n{drives}data: data\n"
    )
    return load(path)


def each(line: SimulatedLine, fault: object) -> None:
    for drive in line.drives.values():
        drive.faults.inject(fault, times=None)  # type: ignore[arg-type]


def off(line: SimulatedLine, *names: str) -> None:
    for name in names or line.drives:
        line.drives[name].connected = False


def nothing(line: SimulatedLine) -> None:
    pass


def noise(line: SimulatedLine) -> None:
    """One reply of one drive; each drive in its turn."""
    number = round(monotonic() / 0.4) % 3
    line.drives[f"fan-{number + 1}"].faults.inject(CorruptByte(3 + number, 0x08))


def stranger(line: SimulatedLine) -> None:
    line.intrude(frame(bytes((2, 3, 0, 0x20, 0, 2))))


Do = Callable[[SimulatedLine], None]
CASES: dict[str, tuple[dict[str, object], Do, Do]] = {
    "wrong_format": ({}, lambda line: each(line, OtherSpeed()), nothing),
    "all_silent": ({}, off, nothing),
    "drive_silent": ({}, lambda line: off(line, "fan-2"), nothing),
    "noise": ({}, nothing, noise),
    "foreign_master": ({}, nothing, stranger),
    "two_drives": ({"doubled": ("fan-2",)}, nothing, nothing),
    "two_drives, at once": ({}, lambda line: line.drives["fan-2"].faults.inject(Collision(), None), nothing),
    "echo_undeclared": ({"echo": True}, nothing, nothing),
    "echo_missing": ({"echo": False}, nothing, nothing),
}
"""How the line is built, what is done to it at first, and again and again."""


@pytest.mark.parametrize("case", [*CASES, "healthy"])
async def test_a_line_has_its_diagnosis_within_ten_seconds(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    expected = case.partition(",")[0]
    options, begin, again = CASES.get(case, ({}, nothing, nothing))
    site = site_of(tmp_path)
    [config] = site.lines
    echo = options.pop("echo", config.rs485.echo)
    there = replace(config, rs485=replace(config.rs485, echo=echo))  # type: ignore[arg-type]
    told = replace(config, rs485=replace(config.rs485, echo=expected == "echo_missing"))
    with SimulatedLine(there, tmp_path / "lines", **options) as line:  # type: ignore[arg-type]
        begin(line)
        async with open_core(replace(site, lines=(told,))) as bridge:
            codes, took = await watched(bridge, line, again, expected)
    assert codes == ({expected} if expected != "healthy" else set())
    assert took <= SOON + 1


async def watched(bridge: Bridge, line: SimulatedLine, again: Do, expected: str) -> tuple[set[str], float]:
    """All that was told until the diagnosis was, and when that was; what is expected last is `healthy`."""
    await bridge.watch({f"fan-{n}.{tag}": 0.3 for n in (1, 2, 3) for tag in TAGS})
    began, codes = monotonic(), set[str]()
    while monotonic() - began < SOON + 1 and expected not in codes:
        again(line)
        await asyncio.sleep(0.4)
        codes |= {one.code for one in (await bridge.health()).diagnoses}
    return codes, monotonic() - began if expected != "healthy" else 0.0
