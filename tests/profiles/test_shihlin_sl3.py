"""Rules of the SL3's page, and of its sister series, that are more than a register and a bit."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from gateway.mapping.profile import Access, Argument, Constant
from tests.profiles.life import Life
from tests.profiles.test_facts import profile, told

SL3 = profile("shihlin-sl3")
POINTS = SL3.points


def test_serial() -> None:
    # >=10ms; SF-GT p.76: P.154 = 0 to 2 ASCII, 3 to 5 RTU, factory setting 4
    serial = SL3.serial
    assert serial.gap == 0.01
    assert [str(form) for form in serial.rtu] == ["8E1", "8N2", "8O1"]
    assert {str(form) for form in serial.ascii} == {"7N2", "7E1", "7O1"}
    assert SL3.facts["serial.baud"].doubt and SL3.facts["serial.units"].doubt
    assert SL3.facts["serial.rtu"].similar


def test_modbus() -> None:
    # "Function codes are not H03, H06, H08, H10"; the note on reserved parameters
    modbus = SL3.modbus
    assert modbus.functions == (0x03, 0x06, 0x08, 0x10)
    assert (modbus.write_one, modbus.bridge, modbus.probe) == (0x06, True, "loop_back")
    assert modbus.read_max == 20
    assert SL3.facts["modbus.read_max"].similar and not SL3.facts["modbus.functions"].similar


def test_the_page_itself_is_not_similar_and_all_else_is() -> None:
    own = {point["name"] for point in told("shihlin-sl3")["points"] if not point["similar_model"]}
    assert own == {"operation_mode", "p_162"}
    assert all(POINTS[name].provenance.document == "sl3" for name in own)
    assert told("shihlin-sl3")["similar_documents"] == ["sc3", "se3", "sa3", "ss2", "sfgt"]


def test_addresses_of_the_examples() -> None:
    # example 1: H1000; example 2: H00A2 is 01-28, P.162
    assert POINTS["operation_mode"].address == 0x1000
    assert (POINTS["p_162"].address, POINTS["p_162"].notation) == (0x00A2, "P.162")


def test_ffffh_is_no_number() -> None:
    assert dict(POINTS["p_162"].encoding.special) == {0xFFFF: "switched_off"}


def test_one_address_two_meanings() -> None:
    here = [point for point in POINTS.values() if point.address == 0x1001]
    assert {point.access for point in here} == {Access.READ, Access.WRITE}
    word = SL3.words[0x1001]
    assert word.image
    assert (word.always_mask, word.always_bits) == (0xFF01, 0)
    written, read = [word for word in told("shihlin-sl3")["words"] if word["register"] == "1001H"]
    assert (written["image"], read["image"]) == (True, False)
    assert "run_command" in written["fields"]
    assert read["fields"][:2] == ["running", "running_forward"]
    assert read["unused"] == [[12, 13]]
    assert written["unused"] == []


def test_the_frequency_has_a_twin_that_wears() -> None:
    assert POINTS["frequency_stored"].twin == "frequency_command"
    assert POINTS["frequency_stored"].wear == "unknown"


def test_p_37_decides_the_decimals() -> None:
    point = POINTS["output_frequency"]
    found = [([t.text for t in case.when], case.encoding.scale) for case in point.cases]
    assert found == [(["p_37: 0"], Fraction(1, 100)), ([], Fraction(1, 10))]


def test_the_selected_monitor() -> None:
    assert dict(POINTS["selected_value_5"].select) == {"monitor_selector": Constant(Fraction(5))}


def test_the_reset_is_not_answered() -> None:
    reset = POINTS["reset_word"]
    assert reset.silent and reset.by_command_only
    assert reset.pause > 0


def test_a_restart_never_starts_the_motor() -> None:
    for name in ("reset_fault", "restart"):
        command = SL3.commands[name]
        assert [term.text for term in command.only_when] == ["running: false"]
        first, second = command.steps
        assert dict(first.write) == {"run_command": Constant(Fraction(0))}
        assert dict(second.write) == {"reset_word": Constant(Fraction(0x9696))}


def test_the_line_must_be_in_command() -> None:
    for name in ("run_forward", "run_reverse"):
        command = SL3.commands[name]
        assert [term.text for term in command.only_when] == ["operation_mode: communication"]
        frequency, run = command.steps
        assert dict(frequency.write) == {"frequency_command": Argument("frequency")}
        assert set(run.write) == {"run_command"}
    (step,) = SL3.commands["take_control"].steps
    assert dict(step.write) == {"operation_mode": Constant(Fraction(0))}


def test_a_change_of_the_format_is_a_danger() -> None:
    assert set(POINTS["communication_format"].danger) == set(range(6))


def test_no_scale_is_invented() -> None:
    for point in POINTS.values():
        if point.group == "live":
            assert (point.encoding.symbol, point.encoding.scale) == (None, 1)
            assert point.provenance.doubt


def test_the_status_never_becomes_a_command(tmp_path: Path) -> None:
    """1001H read shows bit 3 "frequency reached", written it is the input RL."""
    life = Life(tmp_path, "shihlin-sl3", unit=1, serial="9600 8E1").found()
    life.do("take_control")
    life.do("run_forward", frequency=30.0)
    life.run(2.0)
    assert life.value("speed_agree") is True
    life.core.drives[0].forget()  # as after a restart of the gateway
    life.do("run_forward", frequency=40.0)
    written = [frame for frame in life.sent("06") if frame.startswith("01 06 10 01")]
    assert written == ["01 06 10 01 00 02 5D 0B"] * 2
