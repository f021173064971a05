"""Outside names: the default rule, templates of site and drive, single names, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from gateway.mapping.load import load_site
from gateway.mapping.site import DriveNames, Names
from tests.mapping.texts import small

PROFILE = """\
running: {at: 0001H, bits: {on: 0}}
speed: {at: 0002H, kind: setpoint, range: 0..50}
"""
COMMANDS = "commands: {stop: {steps: [{write: {speed: 0}}]}}\n"
SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: simulated
    serial: 9600 8N1
    drives:
      fan-1: {profile: small, unit: 1%s}
      fan-2: {profile: small, unit: 2}
"""


def read(folder: Path, own: str = "", more: str = "") -> tuple[list[DriveNames] | None, list[str]]:
    (folder / "small.yaml").write_text(small(PROFILE) + COMMANDS)
    file = folder / "site.yaml"
    file.write_text(SITE % own + more)
    site, findings = load_site(file)
    told = [f"{f.line}:{f.column}: {f.message} ({f.remedy})" for f in findings]
    names = None if site is None else [drive.names for drive in site.drives if drive.names]
    return names, told


def good(folder: Path, own: str = "", more: str = "") -> list[DriveNames]:
    names, told = read(folder, own, more)
    assert names is not None, told
    assert told == []
    return names


def test_the_default_rule(tmp_path: Path) -> None:
    fan, _ = good(tmp_path)
    assert (fan.node, fan.browse, fan.topic) == ("fan-1", "fan-1", "plant7/fan-1")
    assert fan.points["speed"] == Names("fan-1.speed", "speed", "speed")
    assert fan.points["stop"] == Names("fan-1.stop", "stop", "stop")
    assert set(fan.points) == {"on", "speed", "stop"}


def test_templates_of_the_site(tmp_path: Path) -> None:
    section = """\
names:
  node: <site>.<gateway>.<line>.<drive>.<group>.<point>
  browse: <drive>_<point>
  topic: <group>/<point>
  drive_node: D <drive>
  drive_browse: <line>:<drive>
  drive_topic: hall/<line>/<drive>
"""
    fan, other = good(tmp_path, more=section)
    assert (fan.node, fan.browse, fan.topic) == ("D fan-1", "north:fan-1", "hall/north/fan-1")
    assert fan.points["speed"] == Names("plant7.gw1.north.fan-1.g.speed", "fan-1_speed", "g/speed")
    assert fan.points["stop"].topic == "commands/stop"
    assert other.topic == "hall/north/fan-2"


def test_a_drive_has_its_own_way(tmp_path: Path) -> None:
    own = ", names: {drive_topic: old/F1, node: F1_<point>, points: {speed: {node: SPEED1, topic: w/n}}}"
    fan, other = good(tmp_path, own, "names: {node: <drive>/<point>}\n")
    assert fan.topic == "old/F1"
    assert fan.points["on"].node == "F1_on"
    assert fan.points["speed"] == Names("SPEED1", "speed", "w/n")
    assert other.points["speed"].node == "fan-2/speed"


WRONG = [
    (
        "",
        "names: {node: <drive>.<pont>}\n",
        "10:15: `<pont>` means nothing in `node` (did you mean `point`?)",
    ),
    (
        "",
        "names: {drive_topic: <point>}\n",
        "10:22: `<point>` means nothing in `drive_topic` (known are site",
    ),
    ("", "names: {browse: <point}\n", "10:17: `<point` has a bracket without its partner"),
    ("", "names: {node: <point>}\n", "10:15: the node `on` of `fan-2.on` is `fan-1.on` already"),
    (
        "",
        "names: {browse: same}\n",
        "10:17: the browse name `same` of `fan-1.speed` is that of `fan-1.on` already",
    ),
    ("", "names: {topic: a+b}\n", "10:16: `a+b` cannot be a topic"),
    ("", "names: {topic: <point>/}\n", "10:16: `on/` cannot be a topic"),
    ("", "names: {drive_topic: $SYS/<drive>}\n", "10:22: the topic `$SYS/fan-1` would be the broker's own"),
    ("", "names: {drive_topic: same}\n", "10:22: the topics of `fan-2` and `fan-1` mix at `same`"),
    (
        "",
        "names: {drive_topic: plant7/_gateway/<drive>}\n",
        "10:22: `plant7/_gateway` is the gateway's own topic",
    ),
    (", names: {drive_topic: plant7/fan-2/state}", "", "8:61: the topics of `fan-2` and `fan-1` mix at"),
    (
        ", names: {points: {spede: {node: x}}}",
        "",
        "8:57: `small` has no point or command `spede` (did you mean",
    ),
    (
        ", names: {points: {speed: {node: fan-2}}}",
        "",
        "8:71: the node `fan-2` of `fan-1.speed` is `fan-2` already",
    ),
    (
        ", names: {points: {speed: {node: fan-1/g}}}",
        "",
        "8:71: the node `fan-1/g` of `fan-1.speed` is `fan-1/g`",
    ),
    (', names: {points: {speed: {browse: "a "}}}', "", "8:73: `a ` cannot be a browse name"),
]


@pytest.mark.parametrize(("own", "more", "told"), WRONG, ids=[told[:40] for _, _, told in WRONG])
def test_names_that_will_not_do(tmp_path: Path, own: str, more: str, told: str) -> None:
    names, found = read(tmp_path, own, more)
    assert names is None
    assert any(finding.startswith(told) for finding in found), found
