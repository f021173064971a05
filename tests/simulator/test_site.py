"""A whole site: from the mapping files to ptys, as a program and as a library."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from gateway.mapping.load import builtin_mappings, load_profile, load_site
from gateway.mapping.site import Site
from gateway.simulator import UnsupportedError, run
from gateway.simulator.build import build_drives
from gateway.simulator.drive import Drive
from tests.simulator.master import UNIT, Master, read, refused
from tests.simulator.plant import line_config, profile

SITE = """
site: plant7
gateway: gw1
lines:
  north:
    port: "simulated:"
    serial: 9600 8N2
    drives:
      fan-1: {profile: teco-7200gs, unit: 5}
  south:
    port: "simulated:"
    serial: 4800 8N2
    drives:
      pump-1: {profile: teco-7200gs, unit: 1, settings: {max_frequency: 100}}
"""


@pytest.fixture
def site_file(tmp_path: Path) -> Path:
    path = tmp_path / "site.yaml"
    path.write_text(SITE)
    return path


@pytest.fixture
def site(site_file: Path) -> Site:
    loaded, findings = load_site(site_file)
    assert loaded is not None, [str(finding) for finding in findings]
    return loaded


def shipped_drive() -> Drive:
    """A drive from the profile that comes with the gateway."""
    shipped, _ = load_profile(builtin_mappings() / "teco-7200gs.yaml")
    assert shipped is not None
    config = line_config()
    drives = tuple(replace(drive, profile=shipped) for drive in config.drives)
    return build_drives(replace(config, drives=drives), {})["fan-5"]


def test_every_point_of_the_shipped_profile_can_be_read() -> None:
    shipped, _ = load_profile(builtin_mappings() / "teco-7200gs.yaml")
    assert shipped is not None
    master = Master(shipped_drive())
    for point in shipped.points.values():
        assert master.read(point.address, point.words)


def test_the_shipped_profile_gives_the_documented_words() -> None:
    """Raw words by the addresses and bits of the manual, so that profile and simulator check each other."""
    master = Master(shipped_drive())
    master.write(0x0001, 0b11, 3000)
    master.wait(5)
    assert master.word(0x0020) == 0b0111
    assert master.word(0x002C) == 0b0100_0101
    assert master.read(0x0023, 2) == [3000, 3000]
    master.write(0x0001, 0b0111)
    assert master.word(0x0021) == 0x0080
    assert master.word(0x002C) & 0xC000 == 0x4000
    assert master.code(0x0002, 6001) == 0x21
    assert master.code(0x0020, 0) == 0x22
    assert master.send(read(0x0025, 1)) == refused(0x03, 0x02)


async def test_run_opens_the_lines_and_closes_them(site: Site, tmp_path: Path) -> None:
    ready: dict[str, Path] = {}
    task = asyncio.ensure_future(run(site, tmp_path / "ports", ready=ready.__setitem__))
    while len(ready) < 2:
        assert not task.done()
        await asyncio.sleep(0)
    assert ready == {name: tmp_path / "ports" / name for name in ("north", "south")}
    assert all(path.is_char_device() for path in ready.values())
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert not any(path.is_symlink() for path in ready.values())


async def test_unknown_lines_are_named(site: Site, tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match="no line west; it has north, south"):
        await run(site, tmp_path, ["west"])


def test_the_site_may_allow_more_than_60_hz(site: Site) -> None:
    drives = {name: drive for line in site.lines for name, drive in build_drives(line, {}).items()}
    assert drives["fan-1"].registers[0x0201] == 600
    assert drives["pump-1"].registers[0x0201] == 1000


def test_what_cannot_be_simulated_is_said() -> None:
    config = line_config()
    with pytest.raises(UnsupportedError, match=r"line north speaks ASCII, but TECO .* RTU only"):
        build_drives(replace(config, framing="ascii"), {})
    with pytest.raises(UnsupportedError, match="line north: Modbus TCP cannot be simulated"):
        build_drives(replace(config, framing="tcp"), {})


def test_a_profile_needs_no_facts_to_be_simulated() -> None:
    config = line_config()
    bare = replace(config.drives[0], profile=replace(profile(), simulate=None))
    master = Master(build_drives(replace(config, drives=(bare,)), {})["fan-5"])
    master.write(0x0001, 1, 6000)
    master.wait(3)
    assert master.word(0x0020) == 0b0101
    assert master.word(0x0024) == 6000


def program(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "gateway.simulator", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_program_announces_its_lines_and_stops_cleanly(
    site_file: Path, tmp_path: Path, number: signal.Signals
) -> None:
    with program(str(site_file), "--dir", str(tmp_path / "ports"), "--line", "north") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == f"north {tmp_path}/ports/north\n"
        port = os.open(tmp_path / "ports" / "north", os.O_RDWR | os.O_NOCTTY)
        os.write(port, read(0x0040, 1))
        reply = os.read(port, 1)
        process.send_signal(number)
        assert process.wait(10) == 0
        assert reply == bytes((UNIT,))
        os.close(port)
    assert list((tmp_path / "ports").iterdir()) == []


def test_the_program_says_what_is_wrong(site_file: Path, tmp_path: Path) -> None:
    with program(str(site_file), "--dir", str(tmp_path), "--line", "west") as process:
        _, complaint = process.communicate(timeout=10)
        assert (process.returncode, "no line west" in complaint) == (1, True)
    with program(str(tmp_path / "none.yaml"), "--dir", str(tmp_path)) as process:
        _, complaint = process.communicate(timeout=10)
        assert (process.returncode, "none.yaml:1:1" in complaint) == (1, True)
