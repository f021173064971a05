"""The rules of the three documents, one by one, on the wire: what a careless gateway gets wrong.

Frames stand here as hex text without their check bytes, which are worked out apart from the gateway
(`tests.simulator.master`) and compared for every frame that was sent. ``sim`` is the 7200GS's document,
``s2000`` that of the S2000, ``sl3`` the page of the SL3.
"""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.simulator.drive import Drive
from gateway.simulator.happening import PanelSets, Trip
from gateway.tag import Cause, Quality, Value, Verdict
from tests.core.world import ENGINEER, OPERATOR, World, site_of
from tests.simulator.master import crc, framed

WRITES = ("06", "10")


def writes(world: World) -> list[str]:
    """The frames that wrote something, without their check bytes, all of which are right."""
    found = []
    for _, text in world.wire:
        frame = bytes.fromhex(text)
        assert frame[-2:] == crc(frame[:-2]), text
        if text.split()[1] in WRITES:
            found.append(" ".join(text.split()[:-2]))
    return found


def teco() -> World:
    world = World()
    world.run(1.0)
    return world


def s2000(**settings: int) -> World:
    known = {"e1_04": 60, **settings}
    world = World(site_of("s2000", **{name: Fraction(value) for name, value in known.items()}))
    world.run(1.0)
    return world


def sl3() -> World:
    world = World(site_of("shihlin-sl3"))
    world.run(1.0)
    return world


def do(world: World, name: str, **args: Value) -> None:
    drive = next(iter(world.drives))
    outcome = world.command(name, drive=drive, **args)
    assert outcome.verdict is Verdict.CONFIRMED, outcome


def put(world: World, point: str, value: Value) -> None:
    drive = next(iter(world.drives))
    outcome = world.write(f"{drive}.{point}", value, ENGINEER)
    assert outcome.verdict is Verdict.CONFIRMED, outcome


def answers(drive: Drive, reply: bytes) -> None:
    """From now on the drive answers every write with these bytes."""
    handle = drive.handle

    def answer(adu: bytes, now: float) -> bytes | None:
        return reply if adu[0] == drive.unit and adu[1] in (0x06, 0x10) else handle(adu, now)

    drive.handle = answer  # type: ignore[method-assign]


# -- 7200GS


def test_sim_11_run_and_frequency_travel_in_one_message_and_reverse_is_bit_1_beside_run() -> None:
    world = teco()
    do(world, "run_forward", frequency=60.0)
    do(world, "run_reverse", frequency=30.0)
    do(world, "stop")
    assert writes(world) == [
        "05 10 00 01 00 02 04 00 01 17 70",
        "05 10 00 01 00 02 04 00 03 0B B8",
        "05 10 00 01 00 01 02 00 00",
    ]


def test_sim_9_1_a_change_of_speed_is_a_write_of_0002h_alone() -> None:
    world = teco()
    do(world, "run_reverse", frequency=30.0)
    put(world, "frequency_command", 12.34)
    assert writes(world)[-1] == "05 10 00 02 00 01 02 04 D2"
    assert world.drives["fan-1"].registers[0x0001] == 0x0003


@pytest.mark.parametrize(
    ("command", "pulse", "rest"), [("run_forward", "00 09", "00 01"), ("run_reverse", "00 0B", "00 03")]
)
def test_sim_9_1_a_fault_reset_is_a_pulse_of_bit_3_that_keeps_run_and_direction(
    command: str, pulse: str, rest: str
) -> None:
    world = teco()
    do(world, command, frequency=30.0)
    world.drives["fan-1"].post(Trip("fault_overcurrent"))
    world.run(1.0)
    do(world, "reset_fault")
    assert writes(world)[-2:] == [f"05 10 00 01 00 01 02 {pulse}", f"05 10 00 01 00 01 02 {rest}"]


def test_sim_9_1_external_fault_and_inputs_are_bits_beside_the_run_bit() -> None:
    world = teco()
    do(world, "run_forward", frequency=30.0)
    for point, word in (("input_5", "00 11"), ("input_8", "00 91"), ("external_fault", "00 95")):
        put(world, point, True)
        assert writes(world)[-1] == f"05 10 00 01 00 01 02 {word}"
    put(world, "input_5", False)
    assert writes(world)[-1] == "05 10 00 01 00 01 02 00 85"


def test_sim_9_1_bits_8_to_f_are_written_0_whatever_the_drive_shows() -> None:
    world = teco()
    bank = world.drives["fan-1"].model.bank
    bank.words[0x0001] = 0xFF00
    bank.words[0x0009] = 0xFFF8
    put(world, "input_6", True)
    put(world, "output_26_27", True)
    assert writes(world) == ["05 10 00 01 00 01 02 00 20", "05 10 00 09 00 01 02 00 04"]


def test_sim_5_sn_08_decides_and_the_refusal_says_so() -> None:
    world = teco()
    world.drives["fan-1"].post(PanelSets("run_source", 1))
    world.run(0.1)
    outcome = world.command("run_forward", frequency=10.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.PRECONDITION)
    assert outcome.reason == (
        "needs run_source: line, but it is operator_or_terminals (Sn-08: Whose run command counts)"
    )
    assert writes(world) == []


def test_sim_5_an_accepted_write_does_not_prove_that_the_motor_runs() -> None:
    """Sn-08 is turned after it was read and before the run: the drive takes the write and stands."""
    world = teco()
    asked = world.ask_command("run_forward", frequency=10.0)
    world.until(lambda: writes(world) or None, 5.0)
    world.drives["fan-1"].post(PanelSets("run_source", 1))
    outcome = world.until(asked, 10.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.FAILED, Cause.NOT_PROVED)
    assert "running: false" in outcome.reason


@pytest.mark.parametrize(
    ("point", "register"), [("preset_frequency_1", "04 00"), ("acceleration_time_1", "05 00")]
)
def test_sim_10_an_and_bn_are_written_while_running(point: str, register: str) -> None:
    world = teco()
    do(world, "run_forward", frequency=10.0)
    put(world, point, 77)
    assert writes(world)[-1] == f"05 10 {register} 00 01 02 00 4D"


@pytest.mark.parametrize("point", ["operator_language", "motor_rated_current"])
def test_sim_10_sn_and_cn_are_not_and_the_refusal_says_why(point: str) -> None:
    world = teco()
    do(world, "run_forward", frequency=10.0)
    before = writes(world)
    outcome = world.write(f"fan-1.{point}", 1)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.PRECONDITION)
    assert "running: false" in outcome.reason
    assert writes(world) == before


def test_sim_10_the_drives_own_refusal_comes_with_its_code_and_words() -> None:
    world = teco()
    answers(world.drives["fan-1"], framed(5, 0x90, 0x22))
    outcome = world.write("fan-1.acceleration_time_1", 77)
    assert (outcome.verdict, outcome.cause, outcome.code) == (Verdict.REFUSED, Cause.DRIVE_REFUSED, 0x22)
    assert outcome.drive_error == "locked"
    assert outcome.reason.startswith("the drive answered 22H locked: ")
    assert "Sn or Cn while running" in outcome.reason


@pytest.mark.parametrize("code", [0x06, 0x31, 0x33, 0x55, 0xFF])
def test_sim_10_codes_in_no_list_are_passed_on_as_numbers(code: int) -> None:
    world = teco()
    answers(world.drives["fan-1"], framed(5, 0x90, code))
    outcome = world.write("fan-1.acceleration_time_1", 77)
    assert (outcome.cause, outcome.code) == (Cause.DRIVE_REFUSED, code)
    assert f"{code:02X}H" in outcome.reason


@pytest.mark.parametrize("value", ["initialise_2_wire", "initialise_3_wire", 14, 15])
def test_sim_9_3_nobody_initialises_the_drive_by_accident(value: Value) -> None:
    world = teco()
    outcome = world.write("fan-1.access_level", value)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.DANGER)
    assert writes(world) == []


def test_sim_8_only_functions_03h_and_10h_and_at_most_16_registers() -> None:
    world = teco()
    points = world.core.drives[0].profile.points
    world.watch({f"fan-1.{name}": 1.0 for name, point in points.items() if point.access.readable})
    world.run(5.0)
    put(world, "input_5", True)
    for _, text in world.wire:
        frame = bytes.fromhex(text)
        assert frame[1] in (0x03, 0x10)
        assert 1 <= int.from_bytes(frame[4:6], "big") <= 16


# -- S2000


def test_s2000_10_run_is_at_0000h_forward_bit_0_reverse_bit_1_with_the_frequency_behind_it() -> None:
    world = s2000()
    do(world, "run_forward", frequency=60.0)
    do(world, "run_reverse", frequency=30.0)
    put(world, "frequency_command", 45.5)
    do(world, "stop")
    assert writes(world) == [
        "01 10 00 00 00 02 04 00 01 02 58",
        "01 10 00 00 00 02 04 00 02 01 2C",
        "01 10 00 01 00 01 02 01 C7",
        "01 10 00 00 00 01 02 00 00",
    ]


def test_s2000_10_terminals_are_bits_2_to_7_beside_the_run_bits() -> None:
    world = s2000()
    do(world, "run_reverse", frequency=30.0)
    put(world, "terminal_3", True)
    put(world, "terminal_8", True)
    put(world, "terminal_3", False)
    assert writes(world)[1:] == [
        "01 10 00 00 00 01 02 00 06",
        "01 10 00 00 00 01 02 00 86",
        "01 10 00 00 00 01 02 00 82",
    ]


def test_s2000_10_a_fault_is_reset_by_terminal_4_and_the_run_bit_stays() -> None:
    world = s2000(h1_02=1)
    do(world, "run_forward", frequency=30.0)
    world.drives["drive-1"].post(Trip("fault_oc"))
    world.run(1.0)
    do(world, "reset_fault")
    frames = writes(world)[1:]
    assert frames[0] == "01 10 00 00 00 01 02 00 09"
    assert frames[-1] == "01 10 00 00 00 01 02 00 01"


@pytest.mark.parametrize(
    ("unit", "g1_03", "word"),
    [
        ("tenth_hz", 0, "01 C7"),
        ("by_g1_03", 0, "11 C6"),
        ("by_g1_03", 1, "1D 9F"),
        ("by_g1_03", 4, "05 55"),
    ],
)
def test_s2000_10_the_frequency_counts_in_what_000fh_and_g1_03_say(unit: str, g1_03: int, word: str) -> None:
    world = s2000(g1_03=g1_03)
    if unit != "tenth_hz":
        put(world, "frequency_unit", unit)
    put(world, "frequency_command", 45.5)
    assert writes(world)[-1] == f"01 10 00 01 00 01 02 {word}"


@pytest.mark.parametrize(("poles", "highest", "word"), [(2, 66.65, "0F 9F"), (4, 133.3, "0F 9F")])
def test_s2000_3_a_frequency_in_turns_is_never_above_3999(poles: int, highest: float, word: str) -> None:
    world = s2000(e1_04=400, g1_03=poles)
    put(world, "frequency_unit", "by_g1_03")
    put(world, "frequency_command", highest)
    assert writes(world)[-1] == f"01 10 00 01 00 01 02 {word}"
    before = writes(world)
    for above in (highest + 0.01 * poles, 400.0):
        outcome = world.write("drive-1.frequency_command", above)
        assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.OUT_OF_RANGE)
        assert "the drive takes 0 to 3999" in outcome.reason
    outcome = world.command("run_forward", drive="drive-1", frequency=400.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.OUT_OF_RANGE)
    assert writes(world) == before


def test_s2000_10_arming_a_terminal_keeps_the_unit_of_the_frequency() -> None:
    world = s2000()
    put(world, "frequency_unit", "by_g1_03")
    put(world, "broadcast_terminal_6", True)
    assert writes(world) == ["01 10 00 0F 00 01 02 00 01", "01 10 00 0F 00 01 02 20 01"]


def test_s2000_10_outputs_analog_and_by_contact() -> None:
    world = s2000()
    put(world, "analog_output_1", -11.0)
    put(world, "analog_output_2", 11.0)
    put(world, "output_18_20", "closed")
    put(world, "output_9_10", True)
    put(world, "output_18_20", "open")
    assert writes(world) == [
        "01 10 00 07 00 01 02 FD 2A",
        "01 10 00 08 00 01 02 02 D6",
        "01 10 00 09 00 01 02 00 C0",
        "01 10 00 09 00 01 02 00 C1",
        "01 10 00 09 00 01 02 00 41",
    ]


def test_s2000_8_enter_goes_to_ram_after_each_batch_and_to_eeprom_on_request_only() -> None:
    world = s2000()
    put(world, "preset_frequency_1", 600)
    do(world, "store_parameters")
    assert writes(world) == [
        "01 10 02 80 00 01 02 02 58",
        "01 10 FF DD 00 01 02 00 00",
        "01 10 FF FD 00 01 02 00 00",
    ]
    ends = [text[-5:] for _, text in world.wire if text.startswith("01 10 FF")]
    assert ends == ["BB D2", "BC B2"], "the document prints 38 BA and BB D2"


def test_s2000_10_spare_registers_are_never_touched() -> None:
    world = s2000(h1_02=1)
    points = world.core.drives[0].profile.points
    world.watch({f"drive-1.{name}": 0.5 for name, point in points.items() if point.access.readable})
    world.run(5.0)
    do(world, "run_forward", frequency=30.0)
    spare = {*range(0x0002, 0x0007), *range(0x000A, 0x000F), 0x0013}
    for _, text in world.wire:
        frame = bytes.fromhex(text)
        if frame[1] in (0x03, 0x10):
            first, count = int.from_bytes(frame[2:4], "big"), int.from_bytes(frame[4:6], "big")
            assert spare.isdisjoint(range(first, first + count)), text


def test_s2000_the_firmware_with_its_words_one_higher_is_one_setting() -> None:
    world = s2000(command_shift=1)
    do(world, "run_forward", frequency=60.0)
    do(world, "stop")
    assert writes(world) == ["01 10 00 01 00 02 04 00 01 02 58", "01 10 00 01 00 01 02 00 00"]


# -- SL3


def test_sl3_example_1_control_is_taken_by_0_to_1000h() -> None:
    world = sl3()
    do(world, "take_control")
    assert [text for _, text in world.wire if text.split()[1] == "06"] == ["01 06 10 00 00 00 8D 0A"]


def test_sl3_without_control_a_run_is_refused_and_says_what_decides() -> None:
    world = sl3()
    outcome = world.command("run_forward", drive="drive-1", frequency=10.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.PRECONDITION)
    assert "needs operation_mode: communication, but it is panel" in outcome.reason
    assert writes(world) == []


def test_sl3_the_frequency_is_there_before_the_run_bit() -> None:
    world = sl3()
    do(world, "take_control")
    do(world, "run_reverse", frequency=30.0)
    do(world, "stop")
    assert writes(world)[1:] == ["01 06 10 02 0B B8", "01 06 10 01 00 04", "01 06 10 01 00 00"]


# -- all of them


@settings(max_examples=30, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["input_5", "input_6", "input_7", "input_8"]), st.booleans(), st.booleans()
        ),
        min_size=1,
        max_size=12,
    )
)
def test_bits_that_clients_write_at_once_into_one_word_are_never_lost(
    doings: list[tuple[str, bool, bool]],
) -> None:
    """Each client writes what it likes, waiting for nothing or for its last outcome; in the end the drive
    holds the last confirmed value of each bit, and runs."""
    world = teco()
    do(world, "run_forward", frequency=20.0)
    other = world.join("other")
    last: dict[str, bool] = {}
    asked = []
    for index, (point, value, wait) in enumerate(doings):
        session = world.session if index % 2 else other
        asked.append(world.ask_write(f"fan-1.{point}", value, OPERATOR, ttl=60.0, session=session))
        last[point] = value
        if wait:
            world.until(asked[-1], 60.0)
    for outcome in asked:
        assert world.until(outcome, 60.0).verdict is Verdict.CONFIRMED
    shown = {s.tag.removeprefix("fan-1."): s.value for s in world.read(*(f"fan-1.{p}" for p in last))}
    assert shown == last
    assert world.drives["fan-1"].registers[0x0001] & 0x0001


def test_sl3_example_2_what_is_switched_off_can_be_set_and_read_by_its_name() -> None:
    world = sl3()
    for value, word in ((5000, "13 88"), ("switched_off", "FF FF")):
        put(world, "p_162", value)
        assert writes(world)[-1] == f"01 06 00 A2 {word}"
    [sample] = world.read("drive-1.p_162")
    assert (sample.value, sample.text, sample.quality) == (None, "switched_off", Quality.NOT_APPLICABLE)
    for wrong in (65535, "off"):
        assert world.write("drive-1.p_162", wrong, ENGINEER).verdict is Verdict.REFUSED
