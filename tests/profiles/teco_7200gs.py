"""What the manual of the 7200GS's SI-M card says, by its sections."""

from tests.profiles.facts import Fact, amount, bits, counts, field

RW, RO = "read-write", "read"

CONTROL: list[Fact] = [
    # 9.1
    *bits(0x0001, "run reverse external_fault fault_reset input_5 input_6 input_7 input_8", RW),
    amount(0x0002, "frequency_command", "1/100", "Hz", RW),
    *bits(0x0009, "output_9_10 output_25_27 output_26_27", RW),
]

MONITOR: list[Fact] = [
    # 9.2
    *bits(
        0x0020,
        "running running_reverse ready fault parameter_error"
        " output_9_10_state output_25_27_state output_26_27_state",
    ),
    *bits(
        0x0021,
        "fault_overcurrent fault_overvoltage fault_overload fault_overheat - fault_fuse - fault_external"
        " fault_control_circuit fault_motor_overload - fault_power_loss fault_low_voltage",
    ),
    *bits(
        0x0022,
        "link_parameter_error link_writing_mode_error link_parameter_number_error link_out_of_range"
        " link_incorrect_setting link_nv_ram_fault link_command_not_received link_bcc_fault"
        " link_dp_ram_fault",
    ),
    amount(0x0023, "frequency_reference", "1/100", "Hz"),
    amount(0x0024, "output_frequency", "1/100", "Hz"),
    amount(0x0027, "output_current", "1/10", "A"),
    amount(0x0028, "output_voltage", "1", "V"),
    amount(0x0029, "master_speed_input", "10/1023", "V"),
    amount(0x002A, "auxiliary_input", "10/1023", "V"),
    *counts(0x002B, "scan_count"),
    *bits(
        0x002C,
        "status_running zero_speed speed_agree agreed_frequency_setting frequency_detection_1"
        " frequency_detection_2 status_ready undervoltage base_block frequency_from_keypad run_from_keypad"
        " overtorque frequency_reference_missing braking_transistor_fault status_fault communication_fault",
    ),
    *counts(0x002D, "output_monitor"),
    amount(0x0031, "dc_bus_voltage", "1", "V"),
    amount(0x0032, "output_power", "1/10", "kW"),
    *(Fact(f"previous_fault_{n}", 0x0033, (4 * n - 4, 4 * n - 1)) for n in (1, 2, 3, 4)),
    *bits(0x003D, "crc_error length_error - parity_error overrun_error frame_error timeout_error"),
    *counts(0x003E, "dp_ram_defective_address", "dp_ram_defective_data"),
    Fact("station_address", 0x0040, (0, 4)),
    *bits(0x0040, "- - - - - switch_s1_6 clear_error_on_reset switch_s1_8"),
    Fact("baud_switches", 0x0040, (8, 9)),
    *bits(0x0040, "- - - - - - - - - - no_rts_control switch_s2_4"),
]

STOPS = {0b00: "decelerate_bn_02", 0b01: "coast", 0b10: "decelerate_bn_04", 0b11: "keep_running"}
ENABLED = {0: "enabled", 1: "disabled"}
AO_12 = {0b00: "output_frequency", 0b01: "output_current", 0b10: "output_voltage", 0b11: "dc_voltage"}

SN: list[Fact] = [
    # 9.3; digits from bit 3 down to bit 0
    *counts(0x0100, "inverter_capability", "vf_pattern", access=RW),
    field(
        0x0102,
        0,
        3,
        "access_level",
        {0b0000: "all_open", 0b0101: "an_only", 0b1110: "initialise_2_wire", 0b1111: "initialise_3_wire"},
    ),
    field(0x0103, 0, 0, "frequency_input", {0: "terminals_13_14", 1: "an_01"}),
    field(0x0103, 1, 1, "run_input", {0: "terminals", 1: "digital_operator"}),
    field(0x0103, 2, 2, "stop_method", {0: "ramp", 1: "coast"}),
    field(0x0103, 3, 3, "stop_method_2", {0: "dc_braking", 1: "coast_with_timer"}),
    field(0x0104, 0, 0, "stop_key", {0: "effective", 1: "ineffective"}),
    field(0x0104, 1, 1, "reverse_run", ENABLED),
    field(0x0104, 2, 2, "input_scan", {0: "twice", 1: "once"}),
    Fact("analog_output_item", 0x0104, (3, 3), access=RW),
    field(0x0105, 0, 1, "s_curve", {0: "time_0_2_s", 1: "none", 2: "time_0_5_s", 3: "time_1_0_s"}),
    field(0x0105, 2, 2, "reference_characteristics", {0: "forward", 1: "reverse"}),
    field(0x0105, 3, 3, "reference_missing_action", {0: "stop", 1: "run_at_80_percent"}),
    field(0x0106, 0, 0, "overtorque_detection", {0: "disabled", 1: "enabled"}),
    field(0x0106, 1, 1, "overtorque_when", {0: "at_agreed_frequency", 1: "during_operation"}),
    field(0x0106, 2, 2, "overtorque_action", {0: "keep_running", 1: "coast"}),
    field(0x0106, 3, 3, "overtorque_measure", {0: "current", 1: "torque"}),
    field(0x0107, 0, 0, "frequency_source", {0: "line", 1: "operator_or_terminals"}),
    field(0x0107, 1, 1, "run_source", {0: "line", 1: "operator_or_terminals"}),
    field(0x0107, 2, 3, "comm_loss_action", STOPS),
    field(0x0108, 0, 0, "analog_output_source", {0: "by_sn_05", 1: "line"}),
    Fact("analog_output_item_2", 0x0108, (1, 1), access=RW),
    field(0x0108, 3, 3, "slip_compensation_regenerating", {0: "disabled", 1: "enabled"}),
    field(0x0109, 0, 0, "stall_prevention_acceleration", ENABLED),
    field(0x0109, 1, 1, "stall_prevention_deceleration", ENABLED),
    field(0x0109, 2, 2, "stall_prevention_running", ENABLED),
    field(0x0109, 3, 3, "stall_deceleration_time", {0: "bn_02", 1: "bn_04"}),
    field(0x010A, 1, 1, "retry_fault_contact", {0: "not_energized", 1: "energized"}),
    field(0x010A, 2, 2, "power_loss_action", {0: "stop", 1: "keep_running"}),
    field(0x010B, 0, 0, "external_fault_contact", {0: "normally_open", 1: "normally_closed"}),
    field(0x010B, 1, 1, "external_fault_detection", {0: "always", 1: "running_only"}),
    field(0x010B, 2, 3, "external_fault_action", STOPS),
    field(0x010C, 0, 1, "control_mode", {0: "vf", 1: "sensorless", 2: "pid", 3: "vf_pg"}),
    field(0x010D, 0, 0, "motor_overload_protection", ENABLED),
    field(0x010D, 1, 1, "motor_type", {0: "standard", 1: "inverter_duty"}),
    field(0x010D, 2, 2, "motor_overload_time", {0: "eight_minutes", 1: "five_minutes"}),
    field(0x010D, 3, 3, "inverter_overload", {0: "continuous_103_percent", 1: "continuous_113_percent"}),
    *counts(0x010E, *(f"terminal_{n}_function" for n in (5, 6, 7, 8)), "terminal_16_function", access=RW),
    *counts(0x0113, *(f"output_{n}_function" for n in ("9_10", "25_27", "26_27")), access=RW),
    Fact("operator_language", 0x0116, access=RW, values={0: "english", 1: "chinese"}),
    field(0x0118, 0, 0, "ai_14b_reference", {0: "sign_gives_direction", 1: "positive_only"}),
    field(
        0x0119,
        0,
        3,
        "digital_reference_mode",
        {
            0b0000: "bcd_1_percent",
            0b0001: "bcd_0_1_percent",
            0b0010: "bcd_0_01_percent",
            0b0011: "bcd_1_hz",
            0b0100: "bcd_0_1_hz",
            0b0101: "bcd_0_01_hz",
            0b0111: "binary_255",
            0b1000: "binary_decimal",
        },
    ),
    field(0x011A, 0, 0, "do_08_combination", {0: "combination_1", 1: "combination_2"}),
    field(0x011A, 1, 3, "po_36f_frequency", {0: "f_1", 1: "f_6", 2: "f_10", 3: "f_12", 4: "f_36"}),
    field(0x011B, 0, 1, "ao_12_channel_1", AO_12),
    field(0x011B, 2, 3, "ao_12_channel_2", AO_12),
]

CN: list[Fact] = list(
    counts(
        0x0200,
        "input_voltage",
        "max_output_frequency",
        "max_output_voltage",
        "max_voltage_frequency",
        "middle_output_frequency",
        "middle_output_voltage",
        "min_output_frequency",
        "min_output_voltage",
        "motor_rated_current",
        "dc_braking_start_frequency",
        "dc_braking_current",
        "dc_braking_time_at_stop",
        "dc_braking_time_at_start",
        "frequency_upper_bound",
        "frequency_lower_bound",
        "jump_frequency_1",
        "jump_frequency_2",
        "jump_frequency_3",
        "jump_frequency_width",
        "operator_display_unit",
        "frequency_agree_level",
        "frequency_agree_width",
        "carrier_frequency_upper_limit",
        "carrier_frequency_limit_2",
        "carrier_frequency_gain",
        "overtorque_level",
        "overtorque_time",
        "stall_level_acceleration",
        "stall_constant_power_area",
        "stall_level_running",
        "motor_phase_resistance",
        "iron_loss",
        "torque_compensation_limit",
        "motor_no_load_current",
        "slip_compensation_delay",
        "auto_restart_attempts",
        "power_loss_ride_through",
        "speed_search_level",
        "speed_search_time",
        "min_base_block_time",
        "speed_search_vf_curve",
        "voltage_recovery_time",
        access=RW,
    )
)
SENSORLESS = [*counts(0x021F, "motor_leakage_inductance", "torque_limit", access=RW)]
"""The other meanings of Cn-32 and Cn-33."""

AN = [*counts(0x0400, *(f"preset_frequency_{n}" for n in range(1, 9)), "jog_frequency", access=RW)]

BN = [
    *counts(
        0x0500,
        "acceleration_time_1",
        "deceleration_time_1",
        "acceleration_time_2",
        "deceleration_time_2",
        "analog_frequency_gain",
        "analog_frequency_bias",
        "torque_boost_gain",
        "motor_rated_slip",
        "energy_saving_gain",
        "power_on_monitor",
        "ao_1_gain",
        "ao_2_gain",
        access=RW,
    )
]

FACTS = [*CONTROL, *MONITOR, *SN, *CN, *SENSORLESS, *AN, *BN]

ERRORS = {
    # 10, and the 06H of section 8
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

HOLES = [0x25, 0x26, 0x2E, 0x2F, 0x30, *range(0x34, 0x3D), 0x117]
