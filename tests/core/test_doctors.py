"""What is wrong with a line, told in words: as tags, as alarms, in the report of health."""

from __future__ import annotations

import pytest

from gateway.bridge.api import Diagnosis, Happened
from gateway.bridge.messages import AskHealth, HealthIs
from gateway.core.ailments import SEVERITY, Place, diagnosis
from gateway.core.events import Asked
from gateway.line.doctor.finding import Finding, Illness
from gateway.simulator.faults import Collision, CorruptByte, OtherSpeed
from gateway.tag import Quality
from tests.core.world import World, make_site


def diagnoses(world: World) -> tuple[Diagnosis, ...]:
    world.feed(Asked(world.session, AskHealth(999)))
    reports = [m.health for m in world.told[world.session] if isinstance(m, HealthIs) and m.id == 999]
    return reports[-1].diagnoses


def alarms(world: World, name: str) -> list[str]:
    told = [m.event for m in world.told[world.session] if isinstance(m, Happened)]
    return [event.alarm for event in told if event.name == name and event.alarm.startswith("_north")]


def test_a_sound_line_is_healthy() -> None:
    world = World(make_site(3))
    world.watch({f"fan-{n}.output_frequency": 0.2 for n in (1, 2, 3)})
    world.run(20)
    assert diagnoses(world) == ()
    condition, text, ours = world.read("_north.condition", "_north.diagnosis", "_north.gap_violations")
    assert (condition.value, text.value, ours.value) == ("healthy", "", 0)
    assert not alarms(world, "alarm_raised")


def test_a_silent_drive_is_told_by_name() -> None:
    world = World(make_site(3))
    world.run(2)
    world.drives["fan-2"].connected = False
    world.run(10)
    [one] = diagnoses(world)
    assert (one.code, one.severity, one.drives) == ("drive_silent", "warning", ("fan-2",))
    assert one.text.startswith("fan-2 (unit 6) does not answer (")
    assert one.text.endswith("; 2 others do")
    assert one.remedy.startswith("check its supply")
    assert one.evidence["answering"] == 2


def test_a_watcher_is_told_at_once_when_the_condition_changes() -> None:
    world = World(make_site(2))
    world.watch({"_north.condition": 60.0, "_north.diagnosis": 60.0})
    world.run(5)
    for drive in world.drives.values():
        drive.faults.inject(OtherSpeed(), times=None)
    world.run(12)
    told = world.samples("_north.condition")
    assert {sample.value for sample in told[:-1]} == {"healthy"}
    assert told[-1].value == "wrong_format"
    assert told[-1].time < world.instant().wall - 10**9
    assert "`gateway scan simulated:`" in world.samples("_north.diagnosis")[-1].value


def test_the_words_of_a_diagnosis_that_stands_do_not_change_every_second() -> None:
    world = World(make_site(3))
    world.watch({"_north.diagnosis": 0.5})
    world.run(3)
    world.drives["fan-1"].connected = False
    world.run(40)
    assert not world.samples("_north.diagnosis")[0].value
    assert len({sample.value for sample in world.samples("_north.diagnosis")}) == 2


def test_it_is_an_alarm_while_it_lasts() -> None:
    world = World(make_site(2))
    world.run(3)
    world.drives["fan-1"].faults.inject(Collision(), times=None)
    world.run(12)
    assert alarms(world, "alarm_raised") == ["_north.two_drives_5"]
    world.drives["fan-1"].faults.clear()
    world.run(45)
    assert alarms(world, "alarm_cleared") == ["_north.two_drives_5"]
    assert diagnoses(world) == ()


def test_what_other_events_tell_is_no_alarm_beside() -> None:
    world = World(make_site(2))
    world.run(3)
    world.drives["fan-1"].connected = False
    world.run(20)
    assert not alarms(world, "alarm_raised")
    assert "communication_lost" in world.events()


def test_noise_and_where_it_comes_from() -> None:
    world = World(make_site(3))
    world.watch({f"fan-{n}.output_frequency": 0.2 for n in (1, 2, 3)})
    world.run(1.0)
    for n in range(200):
        world.run(0.1)
        if n % 7 == 0:
            world.drives["fan-3"].faults.inject(CorruptByte(n % 5, 0x10))
    [one] = diagnoses(world)
    assert one.drives == ("fan-3",)
    assert "of fan-3 (unit 7) and of nobody else" in one.text


def test_an_adapter_that_holds_back_what_it_received() -> None:
    world = World(make_site(3))
    world.watch({f"fan-{n}.{tag}": 0.3 for n in (1, 2, 3) for tag in ("output_frequency", "output_current")})
    world.run(5)
    assert diagnoses(world) == ()
    world.adapter.period = 0.016
    world.run(10)
    [one] = diagnoses(world)
    assert one.code == "latency_timer"
    assert one.evidence["on_grid"] > 0.8


def test_a_port_that_is_not_there() -> None:
    world = World(make_site(1))
    world.port_problem = "no such file"
    from gateway.core.events import PortLost

    world.feed(PortLost("north", "no such file"))
    world.run(3)
    [one] = diagnoses(world)
    assert one.text == "the port simulated: is not open: no such file"


def test_figures_of_a_drive_are_tags() -> None:
    world = World(make_site(2))
    world.watch({"fan-1.output_frequency": 0.2})
    world.run(20)
    names = ("_requests", "_answered", "_exceptions", "_turnaround_p50", "_turnaround_max", "_age_share")
    asked, answered, codes, half, longest, share = world.read(*(f"fan-1.{name}" for name in names))
    assert asked.value - 1 <= answered.value <= asked.value
    assert answered.value > 90
    assert codes.value == ""
    assert half.value == pytest.approx(5.0, rel=0.4)
    assert half.value <= longest.value
    assert 40 < share.value <= 100
    sums = world.read("_north.requests", "_north.bytes_sent", "_north.bytes_received", "_north.load")
    assert sums[0].value == world.core.lines.get("north").counters.requests
    assert all(sample.quality is Quality.GOOD for sample in sums)


def test_the_figures_of_a_line_are_those_of_its_drives_together() -> None:
    world = World(make_site(2))
    world.watch({"fan-1.output_frequency": 0.2})
    world.drives["fan-2"].faults.inject(CorruptByte(), times=3)
    world.run(20)
    for name in ("requests", "answered", "timeouts", "damaged", "retries", "bytes_sent"):
        line, *drives = world.read(f"_north.{name}", f"fan-1._{name}", f"fan-2._{name}")
        assert line.value == sum(drive.value for drive in drives), name
    for name in ("age_share", "turnaround_max"):
        line, *drives = world.read(f"_north.{name}", f"fan-1._{name}", f"fan-2._{name}")
        assert line.value == max(drive.value for drive in drives), name
    received, strays, *drives = world.read(
        "_north.bytes_received", "_north.stray_bytes", "fan-1._bytes_received", "fan-2._bytes_received"
    )
    assert received.value == strays.value + sum(drive.value for drive in drives)


EVIDENCE = {
    Illness.PORT_DOWN: {},
    Illness.WRONG_FORMAT: {"garbled": 12, "drives": 2, "seconds": 5.1, "valid": 0},
    Illness.ALL_SILENT: {"drives": 2, "unanswered": 5, "seconds": 6.0, "answered_before": 0},
    Illness.ECHO_MISSING: {"replies_without_echo": 4, "echoes": 0},
    Illness.FOREIGN_MASTER: {"requests": 1, "replies": 3},
    Illness.TWO_DRIVES: {"second_replies": 5, "contradicting": 2, "replies": 9},
    Illness.LATE_ANSWERS: {"replies": 0, "too_late": 3, "milliseconds": 310, "longest": 200},
    Illness.DRIVE_SILENT: {"unanswered": 3, "answering": 1},
    Illness.NOISE: {"damaged": 4, "strays": 1, "replies": 200, "drives": 2},
    Illness.LATENCY_TIMER: {"replies": 64, "on_grid": 0.99, "milliseconds": 16, "spread_ms": 4.1},
    Illness.ECHO_UNDECLARED: {"echoes": 20},
}
UNITS = {
    Illness.FOREIGN_MASTER: (5, 17),
    Illness.TWO_DRIVES: (5,),
    Illness.LATE_ANSWERS: (5,),
    Illness.DRIVE_SILENT: (5,),
}


@pytest.mark.parametrize("illness", Illness)
def test_every_illness_has_words_a_severity_and_a_remedy(illness: Illness) -> None:
    place = Place(make_site(2).lines[0], "gone")
    found = diagnosis(Finding(illness, UNITS.get(illness, ()), EVIDENCE[illness]), place, 7)
    assert found.code == illness
    assert found.severity == SEVERITY[illness]
    assert found.since == 7
    assert len(found.text) > 20
    assert len(found.remedy) > 20
    assert "\n" not in found.text + found.remedy
    assert not found.text.endswith(".")
    if illness in UNITS:
        assert "fan-1 (unit 5)" in found.text
