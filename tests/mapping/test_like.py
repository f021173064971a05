"""A profile that starts from another: what merges, what is replaced, what goes; and where findings point."""

from __future__ import annotations

from pathlib import Path

import pytest

from gateway.mapping.finding import Finding
from gateway.mapping.load import load_profile, load_site
from gateway.mapping.profile import Profile
from tests.mapping.texts import HEAD

PARENT = (
    HEAD.replace("small", "parent")
    + """\
errors: {02H: illegal_address, 22H: {name: locked, help: while running}}
values: {modes: {0: off, 1: {name: on, help: running}}}
groups:
  g:
    points:
      speed: {at: 0001H, unit: 0.01 Hz}
      load: 0002H
      word: {at: 0003H, bits: {running: 0, mode: {bit: 1..2, values: {0: off, 1: on}}}}
      heat: {at: 0004H, values: modes}
commands:
  go: {steps: [{write: {target: 1}}]}
""".replace("      heat", "      target: {at: 0005H, kind: switch}\n      heat")
)


def files(folder: Path, **texts: str) -> None:
    for name, text in {"parent": PARENT, **texts}.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")


def child(folder: Path, text: str) -> tuple[Profile | None, list[Finding]]:
    files(folder, child=f"profile: child\nlike: parent\n{text}")
    return load_profile(folder / "child.yaml")


def good(folder: Path, text: str) -> Profile:
    profile, findings = child(folder, text)
    assert profile is not None, [str(finding) for finding in findings]
    return profile


def test_what_the_child_does_not_say_is_the_parents(tmp_path: Path) -> None:
    ours, (theirs, _) = good(tmp_path, "title: Child"), load_profile(tmp_path / "parent.yaml")
    assert theirs is not None
    assert (ours.name, ours.title, ours.maker) == ("child", "Child", theirs.maker)
    assert ours.points == theirs.points and ours.commands == theirs.commands


def test_a_bare_scalar_is_its_first_key(tmp_path: Path) -> None:
    ours = good(tmp_path, "groups: {g: {points: {speed: 0010H, load: {unit: 1 A}}}}")
    assert (ours.points["speed"].address, str(ours.points["speed"].encoding.symbol)) == (0x10, "Hz")
    assert (ours.points["load"].address, ours.points["load"].encoding.symbol) == (2, "A")


def test_bits_values_errors_and_facts_merge_by_name(tmp_path: Path) -> None:
    ours = good(
        tmp_path,
        """\
documents: {m: {similar: true}}
modbus: {read_max: 9}
serial: {baud: {doubt: unsure}}
errors: {22H: {help: always}, 02H: {help: a hole}}
values: {modes: {1: {name: runs}}}
groups: {g: {points: {word: {bits: {running: 4, mode: {values: {2: {name: jog}}}, ready: 5}}}}}
""",
    )
    assert ours.points["running"].encoding.bit == 4 and ours.points["ready"].encoding.bit == 5
    assert ours.points["mode"].encoding.values == {0: "off", 1: "on", 2: "jog"}
    assert ours.points["heat"].encoding.values == {0: "off", 1: "runs"}
    assert (ours.errors[0x22].name, ours.errors[0x22].help) == ("locked", "always")
    assert (ours.errors[0x02].name, ours.errors[0x02].help) == ("illegal_address", "a hole")
    assert ours.modbus.read_max == 9 and ours.modbus.functions == (3, 6, 16)
    assert ours.serial.baud == (9600,) and ours.facts["serial.baud"].doubt == "unsure"
    assert ours.documents["m"].similar and ours.documents["m"].title == "manual"


def test_lists_and_scalars_are_replaced(tmp_path: Path) -> None:
    ours = good(tmp_path, "models: [X, Y]\nversion: 7\nmodbus: {functions: [03H, 10H]}")
    assert (ours.models, ours.version, ours.modbus.functions) == (("X", "Y"), 7, (3, 16))


def test_null_removes(tmp_path: Path) -> None:
    ours = good(tmp_path, "groups: {g: {points: {heat: null, word: {bits: {mode: ~}}, speed: {unit: null}}}}")
    assert list(ours.points) == ["speed", "load", "running", "target"]
    assert ours.points["speed"].encoding.symbol is None
    assert "values" not in ours.facts


def test_nothing_is_no_null(tmp_path: Path) -> None:
    _, findings = child(tmp_path, "groups: {g: {points: {heat: }}}")
    assert [str(finding) for finding in findings] == [
        f"{tmp_path}/child.yaml:3:28: nothing stands here (write a value, or leave the key out)"
    ]


def test_a_grandparent(tmp_path: Path) -> None:
    files(
        tmp_path,
        middle="profile: middle\nlike: parent\nversion: 2\n"
        "groups: {g: {points: {load: null, speed: {unit: 0.1 Hz}}}}\n",
        child="profile: child\nlike: middle\n"
        "groups: {g: {points: {load: {at: 0009H, unit: 1 A}, more: 0020H}}}\n",
    )
    ours, findings = load_profile(tmp_path / "child.yaml")
    assert findings == [] and ours is not None
    assert (ours.version, ours.points["speed"].encoding.scale.denominator) == (2, 10)
    assert (ours.points["load"].address, ours.points["more"].address) == (9, 0x20)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("groups: {g: {points: {word: {bits: {ready: 0}}}}}", "child.yaml:3:37"),
        ("groups: {g: {points: {new: 0001H}}}", "child.yaml:3:23"),
        ("modbus: {functions: [03H]}", "parent.yaml:17:20"),
        ("commands: {go: {steps: [{write: {speed: 1}}]}}", "child.yaml:3:34"),
    ],
)
def test_findings_point_at_who_wrote_it(tmp_path: Path, text: str, place: str) -> None:
    profile, findings = child(tmp_path, text)
    assert profile is None
    assert [str(f).split(" ")[0] for f in findings] == [f"{tmp_path}/{place}:"]


def test_a_parents_text_that_is_no_yaml(tmp_path: Path) -> None:
    files(tmp_path, parent="a: [", child="profile: child\nlike: parent\n")
    profile, findings = load_profile(tmp_path / "child.yaml")
    assert profile is None
    assert [Path(finding.file).name for finding in findings] == ["parent.yaml", "child.yaml"]


def test_a_site_digest_covers_the_parent(tmp_path: Path) -> None:
    files(tmp_path, child="profile: child\nlike: parent\n")
    site_file = tmp_path / "site.yaml"
    site_file.write_text(
        "site: s\ngateway: g\nlines: {a: {port: simulated, serial: 9600 8N1, "
        "drives: {d: {profile: child, unit: 1}, e: {profile: parent, unit: 2}}}}\n"
    )
    before, findings = load_site(site_file)
    assert before is not None, [str(finding) for finding in findings]
    files(tmp_path, parent=PARENT.replace("0.01 Hz", "0.1 Hz"))
    after, _ = load_site(site_file)
    assert after is not None and after.digest != before.digest
    assert load_site(site_file)[0] == after
