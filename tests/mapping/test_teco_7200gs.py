"""The 7200GS profile against facts taken by hand from the document (its sections in the comments)."""

from __future__ import annotations

from fractions import Fraction

import pytest

from gateway.mapping.profile import Access, Argument, Constant, Kind, Point
from gateway.tag import Role, ValueType
from tests.mapping.texts import teco

PROFILE = teco()

BITS = {
    # 9.1
    0x0001: {0: "run", 1: "reverse", 2: "external_fault", 3: "fault_reset",
             4: "input_5", 5: "input_6", 6: "input_7", 7: "input_8"},
    0x0009: {0: "output_9_10", 1: "output_25_27", 2: "output_26_27"},
    # 9.2
    0x0020: {0: "running", 1: "running_reverse", 2: "ready", 3: "fault", 4: "parameter_error",
             5: "output_9_10_state", 6: "output_25_27_state", 7: "output_26_27_state"},
    0x0021: {0: "fault_overcurrent", 1: "fault_overvoltage", 2: "fault_overload", 3: "fault_overheat",
             5: "fault_fuse", 7: "fault_external", 8: "fault_control_circuit", 9: "fault_motor_overload",
             0xB: "fault_power_loss", 0xC: "fault_low_voltage"},
    0x0022: {0: "link_parameter_error", 1: "link_writing_mode_error", 2: "link_parameter_number_error",
             3: "link_out_of_range", 4: "link_incorrect_setting", 5: "link_nv_ram_fault",
             6: "link_command_not_received", 7: "link_bcc_fault", 8: "link_dp_ram_fault"},
    0x002C: {0: "status_running", 1: "zero_speed", 2: "speed_agree", 3: "agreed_frequency_setting",
             4: "frequency_detection_1", 5: "frequency_detection_2", 6: "status_ready", 7: "undervoltage",
             8: "base_block", 9: "frequency_from_keypad", 0xA: "run_from_keypad", 0xB: "overtorque",
             0xC: "frequency_reference_missing", 0xD: "braking_transistor_fault", 0xE: "status_fault",
             0xF: "communication_fault"},
    0x003D: {0: "crc_error", 1: "length_error", 3: "parity_error", 4: "overrun_error", 5: "frame_error",
             6: "timeout_error"},
}  # fmt: skip
"""Register to bit to name: every single bit that the tables print."""

SCALES = {
    # 9.1
    0x0002: ("frequency_command", Fraction(1, 100), "Hz"),
    # 9.2
    0x0023: ("frequency_reference", Fraction(1, 100), "Hz"),
    0x0024: ("output_frequency", Fraction(1, 100), "Hz"),
    0x0027: ("output_current", Fraction(1, 10), "A"),
    0x0028: ("output_voltage", Fraction(1), "V"),
    0x0029: ("master_speed_input", Fraction(10, 1023), "V"),
    0x002A: ("auxiliary_input", Fraction(10, 1023), "V"),
    0x0031: ("dc_bus_voltage", Fraction(1), "V"),
    0x0032: ("output_power", Fraction(1, 10), "kW"),
}
PLAIN = {0x002B: "scan_count", 0x002D: "output_monitor", 0x003E: "dp_ram_defective_address",
         0x003F: "dp_ram_defective_data"}  # fmt: skip
NIBBLES = {0: "previous_fault_1", 4: "previous_fault_2", 8: "previous_fault_3", 12: "previous_fault_4"}
LISTED = {0x01, 0x02, 0x09, *range(0x20, 0x25), *range(0x27, 0x2E), 0x31, 0x32, 0x33, 0x3D, 0x3E, 0x3F, 0x40}
"""All control and monitor registers that the document has."""


def at(address: int) -> list[Point]:
    return [point for point in PROFILE.points.values() if point.address == address]


def test_every_control_and_monitor_register_and_no_other() -> None:
    assert {point.address for point in PROFILE.points.values() if point.address < 0x100} == LISTED


@pytest.mark.parametrize("address", BITS, ids="{:04X}H".format)
def test_bits(address: int) -> None:
    found = {point.encoding.bit: point.name for point in at(address)}
    assert found == BITS[address]
    assert all(point.encoding.value_type is ValueType.BOOLEAN for point in at(address))
    assert {point.notation for point in at(address)} == {f"{address:04X}H"}


@pytest.mark.parametrize("address", SCALES, ids="{:04X}H".format)
def test_scales(address: int) -> None:
    (point,) = at(address)
    encoding = point.encoding
    assert (point.name, encoding.scale, encoding.symbol) == SCALES[address]
    assert encoding.value_type is ValueType.NUMBER
    assert (encoding.times, encoding.offset, encoding.width) == (None, 0, 0)


@pytest.mark.parametrize("address", PLAIN, ids="{:04X}H".format)
def test_plain_counts(address: int) -> None:
    (point,) = at(address)
    assert point.name == PLAIN[address]
    assert point.encoding.value_type is ValueType.INTEGER


def test_four_faults_in_one_register() -> None:
    assert {point.encoding.bit: point.name for point in at(0x33)} == NIBBLES
    assert {point.encoding.width for point in at(0x33)} == {4}
    assert all(point.provenance.doubt for point in at(0x33))


def test_dip_switches_are_shown_as_found() -> None:
    fields = {point.name: (point.encoding.bit, point.encoding.width) for point in at(0x40)}
    assert fields["station_address"] == (0, 5)
    assert fields["baud_switches"] == (8, 2)
    assert sum(width for _, width in fields.values()) == 12
    assert not PROFILE.points["baud_switches"].encoding.values


def test_monitors_are_never_written() -> None:
    for point in PROFILE.points.values():
        if 0x20 <= point.address <= 0x40:
            assert point.access is Access.READ
            assert point.role is None


def test_control_words() -> None:
    operation, outputs = PROFILE.words[0x01], PROFILE.words[0x09]
    assert operation.image and outputs.image
    assert (operation.always_mask, operation.always_bits) == (0xFF00, 0)
    assert (outputs.always_mask, outputs.always_bits) == (0xFFF8, 0)
    assert operation.pulse_mask == 1 << 3
    assert PROFILE.points["fault_reset"].pulse == 0.2


def test_run_is_reached_by_commands_only() -> None:
    for name in ("run", "reverse", "fault_reset"):
        assert PROFILE.points[name].by_command_only
    for name in ("external_fault", "input_5", "output_9_10", "frequency_command"):
        assert not PROFILE.points[name].by_command_only
        assert PROFILE.points[name].role is Role.OPERATOR
    assert PROFILE.points["frequency_command"].kind is Kind.SETPOINT


def test_the_frequency_is_limited_by_a_setting() -> None:
    limits = PROFILE.points["frequency_command"].limits
    assert limits is not None
    assert (limits.low, limits.high) == (0, "max_frequency")
    assert PROFILE.settings["max_frequency"].default == 60


def test_sn_08() -> None:
    # 9.3: the digits are printed from bit 3 down to bit 0; 0107H
    fields = {point.name: point for point in at(0x0107)}
    assert {name: (p.encoding.bit, p.encoding.width) for name, p in fields.items()} == {
        "frequency_source": (0, 1),
        "run_source": (1, 1),
        "comm_loss_action": (2, 2),
    }
    assert dict(fields["comm_loss_action"].encoding.values) == {
        0b00: "decelerate_bn_02",
        0b01: "coast",
        0b10: "decelerate_bn_04",
        0b11: "keep_running",
    }
    for point in fields.values():
        assert point.encoding.value_type is ValueType.INTEGER
        assert (point.role, point.notation, point.rate) == (Role.ENGINEER, "Sn-08", "slow")
        assert [term.text for term in point.only_when] == ["running: false"]
    assert not PROFILE.words[0x0107].image


def test_serial_and_modbus() -> None:
    # 3, 7.1, 8, 4
    serial, modbus = PROFILE.serial, PROFILE.modbus
    assert serial.baud == (9600, 4800, 2400)
    assert [str(form) for form in serial.rtu] == ["8N2"]
    assert (serial.ascii, serial.units) == ((), (1, 31))
    assert (serial.comm_loss.after, serial.comm_loss.action) == (2.0, "comm_loss_action")
    assert modbus.functions == (0x03, 0x10)
    assert (modbus.write_one, modbus.read_max, modbus.write_max) == (0x10, 16, 16)
    assert modbus.bridge is False
    assert modbus.probe == "running"


def test_errors() -> None:
    # 10, and the 06H of section 8
    assert {code: meaning.name for code, meaning in PROFILE.errors.items()} == {
        0x01: "illegal_function",
        0x02: "illegal_address",
        0x03: "illegal_count",
        0x06: "busy",
        0x21: "illegal_value",
        0x22: "locked",
        0x31: "drive_failure",
        0x32: "drive_failure",
        0x33: "drive_failure",
    }


@pytest.mark.parametrize(("name", "reverse"), [("run_forward", False), ("run_reverse", True)])
def test_run_and_frequency_go_in_one_message(name: str, reverse: bool) -> None:
    # 11, steps 1 and 3
    command = PROFILE.commands[name]
    (step,) = command.steps
    assert dict(step.write) == {
        "run": Constant(Fraction(1)),
        "reverse": Constant(Fraction(reverse)),
        "frequency_command": Argument("frequency"),
    }
    assert {PROFILE.points[point].address for point in step.write} == {1, 2}
    assert [term.text for term in step.until] == ["running: true", f"running_reverse: {str(reverse).lower()}"]
    assert [term.text for term in command.only_when] == ["run_source: line", "frequency_source: line"]
    assert [term.ranges for term in command.only_when] == [((0, 0),), ((0, 0),)]
    assert command.args == {"frequency": "frequency_command"}
    assert not command.urgent


def test_stop_waits_for_nothing() -> None:
    # 11, step 4
    stop = PROFILE.commands["stop"]
    (step,) = stop.steps
    assert stop.urgent
    assert stop.only_when == ()
    assert dict(step.write) == {"run": Constant(Fraction(0)), "reverse": Constant(Fraction(0))}


def test_what_is_not_from_the_document_says_so() -> None:
    assert not [point.name for point in PROFILE.points.values() if point.provenance.similar]
    for name in ("frequency_from_keypad", "run_from_keypad"):
        doubt = PROFILE.points[name].provenance.doubt
        assert doubt == "that 1 means the keypad is said of a similar model only (a1000 p.559)"
    assert all(point.provenance.place for point in PROFILE.points.values())
    assert PROFILE.facts["modbus.bridge"].doubt
    assert PROFILE.facts["serial.reply"].place == "7.2 (2)"


PARAMETERS = {
    # 9.3: first and last of each group; 0117H (Sn-24) is missing
    "Sn": [*range(0x0100, 0x0117), *range(0x0118, 0x011C)],
    "Cn": [*range(0x0200, 0x022A)],
    "An": [*range(0x0400, 0x0409)],
    "bn": [*range(0x0500, 0x050C)],
}
NUMBERS = {"Sn": [*range(1, 24), *range(25, 29)], "Cn": range(1, 43), "An": range(1, 10), "bn": range(1, 13)}


def parameters(group: str) -> list[Point]:
    return [point for point in PROFILE.points.values() if point.notation.startswith(group)]


@pytest.mark.parametrize("group", PARAMETERS)
def test_every_parameter_is_where_the_document_has_it(group: str) -> None:
    places = {point.notation: point.address for point in parameters(group)}
    numbers = [f"{group}-{number:02d}" for number in NUMBERS[group]]
    assert places == dict(zip(numbers, PARAMETERS[group], strict=True))


def test_parameters_have_no_scale_and_need_an_engineer() -> None:
    for point in (p for group in PARAMETERS for p in parameters(group)):
        assert (point.encoding.symbol, point.encoding.scale, point.kind) == (None, 1, Kind.PARAMETER)
        assert point.role is (Role.ENGINEER if point.access.writable else None)
        assert point.provenance.doubt
        assert point.wear == "unknown"


def test_what_is_locked_while_running() -> None:
    # 10, 22H
    for point in parameters("Sn") + parameters("Cn"):
        locks = [term.text for term in point.only_when]
        assert ("running: false" in locks) == point.access.writable
        second = "vf_pattern: [0FH, FFH]" in locks
        assert second == (0x0201 <= point.address <= 0x0207)
    assert not any(point.only_when for point in parameters("An") + parameters("bn"))


GP, SL = "control_mode: vf", "control_mode: sensorless"


def test_what_depends_on_the_control_mode() -> None:
    # 9.3, second note: GP is V/f mode, SL sensorless
    found = {
        point.name: [term.text for term in point.when] for point in PROFILE.points.values() if point.when
    }
    assert found == {
        "overtorque_measure": [SL],
        "slip_compensation_regenerating": [SL],
        "po_36f_frequency": [GP],
        "iron_loss": [GP],
        "motor_leakage_inductance": [SL],
        "torque_compensation_limit": [GP],
        "torque_limit": [SL],
    }
    assert {point.notation for point in at(0x021F)} == {"Cn-32"}
    assert {point.notation for point in at(0x0220)} == {"Cn-33"}


def test_initialising_the_drive_is_a_danger() -> None:
    (point,) = at(0x0102)
    assert set(point.danger) == {0b1110, 0b1111}
    assert [p.name for p in PROFILE.points.values() if p.danger] == ["access_level"]


def test_no_command_comes_near_a_danger() -> None:
    written = {name for command in PROFILE.commands.values() for step in command.steps for name in step.write}
    assert not any(PROFILE.points[name].danger for name in written)
