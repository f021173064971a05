"""What clients are told of a site when they join: each point with its place, range and source."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from gateway.bridge.api import DriveInfo, PointInfo
from tests.core.world import World, make_site, site_of


def drive(profile: str, **settings: Fraction) -> DriveInfo:
    [found] = World(site_of(profile, **settings)).core.catalogue.drives
    return found


def told(found: DriveInfo, name: str, *fields: str) -> tuple[Any, ...]:
    [point] = [point for point in found.points if point.name == name]
    return tuple(getattr(point, field) for field in fields)


def test_the_place_is_written_as_the_manual_writes_it() -> None:
    s2000, sl3 = drive("s2000"), drive("shihlin-sl3")
    assert told(s2000, "analog_output_2", "register") == ("0008H",)
    assert told(s2000, "terminal_5", "register") == ("0000H.4",)
    assert told(s2000, "panel_type", "register") == ("0011H.3-4",)
    assert told(sl3, "p_37", "register") == ("P.37",)


def test_what_is_doubtful_says_why() -> None:
    s2000, sl3 = drive("s2000"), drive("shihlin-sl3")
    assert told(s2000, "ready", "source", "doubt") == ("s2000 10 (2)", "")
    assert told(s2000, "operator_ope", "doubt") == ("not explained",)
    assert told(sl3, "stall", "source", "doubt") == ("se3 p.182", "similar model, unverified")
    assert told(sl3, "speed_count_1", "doubt") == (
        "similar model, unverified; no scale; how it differs from 102BH is not known",
    )


def test_the_step_is_what_one_count_is_worth_where_that_is_always_the_same() -> None:
    s2000, teco = drive("s2000", e1_04=Fraction(50)), drive("teco-7200gs")
    assert told(s2000, "analog_output_1", "step", "low", "high", "unit") == (11 / 726, -11.0, 11.0, "V")
    assert told(teco, "frequency_reference", "step", "unit") == (0.01, "Hz")
    assert told(teco, "running", "step", "low", "high") == (None, None, None)
    assert told(s2000, "frequency_command", "step", "low", "high") == (None, 0.0, 50.0), (
        "counts in many units"
    )


def test_only_what_a_client_may_write_alone_is_writable() -> None:
    teco = drive("teco-7200gs")
    assert told(teco, "run", "kind", "readable", "writable") == ("command", True, False)
    assert told(teco, "output_frequency", "readable", "writable") == (True, False)
    assert told(teco, "frequency_command", "kind", "writable") == ("setpoint", True)


def test_an_argument_is_told_as_the_point_that_it_sets() -> None:
    [found] = World(make_site()).core.catalogue.drives
    [run] = [command for command in found.commands if command.name == "run_forward"]
    [argument] = run.args
    assert (argument.name, argument.point) == ("frequency", "frequency_command")
    assert (argument.unit, argument.low, argument.high, dict(argument.values)) == ("Hz", 0.0, 60.0, {})


def test_what_the_gateway_tells_of_a_drive_is_beside_its_points() -> None:
    found = World(make_site()).core.catalogue.drives[0]
    own = [point for point in found.points if point.name.startswith("_")]
    assert len(own) > 10
    assert all(isinstance(point, PointInfo) and not point.writable for point in own)
    assert {point.node for point in own} == {f"fan-1.{point.name}" for point in own}
