"""Points whose meaning depends on the drive: units by a register, modes, selectors, temporary refusals."""

from __future__ import annotations

from fractions import Fraction

import pytest

from gateway.tag import Cause, Quality, Verdict
from tests.core.world import ENGINEER, OPERATOR, World, site_of


@pytest.fixture
def s2000() -> World:
    world = World(site_of("s2000", e1_04=Fraction(60)))
    world.run(1.0)
    return world


@pytest.fixture
def sl3() -> World:
    world = World(site_of("shihlin-sl3"))
    world.run(1.0)
    return world


def command(world: World, name: str, **args: float) -> object:
    return world.until(world.ask_command(name, drive="drive-1", origin=OPERATOR, **args), 90.0)


def test_a_frequency_is_written_in_the_unit_that_the_drive_is_set_to(s2000: World) -> None:
    assert s2000.write("drive-1.frequency_command", 20.5).value == 20.5
    assert s2000.sent()[-1].startswith("01 10 00 01 00 01 02 00 CD")
    assert s2000.write("drive-1.frequency_unit", "by_g1_03").verdict is Verdict.CONFIRMED
    assert s2000.write("drive-1.frequency_command", 20.25).value == 20.25
    assert s2000.sent()[-1].startswith("01 10 00 01 00 01 02 07 E9")


def test_the_unit_is_read_afresh_before_a_write_since_a_hand_may_have_changed_it(s2000: World) -> None:
    s2000.write("drive-1.frequency_command", 20.0)
    word = s2000.drives["drive-1"].registers
    assert word[0x000F] & 1 == 0
    s2000.wire.clear()
    s2000.write("drive-1.frequency_command", 21.0)
    assert s2000.sent("03")[0].startswith("01 03 00 0F") or s2000.sent("03")[1].startswith("01 03 00 0F")


@pytest.mark.parametrize(
    ("g1_03", "hertz", "raw"),
    [(0, 30.0, "0B B8"), (1, 30.0, "13 88"), (4, 30.0, "03 84")],
    ids=["0.01 Hz", "percent of 60 Hz", "r/min of four poles"],
)
def test_every_unit_of_the_panel_arrives_as_hertz(g1_03: int, hertz: float, raw: str) -> None:
    world = World(site_of("s2000", e1_04=Fraction(60), g1_03=Fraction(g1_03)))
    world.run(1.0)
    world.write("drive-1.frequency_unit", "by_g1_03")
    outcome = world.write("drive-1.frequency_command", hertz)
    assert (outcome.verdict, outcome.value) == (Verdict.CONFIRMED, hertz)
    assert world.sent()[-1].startswith(f"01 10 00 01 00 01 02 {raw}")


def test_newer_firmware_has_run_and_frequency_one_register_higher() -> None:
    world = World(site_of("s2000", e1_04=Fraction(60), command_shift=Fraction(1)))
    world.run(1.0)
    assert command(world, "run_forward", frequency=30.0).verdict is Verdict.CONFIRMED  # type: ignore[attr-defined]
    assert world.sent()[-1].startswith("01 10 00 01 00 02 04 00 01 01 2C")


def test_a_watched_frequency_follows_its_unit(s2000: World) -> None:
    s2000.watch({"drive-1.frequency_command": 0.5})
    s2000.write("drive-1.frequency_command", 20.0)
    s2000.run(2.0)
    assert s2000.samples("drive-1.frequency_command")[-1].value == 20.0


def test_a_mode_that_is_not_the_right_one_refuses_a_run_until_control_is_taken(sl3: World) -> None:
    refused = command(sl3, "run_forward", frequency=30.0)
    assert refused.cause is Cause.PRECONDITION  # type: ignore[attr-defined]
    assert command(sl3, "take_control").verdict is Verdict.CONFIRMED  # type: ignore[attr-defined]
    assert command(sl3, "run_forward", frequency=30.0).verdict is Verdict.CONFIRMED  # type: ignore[attr-defined]
    assert sl3.sent("06")[-2:] == ["01 06 10 02 0B B8 2B 88", "01 06 10 01 00 02 5D 0B"]


def test_a_sentinel_is_no_number(sl3: World) -> None:
    [sample] = sl3.read("drive-1.p_162")
    assert (sample.value, sample.quality, sample.reason) == (None, Quality.NOT_APPLICABLE, "switched_off")


def test_a_selected_value_is_read_behind_its_selector_which_is_written_once(sl3: World) -> None:
    command(sl3, "take_control")
    sl3.wire.clear()
    sl3.watch({"drive-1.selected_value_5": 1.0})
    sl3.run(5.0)
    samples = [s for s in sl3.samples("drive-1.selected_value_5") if s.quality is Quality.GOOD]
    assert len(samples) >= 4
    assert [f for f in sl3.sent("06") if f.startswith("01 06 10 13 00 05")] == sl3.sent("06")
    assert len(sl3.sent("06")) == 1
    [once] = sl3.read("drive-1.selected_value_5")
    assert once.quality is Quality.GOOD


def test_without_the_right_to_write_a_selected_value_says_why_it_has_none() -> None:
    world = World(site_of("shihlin-sl3", writes=False))
    world.watch({"drive-1.selected_value_5": 1.0})
    world.run(3.0)
    last = world.samples("drive-1.selected_value_5")[-1]
    assert (last.value, last.quality) == (None, Quality.NOT_APPLICABLE)
    assert world.sent("06") == []


def test_a_parameter_write_is_followed_by_enter_to_ram_once_per_batch(s2000: World) -> None:
    first = s2000.ask_write("drive-1.preset_frequency_1", 600, ENGINEER)
    second = s2000.ask_write("drive-1.preset_frequency_2", 500, ENGINEER)
    assert s2000.until(first, 10.0).verdict is Verdict.CONFIRMED
    assert s2000.until(second, 10.0).verdict is Verdict.CONFIRMED
    enters = [frame for frame in s2000.sent() if frame.startswith("01 10 FF DD")]
    assert enters == ["01 10 FF DD 00 01 02 00 00 BB D2"]
    assert not [frame for frame in s2000.sent() if frame.startswith("01 10 FF FD")], "EEPROM only on request"


def test_an_equal_parameter_is_not_written_again(s2000: World) -> None:
    s2000.write("drive-1.preset_frequency_1", 600)
    before = len(s2000.sent())
    outcome = s2000.write("drive-1.preset_frequency_1", 600)
    assert outcome.verdict is Verdict.CONFIRMED
    assert len(s2000.sent()) == before


def test_a_drive_that_is_saving_is_asked_again_within_the_deadline(s2000: World) -> None:
    assert command(s2000, "store_parameters").verdict is Verdict.CONFIRMED  # type: ignore[attr-defined]
    outcome = s2000.write("drive-1.frequency_command", 12.0)
    assert outcome.verdict is Verdict.CONFIRMED, outcome


def test_enter_follows_even_when_the_last_write_of_a_batch_changes_nothing(s2000: World) -> None:
    s2000.write("drive-1.preset_frequency_2", 500)
    s2000.wire.clear()
    asked = [
        s2000.ask_write(f"drive-1.preset_frequency_{n}", value, ENGINEER) for n, value in ((1, 610), (2, 500))
    ]
    for outcome in asked:
        assert s2000.until(outcome, 10.0).verdict is Verdict.CONFIRMED
    s2000.run(1.0)
    assert len([frame for frame in s2000.sent() if frame.startswith("01 10 FF DD")]) == 1


def test_an_enter_that_was_refused_is_told_and_made_good(s2000: World) -> None:
    drive = s2000.drives["drive-1"]
    refusing, model = [True], drive.handle

    def refuse(adu: bytes, now: float) -> bytes | None:
        if refusing[0] and adu[1:4] == bytes.fromhex("10FFDD"):
            return _sealed(bytes.fromhex("019021"))
        return model(adu, now)

    drive.handle = refuse  # type: ignore[method-assign]
    outcome = s2000.write("drive-1.preset_frequency_1", 620)
    assert outcome.verdict is Verdict.FAILED
    assert "not be active" in outcome.reason
    refusing[0] = False
    assert s2000.write("drive-1.preset_frequency_1", 620).verdict is Verdict.CONFIRMED
    assert len([frame for frame in s2000.sent() if frame.startswith("01 10 FF DD")]) == 2


def test_a_read_on_request_brings_what_decides_its_unit() -> None:
    world = World(site_of("s2000", e1_04=Fraction(60)))
    world.run(0.5)
    [sample] = world.read("drive-1.frequency_command")
    assert (sample.value, sample.quality) == (0.0, Quality.GOOD)


def _sealed(content: bytes) -> bytes:
    crc = 0xFFFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return content + crc.to_bytes(2, "little")
