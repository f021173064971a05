"""Rules of the S2000's sheet that are more than a register and a bit."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import pytest

from gateway.mapping.profile import Access, Argument, Constant, Kind, Point
from gateway.tag import Cause, Role, Verdict
from tests.profiles.life import Life
from tests.profiles.s2000 import BROADCAST, SPARE
from tests.profiles.test_facts import fact_of, fact_told, profile, told

S2000 = profile("s2000")
POINTS = S2000.points


def case(point: Point, number: int) -> tuple[list[str], Fraction, str | None, str | None]:
    found = point.cases[number]
    cut = found.encoding
    return [term.text for term in found.when], cut.scale, cut.times, cut.symbol


def test_serial() -> None:
    # 3: F5-02 = 2 is the factory setting, 4800 bps; F5-03 = 0; 4 A: addresses 0 to 31, 0 is everybody
    serial = S2000.serial
    assert serial.baud[0] == 4800
    assert sorted(serial.baud) == [1200, 2400, 4800, 9600]
    assert [str(form) for form in serial.rtu] == ["8N1", "8E1", "8O1"]
    assert (serial.ascii, serial.units) == ((), (1, 31))
    assert S2000.facts["serial.rtu"].doubt
    assert told("s2000")["serial"]["baud"][0] == 4800


def test_modbus() -> None:
    # 4
    modbus = S2000.modbus
    assert modbus.functions == (0x03, 0x08, 0x10)
    assert (modbus.write_one, modbus.read_max, modbus.write_max) == (0x10, 16, 16)
    assert (modbus.bridge, modbus.probe) == (False, "loop_back")


def test_a_dead_line_stops_nobody_by_default() -> None:
    # 3: F5-04 = 3, F5-05 = 1
    loss = S2000.serial.comm_loss
    assert (loss.after, loss.action) == (None, "f5_04")
    assert [term.text for term in loss.when] == ["f5_05: with_detection"]
    action, detection = S2000.settings["f5_04"], S2000.settings["f5_05"]
    assert dict(action.values) == {
        0: "decelerate_c1_02",
        1: "decelerate_c1_09",
        2: "coast",
        3: "keep_running",
    }
    assert (action.default, detection.default) == (3, 1)


def test_settings_of_the_panel() -> None:
    settings = {setting["name"]: setting for setting in told("s2000")["settings"]}
    assert set(settings) == {"command_shift", "c1_01", "c1_02", "g1_03", "e1_04", "f5_04", "f5_05", "h1_02"}
    assert settings["e1_04"]["default"] is None
    assert settings["g1_03"]["range"] == [0, 39]
    assert settings["c1_01"]["values"] == {"0": "operator", "1": "terminal", "2": "serial", "3": "option"}
    assert settings["command_shift"]["similar_model"] is True


def test_the_frequency_is_hertz_whatever_the_drive_counts_in() -> None:
    # 10 (1): 000FH bit 0; 3: G1-03; r/min = 120 x frequency / poles
    point = POINTS["frequency_command"]
    assert case(point, 0) == (["frequency_unit: tenth_hz"], Fraction(1, 10), None, "Hz")
    by_g1_03 = "frequency_unit: by_g1_03"
    assert case(point, 1) == ([by_g1_03, "g1_03: 0"], Fraction(1, 100), None, "Hz")
    assert case(point, 2) == ([by_g1_03, "g1_03: 1"], Fraction(1, 10_000), "e1_04", "Hz")
    assert case(point, 3) == ([by_g1_03, "g1_03: 2..39"], Fraction(1, 120), "g1_03", "Hz")
    assert len(point.cases) == 4
    assert point.kind is Kind.SETPOINT


def test_the_unit_of_the_frequency_is_not_changed_while_running() -> None:
    unit = POINTS["frequency_unit"]
    assert [term.text for term in unit.only_when] == ["running: false"]
    assert unit.role is Role.ENGINEER


def test_arming_a_terminal_keeps_what_stands_in_000fh() -> None:
    word = S2000.words[0x000F]
    assert not word.image
    assert (word.always_mask, word.always_bits) == (0x0FFE, 0)


def test_unused_bits_are_written_zero() -> None:
    # 10 (1): 0000H 8 to F; 0009H 3 to 5 and 8 to F
    run, outputs = S2000.words[0x0000], S2000.words[0x0009]
    assert run.image and outputs.image
    assert (run.always_mask, run.always_bits) == (0xFF00, 0)
    assert (outputs.always_mask, outputs.always_bits) == (0xFF38, 0)


def test_spare_registers_are_nobodys() -> None:
    named = {point.address + offset for point in POINTS.values() for offset in range(point.words)}
    assert named.isdisjoint(SPARE)


def test_analog_outputs_reach_eleven_volts_both_ways() -> None:
    for name in ("analog_output_1", "analog_output_2"):
        point = POINTS[name]
        assert point.encoding.scale * 726 == 11
        assert point.limits is not None
        assert (point.limits.low, point.limits.high) == (-11, 11)


def test_status_is_never_written() -> None:
    for point in POINTS.values():
        if 0x10 <= point.address <= 0x1A:
            assert (point.access, point.role) == (Access.READ, None)


def test_temporary_and_final_refusals() -> None:
    # 4: 24H while saving, 23H at low voltage; 21H and 22H stay
    errors = S2000.errors
    assert errors[0x24].retry == 0.2
    assert [term.text for term in errors[0x23].retry_when] == ["warning_uv: false"]
    for code in (0x01, 0x02, 0x03, 0x21, 0x22):
        assert (errors[code].retry, errors[code].retry_when) == (None, ())


def test_parameters_act_after_enter_to_ram() -> None:
    # 8
    for point in POINTS.values():
        if point.group == "parameters":
            assert point.then == "activate_parameters"
            assert [term.text for term in point.only_when] == ["running: false"]
    eeprom, ram = POINTS["enter_eeprom"], POINTS["enter_ram"]
    assert (eeprom.access, ram.access) == (Access.WRITE, Access.WRITE)
    assert (eeprom.wear, ram.wear) == (100_000, None)
    assert eeprom.by_command_only and ram.by_command_only
    for command, register in (("activate_parameters", "enter_ram"), ("store_parameters", "enter_eeprom")):
        (step,) = S2000.commands[command].steps
        assert dict(step.write) == {register: Constant(Fraction(0))}


def test_initialising_the_drive_is_a_danger() -> None:
    assert [point.name for point in POINTS.values() if point.danger] == ["initialise"]
    assert set(POINTS["initialise"].danger) == set(range(1, 0x10000))


@pytest.mark.parametrize(("name", "word", "reverse"), [("run_forward", 1, False), ("run_reverse", 2, True)])
def test_run_and_frequency_go_in_one_message(name: str, word: int, reverse: bool) -> None:
    (step,) = S2000.commands[name].steps
    assert dict(step.write) == {
        "run_command": Constant(Fraction(word)),
        "frequency_command": Argument("frequency"),
    }
    assert [term.text for term in step.until] == ["running: true", f"running_reverse: {str(reverse).lower()}"]


def test_stop_waits_for_nothing() -> None:
    stop = S2000.commands["stop"]
    (step,) = stop.steps
    assert stop.urgent and not stop.only_when
    assert dict(step.write) == {"run_command": Constant(Fraction(0))}


def test_broadcast_has_a_layout_of_its_own() -> None:
    layout = S2000.broadcast
    assert layout is not None
    expected = {fact.name: fact for fact in BROADCAST}
    assert {point.name: fact_of(point) for point in layout.points.values()} == expected
    shown = told("s2000")["broadcast"]
    assert {point["name"]: fact_told(point) for point in shown["points"]} == expected
    word = layout.words[0x0001]
    # bits 2, 3 and 6 to B are not in use
    assert (word.image, word.always_mask, word.always_bits) == (True, 0x0FCC, 0)
    assert layout.points["frequency_all"].encoding.scale * 30_000 == 100


def test_broadcast_commands_are_asked_of_every_drive() -> None:
    layout = S2000.broadcast
    assert layout is not None
    motion = {"run_forward_all", "run_reverse_all", "stop_all", "reset_fault_all"}
    others = {"set_frequency_all", "set_external_fault_all", *(f"set_terminal_{n}_all" for n in range(5, 9))}
    assert set(layout.commands) == motion | others
    written = {name for c in layout.commands.values() for s in c.steps for name in s.write}
    assert written == set(layout.points), "everything in the layout can be sent"
    assert all(term.name in POINTS for c in layout.commands.values() for s in c.steps for term in s.until)


def test_what_the_document_says_beside_its_registers_is_told() -> None:
    text = json.dumps(told("s2000"))
    for fact in ("F5-02 (0: 1200", "G1-04 (1: r/min", "WI-K2", "SI-K2", "4 A (none to all drives at once)"):
        assert fact in text, fact
    layout = S2000.broadcast
    assert layout is not None
    assert "Reverse command 1:Run 0:Stop" in layout.points["reverse_all"].provenance.doubt


def test_what_is_not_in_the_document_says_so() -> None:
    similar = {point.name for point in POINTS.values() if point.provenance.similar}
    assert similar == {"speed_agree"}, "blank in the document"
    for name in ("speed_agree", "preset_frequency_1", "language", "initialise", "enter_eeprom"):
        assert POINTS[name].provenance.doubt
    for name in ("warning", "fault"):
        origin = POINTS[name].provenance
        assert (origin.document, "a1000 U1-12" in (origin.doubt or "")) == ("s2000", True)


def test_firmware_that_has_the_command_words_one_higher() -> None:
    assert {point.name for point in POINTS.values() if point.shift == "command_shift"} == {
        "run_command",
        "frequency_command",
        *(f"terminal_{n}" for n in range(3, 9)),
        "fault_reset",
    }
    assert {p["name"] for p in told("s2000")["points"] if p["shift"]} >= {"run_command", "frequency_command"}


@pytest.mark.parametrize(
    ("settings", "unit", "frame"),
    [
        # 30 Hz in 0.1 Hz, 0.01 Hz, 0.01 % of 60 Hz, r/min of a motor with 4 poles
        ("g1_03: 4", "tenth_hz", "01 10 00 00 00 02 04 00 01 01 2C"),
        ("g1_03: 0", "by_g1_03", "01 10 00 00 00 02 04 00 01 0B B8"),
        ("g1_03: 1", "by_g1_03", "01 10 00 00 00 02 04 00 01 13 88"),
        ("g1_03: 4", "by_g1_03", "01 10 00 00 00 02 04 00 01 03 84"),
        # the firmware with both words one higher
        ("command_shift: 1", "tenth_hz", "01 10 00 01 00 02 04 00 01 01 2C"),
    ],
)
def test_thirty_hertz_on_the_wire(settings: str, unit: str, frame: str, tmp_path: Path) -> None:
    drive = Life(tmp_path, "s2000", unit=1, serial="9600 8N1", settings=f"{{e1_04: 60, {settings}}}").found()
    drive.put("frequency_unit", unit)
    drive.do("run_forward", frequency=30.0)
    assert drive.sent()[-1].startswith(frame)
    assert drive.value("frequency_command") == 30.0


def test_a_drive_that_listens_to_its_terminals_is_not_commanded(tmp_path: Path) -> None:
    settings = "{e1_04: 60, c1_02: terminal}"
    drive = Life(tmp_path, "s2000", unit=1, serial="9600 8N1", settings=settings).found()
    outcome = drive.do("run_forward", verdict=Verdict.REFUSED, frequency=30.0)
    assert (outcome.cause, outcome.reason) == (Cause.PRECONDITION, "needs c1_02: serial")
    assert drive.sent() == []


def test_no_setting_no_drive(tmp_path: Path) -> None:
    """100 % must be said by the site."""
    with pytest.raises(AssertionError, match="e1_04"):
        Life(tmp_path, "s2000", unit=1, serial="9600 8N1")


def words_written(drive: Life, register: int) -> list[tuple[float, int]]:
    """When a register was written alone, and what."""
    start = f"01 10 {register >> 8:02X} {register & 255:02X} 00 01 02"
    frames = [(at, frame) for at, frame in drive.wire if frame.startswith(start)]
    return [(at, int(frame.split()[7] + frame.split()[8], 16)) for at, frame in frames]


def test_the_reset_is_held_for_its_time_and_taken_back(tmp_path: Path) -> None:
    drive = Life(tmp_path, "s2000", unit=1, serial="9600 8N1", settings="{e1_04: 60, h1_02: fault_reset}")
    drive.found()
    drive.put("terminal_6", True)
    drive.do("run_forward", frequency=20.0)
    drive.trips("fault_oc")
    drive.do("stop")
    drive.do("reset_fault")
    (closed, held), (opened, rest) = words_written(drive, 0)[-2:]
    assert (held, rest) == (0b10_1000, 0b10_0000), "terminal 6 stays closed"
    assert 0.2 <= opened - closed < 0.4
    assert drive.value("fault") is False


def test_where_terminal_4_does_not_reset_it_is_a_terminal_like_the_others(tmp_path: Path) -> None:
    drive = Life(tmp_path, "s2000", unit=1, serial="9600 8N1", settings="{e1_04: 60}")
    drive.found()
    drive.put("terminal_4", True)
    drive.put("terminal_5", True)
    assert words_written(drive, 0)[-1][1] == 0b1_1000
    refused = drive.do("reset_fault", verdict=Verdict.REFUSED)
    assert "h1_02: fault_reset" in refused.reason
    refused = drive.do("run_forward_all", verdict=Verdict.REFUSED, frequency=50.0)
    assert "asked of the line" in refused.reason


@pytest.mark.parametrize(("shift", "first"), [(0, 2), (1, 3)])
def test_a_hole_ends_where_firmware_has_moved_a_word_to(shift: int, first: int, tmp_path: Path) -> None:
    settings = f"{{e1_04: 60, command_shift: {shift}}}"
    drive = Life(tmp_path, "s2000", unit=1, serial="9600 8N1", settings=settings).found()
    facts = drive.core.drives[0].facts
    assert facts.holes[0] == (first, 6)
    assert drive.core.drives[0].profile.points["frequency_command"].address == 1 + shift
