"""A site on paper: DESIGN's traps, in the words that people read."""

from pathlib import Path

import pytest

from gateway.core.core import Core
from gateway.core.planning import line_plans, setup_of, with_baud, with_rates
from gateway.mapping.site import Site
from gateway.terminal.planning import plan_head, plan_notes, plan_object, plan_table
from tests.core.plant import load


def site_of(folder: Path, drives: int, serial: str) -> Site:
    """A site with so many 7200GS on one line."""
    units = "".join(
        f"      fan-{unit}: {{profile: teco-7200gs, unit: {unit}, control: {{lease: off}}}}\n"
        for unit in range(1, drives + 1)
    )
    path = folder / "site.yaml"
    path.write_text(
        "site: plant7\ngateway: gw1\nlines:\n  north:\n"
        f'    port: "simulated:"\n    serial: {serial}\n    drives:\n{units}'
    )
    return load(path)


def test_thirty_one_drives_at_2400_baud(tmp_path: Path) -> None:
    [plan] = line_plans(site_of(tmp_path, 31, "2400 8N2"))
    told = "\n".join(plan_notes(plan))
    assert "the line counts as dead after 2 s" in told
    assert "19 such drives would fit, not 31" in told
    assert "fits: " in told
    assert not plan.forecast.fits
    data = plan_object(plan)
    assert data["comm_loss"][0] | {"floor": 0} == {
        "drive": "fan-1",
        "after": 2.0,
        "floor": 0,
        "fitting": 19,
        "planned": plan.forecast.watchdogs[0].planned,
        "possible": False,
        "fed": False,
    }
    assert data["comm_loss"][0]["floor"] == pytest.approx(3.25, abs=0.01)
    assert data["repairs"][0]["fits"] is True


def test_one_drive_at_9600_baud_is_well(tmp_path: Path) -> None:
    [plan] = line_plans(site_of(tmp_path, 1, "9600 8N2"))
    assert plan.forecast.fits
    assert plan.repairs == ()
    assert plan_head(plan).startswith("line north (rtu 9600 8N2): 1 drive, ")
    assert plan_table(plan).row_count == len(plan.forecast.reads)


def test_parameters_are_not_planned_and_everything_else_is(tmp_path: Path) -> None:
    site = site_of(tmp_path, 1, "9600 8N2")
    [plan] = line_plans(site)
    planned = {name for read in plan.forecast.reads for name in plan.points(read.block)}
    points = site.drives[0].profile.points.values()
    wanted = {p.name for p in points if p.access.readable and p.kind != "parameter"}
    deciders = {p.name for p in points if p.kind == "parameter"}
    assert wanted <= planned
    assert planned - wanted <= deciders


def test_the_forecast_is_what_the_core_itself_plans(tmp_path: Path) -> None:
    """The same blocks, periods and ages as the running core promises to a client that watches all that."""
    from gateway.bridge.messages import Watch
    from gateway.core.events import Asked, Joined, Started
    from gateway.tag import Instant, Role

    site = site_of(tmp_path, 3, "9600 8N2")
    [plan] = line_plans(site)
    core, now = Core(site, "0"), Instant(0.0, 0)
    watched = {
        f"{drive.name}.{point.name}": site.rates[point.rate]
        for drive in site.drives
        for point in drive.profile.points.values()
        if point.access.readable and point.kind != "parameter"
    }
    for event in (Started(), Joined(1, "all", Role.VIEWER), Asked(1, Watch(1, watched))):
        core.step(event, now)
    assert {read.block for read in plan.forecast.reads} == set(core.lines.plan("north").blocks)


def test_what_if(tmp_path: Path) -> None:
    site = site_of(tmp_path, 2, "2400 8N2")
    faster = with_baud(site, 9600)
    assert setup_of(faster, faster.lines[0]).settings.baud == 9600
    assert (line_plans(faster)[0].mute, faster.lines[0].baud) == ((), 9600)
    [beyond] = line_plans(with_baud(site, 38400))
    assert beyond.mute == ("fan-1", "fan-2")
    assert any("fan-1, fan-2: cannot be set to 38400 bit/s" in note for note in plan_notes(beyond))
    relaxed = with_rates(site, {"fast": 2.0})
    assert setup_of(relaxed, relaxed.lines[0]).wants.keys() == {"fast", "normal", "slow"}
    before, after = line_plans(site)[0].forecast, line_plans(relaxed)[0].forecast
    assert after.demand < before.demand
    assert site.rates["fast"] == 0.2
