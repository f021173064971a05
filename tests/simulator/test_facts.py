"""The section ``simulate`` of a profile: what it means, and what is said about mistakes in it."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from gateway.mapping.load import profile_of
from gateway.mapping.profile import Profile
from gateway.mapping.twin import External, Simulate
from gateway.simulator.build import build_drives
from tests.simulator.master import Master
from tests.simulator.plant import line_config, shipped

PROFILE = """\
profile: fan
title: Fan
maker: None
models: [F]
version: 1
documents: {d: Paper}
addresses: {P.<n>: {n: 1, add: 00FFH, example: P.1 = 0100H}}
serial: {baud: [9600], rtu: [8N1]}
settings: {mains: {unit: 1 Hz, range: 0..60, default: 50}}
groups:
  control:
    kind: command
    points:
      word:
        at: 0001H
        image: true
        bits: {run: 0, trip: 1, clear: 2, source: {bit: 3, values: {0: line, 1: panel}}}
      restart: {at: 0002H, access: write, values: {9696H: now}}
  state:
    points: {status: {at: 0010H, bits: {running: 0, on_line: 1}}, last: 0011H, top: 0012H}
  faults: {kind: fault, points: {fault_word: {at: 0013H, bits: {fault_heat: 0}}}}
  parameters: {kind: parameter, points: {ramp: P.1, enter: P.2}}
commands: {stop: {steps: [{write: {run: false}}]}}
simulate:
"""


def findings(section: str) -> tuple[Profile | None, list[str]]:
    text = PROFILE + "".join(f"  {line}\n" for line in section.strip().splitlines())
    profile, found = profile_of(text.encode(), "fan.yaml", "fan")
    return profile, [f"{finding.message} ({finding.remedy})" for finding in found]


def facts(section: str) -> Simulate:
    profile, found = findings(section)
    assert profile is not None and profile.simulate is not None, found
    return profile.simulate


def test_rows_of_factory_contents_start_at_an_address() -> None:
    assert facts("factory: {P.1: [3, 0FH, 0101B], 0012H: 7}").factory == {
        0x100: 3,
        0x101: 15,
        0x102: 5,
        0x12: 7,
    }


def test_amounts_are_numbers_or_names() -> None:
    made = facts("max_frequency: 60\nbase_frequency: mains\nacceleration: 1500ms\ndeceleration: ramp")
    assert (made.max_frequency, made.base_frequency) == (60, "mains")
    assert (made.acceleration, made.deceleration, made.fast_deceleration) == (Fraction(3, 2), "ramp", 1)


def test_one_of_everything() -> None:
    made = facts(
        """
units: {ramp: 0.1 s}
run_when: {source: line}
shows: {on_line: [source, running], top: output_frequency}
codes: {last: {1: 7}}
history: [last]
alarms: {jammed: 9}
external_fault: {trips: fault_heat, by: trip}
reset: clear
actions: {slow: decelerate}
comm_timeout: 2s
locks: [{when: {running: true}, what: [ramp, faults], reason: busy}]
refuses: {read_only: illegal_address}
stores: enter
saving: 50ms
restarts: {restart: now}
"""
    )
    assert made.units == {"ramp": (Fraction(1, 10), "s")}
    assert [term.name for term in made.run_when] == ["source"]
    assert made.shows == {"on_line": ("source", "running"), "top": ("output_frequency",)}
    assert (made.codes, made.history, made.alarms) == ({"last": {1: 7}}, ("last",), {"jammed": 9})
    assert (made.external_fault, made.reset) == (External("fault_heat", "trip"), "clear")
    assert (made.actions, made.comm_timeout, made.saving) == ({"slow": "decelerate"}, 2.0, 0.05)
    assert (made.locks[0].what, made.locks[0].reason) == (("ramp", "faults"), "busy")
    assert (made.refuses, made.stores) == ({"read_only": "illegal_address"}, "enter")
    assert made.restarts["restart"].value == 0x9696


def test_a_setting_that_the_twin_uses_is_used() -> None:
    _, found = findings("max_frequency: mains")
    assert not any("nothing uses" in text for text in found)


def test_without_the_section_there_are_no_facts() -> None:
    profile, _ = profile_of(PROFILE.removesuffix("simulate:\n").encode(), "fan.yaml", "fan")
    assert profile is not None and profile.simulate is None


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("shows: {on_line: runing}", "there is no `runing` (did you mean `running`?)"),
        ("shows: {online: running}", "there is no `online` (did you mean `on_line`?)"),
        ("reset: cleer", "there is no `cleer` (did you mean `clear`?)"),
        ("history: [lost]", "there is no `lost` (did you mean `last`?)"),
        ("max_frequency: mainz", "there is no `mainz` (did you mean `mains`?)"),
        ("acceleration: 3", "`3` is not a time (write it like 200ms or 2s)"),
        ("run_when: {source: lime}", "`source` has no value `lime` (did you mean `line`?)"),
        ("locks: [{when: {running: true}, what: [ramps]}]", "there is no `ramps` (did you mean `ramp`?)"),
        ("external_fault: {trips: fault_heat, by: tripp}", "there is no `tripp` (did you mean `trip`?)"),
        ("external_fault: {trips: fault_heet}", "there is no `fault_heet` (did you mean `fault_heat`?)"),
        ("restarts: {restart: then}", "`restart` has no value `then` (known are now)"),
        ("factory: {Q.1: 3}", "`Q.1` is not an address (did you mean `P.1`?)"),
        ("factory: {P.1: much}", "`much` is not a number (write it like 14"),
        ("factory: {P.1: 65536}", "`65536` does not fit a register (write 0 to FFFFH)"),
        ("codes: {last: {one: 7}}", "`one` is not a number"),
        ("actions: {slow: slowly}", "`slowly` is not known here (use `decelerate`, `coast`"),
        ("comm_timout: 2s", "unknown key `comm_timout` (did you mean `comm_timeout`?)"),
    ],
)
def test_mistakes_are_named(section: str, message: str) -> None:
    profile, found = findings(section)
    assert profile is None
    assert any(text.startswith(message) for text in found), found


def test_facts_about_points_that_a_drive_has_not_are_left_out() -> None:
    """The settings of a drive may leave points out; its twin must not stumble over that."""
    made = shipped("teco-7200gs")
    facts = made.simulate
    assert facts is not None
    gone = {*facts.shows, *facts.units, *facts.history, "fault_reset", "external_fault", "comm_loss_action"}
    points = {name: point for name, point in made.points.items() if name not in gone}
    config = line_config()
    drives = tuple(replace(drive, profile=replace(made, points=points)) for drive in config.drives)
    master = Master(build_drives(replace(config, drives=drives), {})["fan-5"])
    master.write(0x0001, 1, 1000)
    master.wait(10, polling=False)
    assert master.drive.state.communication_lost
    assert master.drive.state.frequency == 0
