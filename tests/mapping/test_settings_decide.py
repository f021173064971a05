"""What the settings of a drive decide: places, points, cases, commands; and what they may not do."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from gateway.mapping.load import builtin_mappings, load_site
from gateway.mapping.profile import Access, Profile
from gateway.mapping.specialise import specialise
from tests.mapping.texts import good, small, teco

SETTINGS = """\
settings:
  moved: {range: 0..4, default: 0}
  mode: {values: {0: plain, 1: fine}, default: plain}
  top: {unit: 1 Hz, range: 0..400, default: 50}
"""
POINTS = """\
status: {at: 0000H, bits: {running: 0, ready: 1}}
word:
  at: 0001H
  shift: moved
  image: true
  kind: command
  bits: {run: 0, turn: {bit: 1, when: {mode: fine}}}
speed:
  at: 0002H
  shift: moved
  kind: setpoint
  range: 0..top
  cases:
    - {when: {mode: plain}, unit: 0.1 Hz}
    - {when: {mode: fine, ready: true}, unit: 0.01 Hz}
    - {when: {mode: fine}, unit: 1 Hz}
fine: {at: 0010H, when: {mode: fine}, unit: 0.1 Hz}
leaning: {at: 0011H, when: {turn: true}}
scaled: {at: 0012H, unit: 1 Hz, times: fine}
limited: {at: 0013H, kind: setpoint, unit: 0.1 Hz, range: 0..fine}
blind: {at: 0014H, kind: setpoint, access: write, unit: 0.1 Hz, range: 0..fine}
locked: {at: 0015H, kind: switch, only_when: {turn: false}, then: keep}
kept: {at: 0016H, kind: command}
plain: {at: 0017H, cases: [{when: {turn: true}, unit: 1 A}, {when: {ready: true}, unit: 0.1 A}]}
paired: {at: 0019H, kind: setpoint, unit: 0.1 Hz, range: 0..5, twin: eased}
eased: {at: 001AH, kind: setpoint, unit: 0.1 Hz, range: 0..5, when: {mode: fine}}
nothing: {at: 0018H, cases: [{when: {turn: true}, unit: 1 A}]}
"""
COMMANDS = """\
commands:
  keep: {steps: [{write: {kept: 1}}]}
  twirl: {steps: [{write: {turn: true}}]}
  lean: {only_when: {turn: true}, steps: [{write: {run: true}}]}
  go:
    args: {f: speed}
    steps:
      - {when: {mode: fine}, write: {turn: false}}
      - {when: {mode: plain}, write: {run: true, speed: <f>}, until: {running: true}}
  reset: {steps: [{when: {mode: fine}, write: {kept: 2}}]}
  stop: {steps: [{write: {run: false}}]}
"""


def whole() -> Profile:
    return good(small(POINTS, SETTINGS) + COMMANDS)


def special(moved: int = 0, mode: int = 0) -> Profile:
    return specialise(whole(), {"moved": Fraction(moved), "mode": Fraction(mode), "top": Fraction(50)})


def test_nothing_to_decide_changes_nothing() -> None:
    profile = teco()
    assert specialise(profile, {"max_frequency": Fraction(50)}) is profile


@pytest.mark.parametrize("moved", range(5))
def test_a_shift_moves_point_word_and_notation(moved: int) -> None:
    profile = special(moved)
    assert profile.points["run"].address == 1 + moved
    assert profile.points["speed"].address == 2 + moved
    assert profile.points["speed"].notation == f"{2 + moved:04X}H"
    assert profile.points["running"].address == 0
    assert profile.words[1 + moved].fields == ("run",)
    assert profile.words[1 + moved].image
    assert profile.words.keys() == {0, 1 + moved}
    assert not any(item.shift for item in (*profile.points.values(), *profile.words.values()))


def test_a_case_that_settings_decide_is_the_points_own() -> None:
    point = special().points["speed"]
    assert (point.encoding.scale, point.cases) == (Fraction(1, 10), ())
    assert point.limits is not None and (point.limits.low, point.limits.high) == (0, "top")


def test_the_rest_of_a_mixed_condition_stays() -> None:
    point = special(mode=1).points["speed"]
    assert [[term.text for term in case.when] for case in point.cases] == [["ready: true"], []]
    assert [case.encoding.scale for case in point.cases] == [Fraction(1, 100), Fraction(1)]


def test_points_that_a_setting_rules_out_take_along_what_leans_on_them() -> None:
    plain, fine = special(), special(mode=1)
    gone = {"turn", "fine", "leaning", "scaled", "blind", "nothing", "eased"}
    assert fine.points.keys() - plain.points.keys() == gone
    assert fine.points.keys() == whole().points.keys()
    assert [term.text for term in fine.points["leaning"].when] == ["turn: true"]
    assert fine.points["fine"].when == ()


def test_a_limit_or_lock_that_is_not_there_leaves_a_point_to_be_read_only() -> None:
    points = special().points
    for name in ("limited", "locked"):
        assert (points[name].access, points[name].role) == (Access.READ, None)
        assert (points[name].limits, points[name].only_when, points[name].then) == (None, (), None)
    assert special(mode=1).points["locked"].access is Access.READ_WRITE
    assert special(mode=1).points["locked"].then == "keep"


def test_a_twin_that_is_not_there_is_nobodys_twin() -> None:
    assert special().points["paired"].twin is None
    assert special(mode=1).points["paired"].twin == "eased"


def test_cases_that_lean_on_what_is_not_there_are_left_out() -> None:
    assert [case.encoding.scale for case in special().points["plain"].cases] == [Fraction(1, 10)]
    assert len(special(mode=1).points["plain"].cases) == 2


def test_commands_lose_steps_or_are_not_there() -> None:
    plain, fine = special().commands, special(mode=1).commands
    assert set(plain) == {"keep", "go", "stop"}
    assert set(fine) == set(whole().commands)
    assert [list(step.write) for step in plain["go"].steps] == [["run", "speed"]]
    assert [list(step.write) for step in fine["go"].steps] == [["turn"]]
    assert plain["go"].steps[0].when == ()


def test_a_condition_of_a_precondition_keeps_its_settings() -> None:
    text = small("a: {at: 0001H, kind: switch, only_when: {mode: fine}}", SETTINGS)
    values = {"moved": Fraction(0), "mode": Fraction(0), "top": Fraction(1)}
    assert [term.text for term in specialise(good(text), values).points["a"].only_when] == ["mode: fine"]


def test_without_detection_nothing_happens_when_the_line_dies() -> None:
    text = small("a: 0001H", SETTINGS).replace(
        "rtu: [8N1]", "rtu: [8N1], comm_loss: {after: 2s, when: {mode: fine}}"
    )
    values = {"moved": Fraction(0), "mode": Fraction(0), "top": Fraction(1)}
    loss = specialise(good(text), values).serial.comm_loss
    assert (loss.blind, loss.after, loss.action) == (True, None, None)
    loss = specialise(good(text), values | {"mode": Fraction(1)}).serial.comm_loss
    assert (loss.blind, loss.after, loss.when) == (False, 2.0, ())


SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: simulated
    serial: 9600 8N1
    drives:
      fan-1: {profile: %s, unit: 1, settings: {%s}}
"""


def told(folder: Path, settings: str, points: str, commands: str = "", more: str = SETTINGS) -> list[str]:
    (folder / "small.yaml").write_text(small(points, more) + commands)
    file = folder / "site.yaml"
    file.write_text(SITE % ("small", settings))
    _, findings = load_site(file)
    return [f"{f.line}:{f.column}: {f.message}" for f in findings if f.file == str(file)]


def test_a_shift_that_is_no_whole_number(tmp_path: Path) -> None:
    assert told(tmp_path, "moved: 0.5", "a: {at: 0001H, shift: moved}") == [
        "8:58: `moved` is added to addresses, and 0.5 is no whole number"
    ]


def test_a_shift_out_of_the_table(tmp_path: Path) -> None:
    assert told(tmp_path, "moved: 2", "a: {at: FFFEH, shift: moved}") == [
        "8:58: `moved` moves `a` out of 0000H to FFFFH"
    ]


def test_a_shift_onto_another_point(tmp_path: Path) -> None:
    points = "a: {at: 0001H, shift: moved}\nb: {at: 0003H, type: u32}\nc: {at: 0002H, access: read}"
    assert told(tmp_path, "moved: 0", points) == []
    for moved, message in ((1, "`c` and `a` to one place, 0002H"), (2, "`b` and `a` to one place, 0003H")):
        assert told(tmp_path, f"moved: {moved}", points) == [f"8:51: `moved` moves {message}"]
    assert told(tmp_path, "moved: 4", points) == []


def test_settings_never_take_the_stop_away(tmp_path: Path) -> None:
    points = "r: {at: 0001H, kind: command, when: {mode: fine}}\nb: 0002H"
    commands = "commands: {run_forward: {steps: [{write: {r: 1}}]}, stop: {steps: [{write: {r: 0}}]}}\n"
    assert told(tmp_path, "mode: fine", points, commands) == []
    assert told(tmp_path, "mode: plain", points, commands) == [
        "8:40: with these settings `fan-1` has no command `stop`"
    ]


def test_the_s2000_from_the_factory_keeps_running(tmp_path: Path) -> None:
    file = tmp_path / "site.yaml"
    file.write_text(SITE % ("s2000", "e1_04: 60"))
    site, findings = load_site(file)
    assert site is not None
    words = "`fan-1` keeps running when the line dies: its settings tell it not to watch the line"
    assert words in [finding.message for finding in findings]
    file.write_text(SITE % ("s2000", "e1_04: 60, f5_05: with_detection, f5_04: coast"))
    assert not [f.message for f in load_site(file)[1] if f.file == str(file)]


@pytest.mark.parametrize("name", sorted(path.stem for path in builtin_mappings().glob("*.yaml")))
def test_every_shipped_profile_keeps_its_stop(name: str, tmp_path: Path) -> None:
    file = tmp_path / "site.yaml"
    text = (SITE % (name, "e1_04: 60" if name == "s2000" else "max_frequency: 50")).replace(
        "9600 8N1", "9600 8E1\n    framing: rtu" if name == "shihlin-sl3" else "9600 8N2"
    )
    file.write_text(text.replace("8N2", "8N1") if name == "s2000" else text)
    site, findings = load_site(file)
    assert site is not None, [str(finding) for finding in findings]
    assert "stop" in site.drives[0].profile.commands
