"""S4: a drive whose profile knows an identity register is believed once that register matches."""

from __future__ import annotations

from dataclasses import replace

from gateway.mapping.load import profile_of
from gateway.mapping.site import Site
from gateway.simulator.happening import PanelSets
from gateway.tag import Cause, Outcome, Quality, Verdict
from tests.core.world import ENGINEER, START, World, make_site

PROFILE = """\
profile: typed
title: A drive with a nameplate
maker: Nobody
models: [T15]
version: 1
documents: {m: manual}
serial: {baud: [9600], rtu: [8N2], source: m, reply: 5ms..1s}
modbus: {functions: [03H, 10H], read_max: 16, source: m, identity: {drive_type: 15, variant: 1..3}}
groups:
  g:
    source: m
    points:
      status: {at: 0020H, rate: fast, bits: {running: 0, fault: 3}}
      drive_type: {at: 0100H, rate: slow}
      variant: {at: 0101H, rate: slow}
      frequency_command: {at: 0002H, kind: setpoint, unit: 0.01 Hz, range: 0..60}
      run_word: {at: 0001H, kind: command, image: true, bits: {run: 0}}
commands:
  source: m
  run_forward:
    args: {frequency: frequency_command}
    steps: [{write: {run: true, frequency_command: <frequency>}, until: {running: true}, within: 2s}]
  stop: {steps: [{write: {run: false}, until: {running: false}, within: 60s}]}
simulate: {factory: {0100H: [%d, 2]}}
"""


def site_with(drive_type: int) -> Site:
    profile, findings = profile_of((PROFILE % drive_type).encode(), "typed.yaml", "typed")
    assert profile is not None, [str(finding) for finding in findings]
    site = make_site()
    drive = replace(site.drives[0], profile=profile, ranges={}, settings={})
    return replace(site, lines=(replace(site.lines[0], drives=(drive,)),))


def world_with(drive_type: int) -> World:
    world = World(site_with(drive_type))
    world.watch({"fan-1.running": 0.2, "fan-1.drive_type": 1.0, "fan-1._identity": 1.0})
    world.run(3.0)
    return world


def is_refused(outcome: Outcome) -> bool:
    return (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.PRECONDITION)


def test_s4_a_drive_that_matches_is_believed_and_commanded() -> None:
    world = world_with(15)
    assert world.samples("fan-1._identity")[-1].value == "verified"
    assert world.samples("fan-1.running")[-1].quality is Quality.GOOD
    assert world.command("run_forward", frequency=10.0).verdict is Verdict.CONFIRMED
    assert world.core.alarms.standing() == ()


def test_s4_another_model_is_not_believed_and_gets_nothing_but_a_stop() -> None:
    world = world_with(7)
    sample = world.samples("fan-1.running")[-1]
    words = "drive_type shows 7, and typed has 15: another model answers"
    assert (sample.value, sample.quality, sample.reason) == (None, Quality.CONFIGURATION, words)
    assert world.samples("fan-1.drive_type")[-1].value == 7
    assert world.samples("fan-1._identity")[-1].value == words
    assert is_refused(world.command("run_forward", frequency=10.0))
    outcome = world.write("fan-1.frequency_command", 10.0, ENGINEER)
    assert is_refused(outcome)
    assert words in outcome.reason
    assert world.sent() == []
    world.ask_command("stop")
    world.run(2.0)
    assert world.sent()
    assert [alarm.key for alarm in world.core.alarms.standing()] == ["fan-1.identity"]


def test_s4_nothing_is_good_before_the_drive_was_identified() -> None:
    world = World(site_with(15))
    world.watch({"fan-1.running": 0.2})
    world.run(1.0)
    qualities = [sample.quality for sample in world.samples("fan-1.running")]
    assert Quality.GOOD in qualities
    identified = next(at for at, frame in world.wire if frame.startswith("05 03 01 00"))
    good = [s for s in world.samples("fan-1.running") if s.quality is Quality.GOOD]
    assert all(sample.time > START + identified * 1e9 for sample in good)


def test_s4_a_first_write_waits_for_the_identity() -> None:
    world = World(site_with(7))
    world.run(0.002)
    outcome = world.write("fan-1.frequency_command", 10.0, ENGINEER)
    assert is_refused(outcome)
    assert "another model answers" in outcome.reason
    assert world.sent() == []


def test_s4_a_drive_that_comes_back_is_identified_anew() -> None:
    world = world_with(15)
    world.drives["fan-1"].connected = False
    world.run(10.0)
    world.drives["fan-1"].post(PanelSets("drive_type", 9))
    world.drives["fan-1"].connected = True
    world.run(10.0)
    assert is_refused(world.command("run_forward", frequency=10.0))
    world.drives["fan-1"].post(PanelSets("drive_type", 15))
    world.run(2.0)
    assert world.command("run_forward", frequency=10.0).verdict is Verdict.CONFIRMED


def test_s4_a_profile_without_an_identity_register_is_shown_as_unverified() -> None:
    world = World()
    world.watch({"fan-1._identity": 1.0})
    world.run(2.0)
    assert world.samples("fan-1._identity")[-1].value == "unverified"
    assert world.command("run_forward", frequency=10.0).verdict is Verdict.CONFIRMED
