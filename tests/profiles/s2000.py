"""What the S2000's sheet says, by its sections."""

from tests.profiles.facts import Fact, amount, bits, counts, field

RW, RO, WO = "read-write", "read", "write"

CONTROL: list[Fact] = [
    # 10 (1), 0000H: forward and reverse are bits 0 and 1; both at once means nothing
    field(0x0000, 0, 1, "run_command", {0: "stop", 1: "forward", 2: "reverse"}),
    *bits(0x0000, "- - terminal_3 terminal_4 terminal_5 terminal_6 terminal_7 terminal_8", RW),
    *bits(0x0000, "- - - fault_reset", RW),
    # 0001H: its unit depends on 000FH
    Fact("frequency_command", 0x0001, unit="Hz", access=RW, exact="by case"),
    # 0007H, 0008H: -726 to 726 is -11 V to 11 V
    amount(0x0007, "analog_output_1", "1/66", "V", RW, "s16"),
    amount(0x0008, "analog_output_2", "1/66", "V", RW, "s16"),
    # 0009H: bits 0 to 2, and 7 that acts only with 6
    *bits(0x0009, "output_9_10 output_25_27 output_26_27", RW),
    field(0x0009, 6, 7, "output_18_20", {0b00: "by_drive", 0b01: "open", 0b11: "closed"}),
    # 000FH
    field(0x000F, 0, 0, "frequency_unit", {0: "tenth_hz", 1: "by_g1_03"}),
    *bits(
        0x000F,
        "- - - - - - - - - - - - broadcast_terminal_5 broadcast_terminal_6"
        " broadcast_terminal_7 broadcast_terminal_8",
        RW,
    ),
]

STATUS: list[Fact] = [
    # 10 (2)
    *bits(0x0010, "running zero_speed running_reverse reset_input speed_agree ready warning fault"),
    *bits(0x0011, "operator_ope operator_err program_mode"),
    field(0x0011, 3, 4, "panel_type", {0: "jvop_130", 1: "jvop_132", 2: "jvop_100"}, RO),
    *counts(0x0012, "operator_number"),
    *bits(
        0x0014,
        "fault_fu fault_uv1 fault_uv2 fault_uv3 fault_sc fault_gf fault_oc fault_ov"
        " fault_oh fault_oh1 fault_ol1 fault_ol2 fault_ol3 fault_ol4 fault_rr fault_rh",
    ),
    *bits(
        0x0015,
        "fault_ef3 fault_ef4 fault_ef5 fault_ef6 fault_ef7 fault_ef8 fault_fan fault_os"
        " fault_dev fault_pgo fault_pf fault_lf - fault_opr fault_err -",
    ),
    *bits(0x0016, "fault_ce - - - fault_cf fault_sve"),
    *bits(0x0017, "- - fault_cpf02 fault_cpf03 fault_cpf04 fault_cpf05 fault_cpf06"),
    *bits(0x0018, "fault_cpf20 fault_cpf21 fault_cpf22 fault_cpf23"),
    *bits(
        0x0019,
        "warning_uv warning_ov warning_oh warning_oh2 warning_ol3 warning_ol4 warning_ef warning_bb"
        " warning_ef3 warning_ef4 warning_ef5 warning_ef6 warning_ef7 warning_ef8 warning_fan warning_os",
    ),
    *bits(0x001A, "warning_dev warning_pgo warning_opr warning_ce - - warning_ol1 warning_ol2"),
]

PARAMETERS: list[Fact] = [
    # 6: 0100H to 0103H read as 1 (Chinese), 2 (quick-start), 0 (V/f control), 0
    Fact("language", 0x0100, access=RW, values={1: "chinese"}),
    Fact("access_level", 0x0101, access=RW, values={2: "quick_start"}),
    Fact("control_method", 0x0102, access=RW, values={0: "vf"}),
    Fact("initialise", 0x0103, access=RW),
    # 7
    *counts(0x0280, "preset_frequency_1", "preset_frequency_2", access=RW),
    # 8
    Fact("enter_ram", 0xFFDD, access=WO, values={0: "enter"}),
    Fact("enter_eeprom", 0xFFFD, access=WO, values={0: "enter"}),
]

FACTS = [*CONTROL, *STATUS, *PARAMETERS]

ERRORS = {
    # 4
    0x01: "illegal_function",
    0x02: "illegal_address",
    0x03: "illegal_count",
    0x21: "illegal_value",
    0x22: "locked",
    0x23: "undervoltage",
    0x24: "busy",
}

SPARE = [*range(0x0002, 0x0007), *range(0x000A, 0x000F), 0x0013]
"""Registers that are "not in use" or not listed, and may never be written."""

BROADCAST: list[Fact] = [
    # 10, command to all slaves
    *bits(0x0001, "run_all reverse_all - - external_fault_all fault_reset_all", WO),
    *bits(0x0001, "- - - - - - - - - - - - terminal_5_all terminal_6_all terminal_7_all terminal_8_all", WO),
    amount(0x0002, "frequency_all", "1/300", "%", WO),
]
