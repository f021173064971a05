"""What drives on one line have to have in common: framing, speed and format, each told once for all alike."""

from __future__ import annotations

from pathlib import Path

from gateway.mapping.load import load_site

SITE = """\
site: plant7
gateway: gw1
lines:
  empty:
    port: /dev/ttyUSB0
    serial: 9600 8N2
    drives: {}
  mixed:
    port: /dev/ttyUSB1
    serial: 9600 7E1
    drives:
      fan-1: {profile: teco-7200gs, unit: 1}
      fan-2: {profile: teco-7200gs, unit: 2}
      pump-1: {profile: s2000, unit: 3, settings: {e1_04: 60}, comm_loss: any}
  either:
    port: /dev/ttyUSB2
    serial: 9600 8O2
    drives:
      hoist-1: {profile: shihlin-sl3, unit: 1}
      hoist-2: {profile: shihlin-sl3, unit: 2}
  letters:
    port: /dev/ttyUSB3
    framing: ascii
    serial: 1000 8E2
    drives:
      hoist-3: {profile: shihlin-sl3, unit: 1}
      fan-3: {profile: teco-7200gs, unit: 2}
      pump-2: {profile: s2000, unit: 3, settings: {e1_04: 60}, comm_loss: any}
  network:
    port: modbus://10.0.0.1:502
    drives:
      fan-4: {profile: teco-7200gs, unit: 40}
      hoist-4: {profile: shihlin-sl3, unit: 2}
"""
TOLD = [
    "4:3: warning: line `empty` has no drives (add one, or leave the line out)",
    "10:13: `fan-1`, `fan-2` (teco-7200gs), `pump-1` (s2000) do not speak 7E1 in rtu "
    "(they have no format in common: use two lines)",
    "15:3: `hoist-1`, `hoist-2` (shihlin-sl3) may speak rtu or ascii (write `framing`)",
    "23:14: `fan-3` (teco-7200gs), `pump-2` (s2000) do not speak ascii (write rtu)",
    "24:13: `hoist-3` (shihlin-sl3), `fan-3` (teco-7200gs), `pump-2` (s2000) do not speak 1000 bit/s "
    "(use one of 9600, 4800)",
    "24:13: `hoist-3` (shihlin-sl3) does not speak 8E2 in ascii (use one of 7E1, 7N2, 7O1)",
    "32:43: `teco-7200gs` has unit addresses 1 to 31 (correct the address)",
]


def told(folder: Path, text: str) -> list[str]:
    """What is said of the site file itself; profiles may have doubts of their own."""
    file = folder / "site.yaml"
    file.write_text(text, encoding="utf-8")
    lines = [str(finding) for finding in load_site(file)[1]]
    return [line.removeprefix(f"{file}:") for line in lines if line.startswith(f"{file}:")]


def test_each_line_is_held_against_all_its_drives(tmp_path: Path) -> None:
    assert told(tmp_path, SITE) == TOLD


def test_a_format_of_the_other_framing_is_told_where_the_framing_is_written(tmp_path: Path) -> None:
    rest = SITE.partition("  either:")[2].partition("  letters:")[0]
    text = f"site: plant7\ngateway: gw1\nlines:\n  either:\n    framing: rtu{rest}"
    formats = "(use one of 8E1, 8N2, 8O1)"
    assert told(tmp_path, text) == [
        f"7:13: `hoist-1`, `hoist-2` (shihlin-sl3) do not speak 8O2 in rtu {formats}"
    ]
