"""Every mistake is told in one pass, once, however many others there are: what is wrong in one entry neither
hides what is wrong in another, nor brings up more than itself."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gateway.mapping.load import load_site

PROFILE = """\
profile: acme-x
title: Acme X
maker: Acme
models: [X]
version: 1
documents:
  man: Acme X manual
  sis: {title: Sister manual, similar: true}
addresses:
  Pr-<n>: {n: 1, add: 0FFFH, example: Pr-10 = 1009H}
  Qr-<n>: {n: 1, add: 2FFFH, example: Qr-10 = 3009H}
serial:
  baud: [9600, 19200]
  rtu: [8N1, 8E1]
  units: 1..31
  reply: 10ms..500ms
  comm_loss: {after: 3s, action: loss_action}
modbus:
  functions: [03H, 06H, 10H]
  read_max: 16
  write_max: 8
settings:
  poles: {range: 2..12, default: 4}
  top: {unit: 1 Hz, range: 0..400, default: 50}
errors:
  01H: illegal_function
  21H: {name: busy, retry: 100ms}
values:
  switched: {0: disabled, 1: enabled}
groups:
  control:
    kind: command
    source: man 3
    points:
      command_word:
        at: 0001H
        image: true
        bits:
          run: 0
          reverse: 1
          reset: {bit: 3, pulse: 200ms}
          unused: {bit: 8..F, always: 0}
      frequency_command: {at: 0002H, unit: 0.01 Hz, kind: setpoint, range: 0..top}
  monitor:
    kind: measurement
    points:
      status_word:
        at: 0010H
        kind: status
        bits: {running: 0, running_reverse: 1, fault: 3}
      output_frequency: {at: 0011H, unit: 0.01 Hz, rate: fast}
      output_current: {at: 0012H, unit: 0.1 A}
      energy: {at: 0014H, type: u32, unit: 1 kWh}
      heat: {at: 0016H, unit: 1 °C}
      speed: {at: 0017H, unit: 1/120 r/min, times: poles}
  parameters:
    kind: parameter
    wear: unknown
    only_when: {running: false}
    points:
      mode: {at: Pr-01, values: {0: vf, 1: vector}}
      loss_action: {at: Pr-02, values: {0: coast, 1: keep_running}}
      trip: {at: Pr-03, values: switched}
      gain: {at: Qr-01, when: {mode: vector}}
      preset_frequency_<n>: {at: Pr-10, repeat: 1..3, unit: 0.01 Hz, range: 0..top}
commands:
  run_forward:
    args: {frequency: frequency_command}
    only_when: {mode: vf}
    steps:
      - {write: {run: true, reverse: false, frequency_command: <frequency>}, until: {running: true}}
  stop:
    steps:
      - {write: {run: false, reverse: false}, until: {running: false}, within: 30s}
  reset_fault:
    steps:
      - {write: {reset: true}, until: {fault: false}, within: 2s}
"""
OTHER = """\
profile: beta
title: Beta
maker: Acme
models: [B]
version: 1
documents: {man: Beta manual}
serial: {baud: [9600], rtu: [8N2]}
groups: {status: {points: {word: {at: 0001H, bits: {ready: 0}}, output_frequency: {at: 0002H, unit: 0.1 Hz}}}}
"""
SITE = """\
site: plant
gateway: gw
lines:
  north:
    port: /dev/ttyUSB0
    serial: 9600 8N1
    drives:
      fan-1: {profile: acme-x, unit: 1, ranges: {frequency_command: [0, 40]}}
      fan-2: {profile: acme-x, unit: 2, settings: {poles: 6}}
  south:
    port: /dev/ttyUSB1
    serial: 9600 8N2
    drives:
      pump-1: {profile: beta, unit: 5}
      pump-2: {profile: beta, unit: 6}
rates: {fast: 500ms}
writes: {enabled: false}
opcua: {endpoint: "opc.tcp://127.0.0.1:4840"}
mqtt:
  - broker: mqtt://127.0.0.1:1883
    publish:
      - {points: ["output_*"], rate: fast}
      - {points: [pump-1.ready], rate: slow}
"""


class Mistake(NamedTuple):
    """What is changed in one of the files, and the one thing that is to be said about it."""

    old: str
    new: str
    said: str


IN_PROFILE = [
    Mistake("models: [X]", "models: X", "a list is expected here (write it like [X])"),
    Mistake("similar: true", "similar: yes", "`yes` is neither true nor false (write true or false)"),
    Mistake("Qr-<n>: {n: 1", "Qr-<n>: {m: 1", "the parts of `Qr-<n>` and its weights differ"),
    Mistake("reply: 10ms..500ms", "reply: 500ms..10ms", "the range `500ms..10ms` is empty"),
    Mistake("action: loss_action", "action: los_action", "no setting (did you mean `loss_action`?)"),
    Mistake("read_max: 16", "read_max: 200", "Modbus allows at most 125 registers"),
    Mistake("write_max: 8", "write_max: eight", "`eight` is not a number"),
    Mistake("01H: illegal_function", "01H: illegal_func", "(did you mean `illegal_function`?)"),
    Mistake("retry: 100ms", "retry: 100", "`100` is not a time (write it like 200ms or 2s)"),
    Mistake("default: 4}", "default: 40}", "`poles` never is `40` (it can be 2 to 12)"),
    Mistake("source: man 3", "source: manual 3", "`manual` is none of the documents (did you mean `man`?)"),
    Mistake("always: 0", "always: 256", "256 does not fit a width of 8"),
    Mistake("unit: 0.01 Hz, rate: fast", "unit: 0.01 Herz, rate: fast", "(did you mean `Hz`?)"),
    Mistake("at: 0012H", "at: 0x0012", "`0x0012` is not an address (did you mean `0012H`?)"),
    Mistake("      heat:", "      Heat:", "`Heat` is not a name"),
    Mistake("at: 0017H", "at: 0010H", "`speed` and `running` share bit 0 of 0010H"),
    Mistake("values: switched", "values: swiched", "(did you mean `switched`?)"),
    Mistake("{0: vf, 1: vector}", "{0: vf, 0H: vector}", "the raw value 0 has a name already, `vf`"),
    Mistake("repeat: 1..3", "repeat: 3..1", "the range `3..1` is empty (put the lower end first)"),
    Mistake("args: {frequency: f", "arg: {frequency: f", "unknown key `arg` (did you mean `args`?)"),
    Mistake("within: 30s", "within: 30", "`30` is not a time (write it like 200ms or 2s)"),
    Mistake("write: {reset: true}", "write: {rest: true}", "`rest` is no point (did you mean `reset`?)"),
]
IN_SITE = [
    Mistake("gateway: gw", "gateway: g w", "`g w` cannot be a name here"),
    Mistake("9600 8N1", "38400 8N1", "`fan-1`, `fan-2` (acme-x) do not speak 38400 bit/s"),
    Mistake("[0, 40]", "[40, 0]", "the range is empty (put the lower end first)"),
    Mistake("settings: {poles", "settings: {pols", "`acme-x` has no setting `pols`"),
    Mistake("unit: 2, ", "unit: 40, ", "`acme-x` has unit addresses 1 to 31 (correct the address)"),
    Mistake("port: /dev/ttyUSB1", "prot: /dev/ttyUSB1", "unknown key `prot` (did you mean `port`?)"),
    Mistake("serial: 9600 8N2", "serial: 9600,8,N,2", "`9600,8,N,2` is not a serial setting"),
    Mistake("unit: 6", "unit: 5", "`pump-1` has the unit address 5 already"),
    Mistake("{fast: 500ms}", "{fast: 500ms, quik: 1s}", "nothing uses the rate `quik` (leave it out)"),
    Mistake("enabled: false", "enabled: off", "`off` is neither true nor false"),
    Mistake("opc.tcp:", "http:", "`http://127.0.0.1:4840` is not an address of this kind"),
    Mistake("mqtt://127", "127", "`127.0.0.1:1883` is not an address of this kind"),
    Mistake('"output_*"', '"outptu_*"', "(did you mean `output_*`?)"),
    Mistake("pump-1.ready", "pump-1.redy", "(did you mean `pump-1.ready`?)"),
]


def changed(text: str, mistakes: list[Mistake]) -> str:
    for mistake in mistakes:
        assert text.count(mistake.old) == 1, mistake
        text = text.replace(mistake.old, mistake.new)
    return text


def told(folder: Path, in_profile: list[Mistake], in_site: list[Mistake]) -> list[str]:
    """All findings of a site with these mistakes."""
    (folder / "acme-x.yaml").write_text(changed(PROFILE, in_profile), encoding="utf-8")
    (folder / "beta.yaml").write_text(OTHER, encoding="utf-8")
    (folder / "site.yaml").write_text(changed(SITE, in_site), encoding="utf-8")
    return [str(finding) for finding in load_site(folder / "site.yaml")[1]]


def each_once(findings: list[str], mistakes: list[Mistake]) -> bool:
    """True when every mistake is told once and nothing else is."""
    matches = [[mistake for mistake in mistakes if mistake.said in finding] for finding in findings]
    return all(len(found) == 1 for found in matches) and len(findings) == len(mistakes)


def test_without_a_mistake_nothing_is_told(tmp_path: Path) -> None:
    assert told(tmp_path, [], []) == []


@pytest.mark.parametrize("mistake", IN_PROFILE, ids=lambda mistake: mistake.new)
def test_a_mistake_in_a_profile_is_told_once(mistake: Mistake, tmp_path: Path) -> None:
    findings = told(tmp_path, [mistake], [])
    assert each_once(findings, [mistake]), findings
    assert findings[0].startswith(f"{tmp_path / 'acme-x.yaml'}:")


@pytest.mark.parametrize("mistake", IN_SITE, ids=lambda mistake: mistake.new)
def test_a_mistake_in_a_site_is_told_once(mistake: Mistake, tmp_path: Path) -> None:
    findings = told(tmp_path, [], [mistake])
    assert each_once(findings, [mistake]), findings
    assert findings[0].startswith(f"{tmp_path / 'site.yaml'}:")


def test_all_of_them_are_told_at_once(tmp_path: Path) -> None:
    findings = told(tmp_path, IN_PROFILE, IN_SITE)
    assert each_once(findings, [*IN_PROFILE, *IN_SITE]), "\n".join(findings)


@settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.lists(st.sampled_from(IN_PROFILE), unique=True, max_size=4),
    st.lists(st.sampled_from(IN_SITE), unique=True, max_size=3),
)
def test_some_of_them_are_told_at_once(
    tmp_path: Path, in_profile: list[Mistake], in_site: list[Mistake]
) -> None:
    findings = told(tmp_path, in_profile, in_site)
    assert each_once(findings, [*in_profile, *in_site]), "\n".join(findings)


def test_a_name_that_is_missing_in_many_places_is_one_mistake(tmp_path: Path) -> None:
    """It is told where it is needed first, with the other lines."""
    (finding,) = told(tmp_path, [Mistake("bits: {running: 0,", "bits: {runing: 0,", "")], [])
    assert "`running` is no point and no setting (did you mean `runing`?; also in line 71, 74)" in finding
    (finding,) = told(tmp_path, [Mistake("          reset: {bit", "          rset: {bit", "")], [])
    assert finding.endswith("`reset` is no point (did you mean `rset`?)")


def test_repeats_and_circles_are_told_once(tmp_path: Path) -> None:
    wide = Mistake("unit: 0.01 Hz, range: 0..top}\ncommands", "unit: 0.01 Hz, range: 0..999}\ncommands", "")
    (finding,) = told(tmp_path, [wide], [])
    assert "the range of `preset_frequency_1` goes beyond" in finding
    circle = [
        Mistake("{at: 0012H, unit: 0.1 A}", "{at: 0012H, unit: 0.1 A, times: heat}", ""),
        Mistake("{at: 0016H, unit: 1 °C}", "{at: 0016H, unit: 1 °C, times: output_current}", ""),
    ]
    (finding,) = told(tmp_path, circle, [])
    assert "`output_current` needs `heat` needs `output_current`: a circle" in finding


FOREIGN = [
    ("unit: 0.1 A", "scale: 0.1", "unknown key `scale` (here that is `unit`)"),
    ("at: 0012H", "register: 0012H", "unknown key `register` (here that is `at`)"),
    ("unit: 0.1 A", 'unit: "0,1 A"', "`0,1` is not a number (did you mean `0.1`?)"),
    ("unit: 0.1 A", "unit: 0.1A", "`0.1A` is not a unit (did you mean `0.1 A`?)"),
    ("read_max: 16", "read_max: 0x10", "`0x10` is not a number (did you mean `10H`?)"),
    ("      heat:", "      motorHeat:", "`motorHeat` is not a name (did you mean `motor_heat`?)"),
]


@pytest.mark.parametrize(("old", "new", "said"), FOREIGN)
def test_how_others_write_it(old: str, new: str, said: str, tmp_path: Path) -> None:
    findings = told(tmp_path, [Mistake(old, new, said)], [])
    assert any(said in finding for finding in findings), findings
    assert len(findings) == 1
