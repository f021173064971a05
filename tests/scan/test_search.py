"""Whole scans on simulated drives that only hear their own setting."""

from __future__ import annotations

import pytest

from gateway.scan.order import Narrowed, Plan, make_plan
from tests.scan.lines import Wires, format_of, line_of, profiles


def plan(port: str = "serial", all_rounds: bool = False, **narrowed: object) -> Plan:
    return make_plan(profiles(), Narrowed(**narrowed), 0.2, port, all_rounds)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("profile", "serial", "framing", "unit"),
    [
        ("teco-7200gs", "9600 8N2", "rtu", 5),
        ("teco-7200gs", "2400 8N2", "rtu", 31),
        ("s2000", "4800 8N1", "rtu", 31),
        ("s2000", "1200 8O1", "rtu", 1),
        ("shihlin-sl3", "9600 8E1", "rtu", 2),
        ("shihlin-sl3", "38400 8N2", "rtu", 3),
        ("shihlin-sl3", "19200 7E1", "ascii", 4),
    ],
)
def test_a_drive_is_found_with_its_setting_and_its_profile(
    profile: str, serial: str, framing: str, unit: int
) -> None:
    wires = Wires(line_of(serial, [(profile, unit)], framing))  # type: ignore[arg-type]
    report = wires.scan(plan())
    (found,) = report.found
    line = wires.lines[0][0]
    assert found.unit == unit
    assert found.setting.alike == (framing, line.baud, line.format.data_bits, line.format.parity)
    best, *others = found.suggestions
    assert (best.profile.name, best.likely) == (profile, True)
    assert not any(other.likely for other in others)
    assert found.setting.format_for(best.profile) == line.format
    against = [reason.text for reason in best.reasons if not reason.fits]
    assert against == []


def test_all_units_of_a_line_are_found_and_then_it_ends() -> None:
    wires = Wires(line_of("9600 8N2", [("teco-7200gs", 3), ("shihlin-sl3", 9)]))
    report = wires.scan(plan())
    assert [(found.unit, found.suggestions[0].profile.name) for found in report.found] == [
        (3, "teco-7200gs"),
        (9, "shihlin-sl3"),
    ]
    assert [str(setting) for setting in report.tried] == wires.settings
    assert len(wires.settings) < len(plan().rounds)


def test_with_all_it_goes_on_and_asks_nobody_twice() -> None:
    """Stop bits are not seen, so 9600 8N1 after 9600 8N2 would find the same unit again."""
    wires = Wires(line_of("9600 8N2", [("teco-7200gs", 5)]), line_of("19200 8E1", [("shihlin-sl3", 2)]))
    report = wires.scan(plan(all_rounds=True))
    assert [(f.unit, f.setting.baud) for f in report.found] == [(5, 9600), (2, 19200)]
    assert len(report.tried) == len(plan().rounds)


def test_nobody_is_there() -> None:
    whole = plan(units=(1, 2))
    report = Wires().scan(whole)
    assert report.found == []
    assert report.asked == whole.asks
    assert len(report.tried) == len(whole.rounds)


def test_on_a_pseudo_terminal_the_format_is_the_profiles() -> None:
    wires = Wires(line_of("9600 8N2", [("teco-7200gs", 5)]))
    (found,) = wires.scan(plan("pseudo")).found
    assert found.suggestions[0].profile.name == "teco-7200gs"
    assert str(found.setting.format_for(found.suggestions[0].profile)) == "8N2"


def test_bytes_that_are_no_reply_are_told() -> None:
    wires = Wires(noise=[4])
    report = wires.scan(plan(bauds=(9600,), formats=(format_of("8N1"),), framings=("rtu",), units=(3, 4)))
    assert [(str(setting), unit) for setting, unit in report.unclear] == [("9600 8N1 rtu", 4)]


def test_an_unknown_drive_is_found_and_no_profile_is_pressed_on_it() -> None:
    """An SL3 where only the other two are thought of."""
    wires = Wires(line_of("9600 8N2", [("shihlin-sl3", 7)]))
    report = wires.scan(make_plan(profiles()[:2], Narrowed(), 0.2))
    (found,) = report.found
    assert found.unit == 7
    assert found.likely == []


def test_not_one_frame_of_a_scan_writes() -> None:
    wires = Wires(line_of("9600 8N2", [("teco-7200gs", 1), ("s2000", 2), ("shihlin-sl3", 3)]))
    wires.scan(plan(framings=("rtu",), all_rounds=True))
    assert {frame[1] for frame in wires.sent} == {0x03, 0x08}
