"""Steps of a command that are only for some states of the drive."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gateway.mapping.load import builtin_mappings, profile_of
from gateway.mapping.site import Site
from gateway.tag import Verdict
from tests.core.world import World, make_site

TIDY = """
  tidy:
    help: Stop it if it runs, then close terminal 5
    steps:
      - when: {running: true}
        write: {run: false, reverse: false}
        until: {running: false}
        within: 60s
      - write: {input_5: true}

simulate:"""


def site() -> Site:
    """A 7200GS whose profile has one command more."""
    text = (builtin_mappings() / "teco-7200gs.yaml").read_text(encoding="utf-8")
    profile, findings = profile_of(
        text.replace("\nsimulate:", TIDY, 1).encode(), "teco-7200gs.yaml", "teco-7200gs"
    )
    assert profile is not None, findings
    plain = make_site()
    [line] = plain.lines
    [drive] = line.drives
    drive = replace(drive, profile=profile)
    return replace(plain, lines=(replace(line, drives=(drive,)),))


@pytest.fixture
def world() -> World:
    world = World(site())
    world.run(1.0)
    return world


def test_a_step_whose_condition_does_not_hold_is_left_out(world: World) -> None:
    assert world.command("tidy").verdict is Verdict.CONFIRMED
    assert len(world.sent()) == 1
    [closed] = world.read("fan-1.input_5")
    assert closed.value is True


def test_a_step_whose_condition_holds_is_done_before_the_next(world: World) -> None:
    world.command("run_forward", frequency=20.0)
    before = len(world.sent())
    assert world.command("tidy").verdict is Verdict.CONFIRMED
    stop, close = world.sent()[before:]
    assert stop.startswith("05 10 00 01 00 01 02 00 00")
    assert close.startswith("05 10 00 01 00 01 02 00 10")
    running, closed = world.read("fan-1.running", "fan-1.input_5")
    assert (running.value, closed.value) == (False, True)
