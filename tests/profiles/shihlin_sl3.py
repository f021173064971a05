"""What the SL3's one page says, and what is known of its sister series."""

from tests.profiles.facts import Fact, amount, bits, counts

RW, RO, WO = "read-write", "read", "write"

MODES = {
    0: "communication",
    1: "external",
    2: "jog",
    3: "combined_1",
    4: "combined_2",
    5: "combined_3",
    6: "combined_4",
    7: "combined_5",
    8: "panel",
}
FORMATS = {0: "ascii_7n2", 1: "ascii_7e1", 2: "ascii_7o1", 3: "rtu_8n2", 4: "rtu_8e1", 5: "rtu_8o1"}

PAGE: list[Fact] = [
    # examples 1 and 2
    Fact("operation_mode", 0x1000, access=RW, values=MODES),
    Fact("p_162", 0x00A2, access=RW),
]

SISTERS: list[Fact] = [
    # SS2 p.75, SE3 p.182: 1001H read
    *bits(
        0x1001,
        "running running_forward running_reverse speed_agree overload parameter_reset_done"
        " frequency_detected fault stall undervoltage plc_running status_e0 - - resetting tuning",
    ),
    # SS2 p.75: 1001H written
    Fact("run_command", 0x1001, (1, 2), access=WO, values={0: "stop", 1: "forward", 2: "reverse"}),
    *bits(0x1001, "- - - input_rl input_rm input_rh input_rt input_mrs", WO),
    # SA3 p.218
    amount(0x1002, "frequency_command", "1/100", "Hz", RW),
    amount(0x1009, "frequency_stored", "1/100", "Hz", RW),
    Fact("monitor_selector", 0x1013, access=RW),
    Fact("selected_value_5", 0x1012),
    # SC3 p.135
    Fact("output_frequency", 0x1003, unit="Hz", exact="by case"),
    amount(0x1004, "output_current", "1/100", "A"),
    amount(0x1005, "output_voltage", "1/100", "V"),
    # SS2 p.75: two codes a register, the low byte is code 1 or 3
    Fact("previous_fault_1", 0x1007, (0, 7)),
    Fact("previous_fault_2", 0x1007, (8, 15)),
    Fact("previous_fault_3", 0x1008, (0, 7)),
    Fact("previous_fault_4", 0x1008, (8, 15)),
    # SC3 p.134
    *counts(0x1019, "dc_bus_count"),
    *counts(0x101B, "power_count_1"),
    *counts(0x1021, "speed_count_1"),
    *counts(0x1025, "torque_count"),
    *counts(0x1029, "power_count_2"),
    *counts(0x102B, "speed_count_2"),
    # SS2 p.75, SC3 p.133
    Fact("reset_word", 0x1101, access=WO, values={0x9696: "restart"}),
    # SC3 p.135; SF-GT p.76
    *counts(37, "p_37", access=RW),
    *counts(52, "communication_retries", "communication_timeout", access=RW),
    *counts(153, "comm_loss_action", access=RW),
    Fact("communication_format", 154, access=RW, values=FORMATS),
]

FACTS = [*PAGE, *SISTERS]

ERRORS = {0x01: "illegal_function", 0x02: "illegal_address", 0x03: "illegal_value"}
