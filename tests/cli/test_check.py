"""`check` tells what plan and version say against a site; what a drive does not have is refused with the
reason, by all commands alike."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli.program import gateway

SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: /dev/ttyUSB0
    serial: {serial}
    drives:
"""
FOR_ALL = "so it is asked of the line"


def site_with(folder: Path, serial: str, *drives: str) -> Path:
    path = folder / "site.yaml"
    path.write_text(SITE.format(serial=serial) + "".join(f"      {drive}\n" for drive in drives))
    return path


@pytest.fixture
def pumps(tmp_path: Path) -> Path:
    common = "e1_04: 60, f5_05: with_detection, f5_04: coast"
    free = "control: {lease: off}"
    return site_with(
        tmp_path,
        "9600 8N1",
        f"pump-1: {{profile: s2000, unit: 1, settings: {{{common}}}, {free}}}",
        f"pump-2: {{profile: s2000, unit: 2, settings: {{{common}, h1_02: fault_reset}}, {free}}}",
    )


@pytest.mark.parametrize("number", [19, 31])
def test_check_and_plan_count_the_same_drives(number: int, tmp_path: Path) -> None:
    drives = [f"fan-{unit}: {{profile: teco-7200gs, unit: {unit}}}" for unit in range(1, number + 1)]
    path = site_with(tmp_path, "2400 8N2", *drives)
    (line,) = gateway("plan", path, "--json").objects
    fitting = {drive["fitting"] for drive in line["comm_loss"]}
    assert fitting == {19}
    checked = gateway("check", path)
    assert checked.code == 0
    told = re.findall(r":4:3: warning: (\d+) drives cannot all be spoken to .* dead; (\d+) can", checked.out)
    assert told == ([] if number == 19 else [(str(number), "19")])


def test_a_line_that_is_fast_enough_is_not_complained_about(tmp_path: Path) -> None:
    path = site_with(tmp_path, "9600 8N2", "fan-1: {profile: teco-7200gs, unit: 1}")
    assert "warning" not in gateway("check", path).out


def test_a_broadcast_is_explained_and_not_asked_of_one_drive(pumps: Path) -> None:
    shown = gateway("explain", pumps, "pump-1.run_forward_all")
    assert shown.code == 0
    assert "sent      not at all: north has no `broadcast: {role: ...}` in the site file" in shown.out
    (command,) = gateway("explain", pumps, "pump-1.run_forward_all", "--json").objects
    assert (command["unit_address"], command["sent"]) == (0, False)
    assert command["steps"][0]["registers"] == ["0001H", "0002H"]
    (point,) = gateway("explain", pumps, "pump-1.frequency_all", "--json").objects
    assert (point["registers"], point["exact"], point["unit"]) == (["0002H"], "1/300", "%")
    pumps.write_text(pumps.read_text() + "writes: {enabled: true}\n")
    told = gateway("command", pumps, "pump-1", "run_forward_all", "frequency=10")
    assert told.code == 1
    assert FOR_ALL in told.out
    told = gateway("write", pumps, "pump-1.frequency_all=10")
    assert told.code == 1
    assert FOR_ALL in told.out


def test_who_may_command_all_drives_is_explained(pumps: Path) -> None:
    pumps.write_text(
        pumps.read_text().replace("    drives:\n", "    broadcast: {role: engineer}\n    drives:\n", 1)
    )
    (command,) = gateway("explain", pumps, "pump-1.run_forward_all", "--json").objects
    assert command["sent"]
    assert command["reason"] == "by run_forward_all of north, engineer and above (a stop: operator)"


def test_what_settings_leave_out_is_refused_with_the_setting(pumps: Path) -> None:
    pumps.write_text(pumps.read_text() + "writes: {enabled: true}\n")
    for words in (("command", pumps, "pump-1", "reset_fault"), ("explain", pumps, "pump-1.reset_fault")):
        told = gateway(*words)
        assert told.code == 1
        assert "the settings of pump-1 leave it out (needs h1_02: fault_reset)" in told.out + told.err
    assert gateway("explain", pumps, "pump-2.reset_fault").code == 0
    assert gateway("explain", pumps, "pump-2.terminal_4").code == 1
