"""Golden transcripts of the shipped drives' lives: identify, poll, run, change, reverse, stop, fault,
reset, parameter write, refusal.

Set ``TRANSCRIPTS=write`` in the environment to write them anew after a wanted change, and read the diff.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from gateway.simulator.happening import Cured
from gateway.tag import Cause, Verdict
from tests.profiles.life import Life

FOLDER = Path(__file__).parent.parent / "transcripts"
LIVES: dict[str, Callable[[Path], Life]] = {}


def life(play: Callable[[Path], Life]) -> Callable[[Path], Life]:
    LIVES[play.__name__] = play
    return play


@life
def life_of_the_7200gs(folder: Path) -> Life:
    drive = Life(folder, "teco-7200gs", unit=5, serial="9600 8N2")
    drive.written.append("# identify: the first answer")
    drive.found()
    drive.chapter("poll: 0020H to 0024H every 200 ms")
    drive.watch({"fan-1.running": 0.2, "fan-1.output_frequency": 0.2})
    drive.run(0.5)
    drive.watch({"fan-1.running": None, "fan-1.output_frequency": None})
    drive.chapter("run forward at 60 Hz: section 11, step 1, after a look at Sn-08")
    drive.do("run_forward", frequency=60.0)
    drive.chapter("change to 30 Hz: the run bit is not touched")
    drive.put("frequency_command", 30.0)
    drive.chapter("refusal by the gateway: a parameter that is locked while running")
    refused = drive.put("input_voltage", 230, verdict=Verdict.REFUSED)
    assert (refused.cause, refused.code) == (Cause.PRECONDITION, None)
    drive.chapter("reverse at 30 Hz: step 3")
    drive.do("run_reverse", frequency=30.0)
    drive.chapter("stop: step 4")
    drive.do("stop")
    drive.chapter("fault: an overcurrent while running forward at 20 Hz")
    drive.do("run_forward", frequency=20.0)
    drive.trips("fault_overcurrent")
    drive.run(1.0)
    assert drive.value("fault_overcurrent") is True
    drive.chapter("stop and reset: the pulse of 0001H bit 3")
    drive.do("stop")
    drive.do("reset_fault")
    drive.chapter("parameter: bn-01 from 2 to 50; the second time there is nothing to write")
    drive.put("acceleration_time_1", 50)
    assert drive.put("acceleration_time_1", 50).reason == "it was so already"
    drive.chapter("Cn-02 is locked until Sn-02 is 0FH; the twin takes its 300 for 30 Hz")
    assert drive.put("max_output_frequency", 300, verdict=Verdict.REFUSED).code is None
    drive.put("vf_pattern", 15)
    drive.put("max_output_frequency", 300)
    drive.chapter("refusal by the drive: 21H, 30.01 Hz where it takes 30 Hz")
    refused = drive.put("frequency_command", 30.01, verdict=Verdict.REFUSED)
    assert (refused.cause, refused.code, refused.drive_error) == (
        Cause.DRIVE_REFUSED,
        0x21,
        "illegal_value",
    )
    drive.run(0.3)
    return drive


@life
def life_of_the_s2000(folder: Path) -> Life:
    settings = "{e1_04: 60, h1_02: fault_reset}"
    drive = Life(folder, "s2000", unit=1, serial="9600 8N1", settings=settings)
    drive.written.append("# identify: the first answer")
    drive.found()
    drive.chapter("poll: 0010H every 200 ms")
    drive.watch({"fan-1.running": 0.2, "fan-1.fault": 0.2})
    drive.run(0.5)
    drive.watch({"fan-1.running": None, "fan-1.fault": None})
    drive.chapter("run forward at 60 Hz: one message, in the unit that 000FH chooses (0.1 Hz)")
    drive.do("run_forward", frequency=60.0)
    drive.chapter("change to 30 Hz: the run bits are not touched")
    drive.put("frequency_command", 30.0)
    drive.chapter("refusal by the gateway: a parameter that is locked while running")
    refused = drive.put("preset_frequency_1", 600, verdict=Verdict.REFUSED)
    assert (refused.cause, refused.code) == (Cause.PRECONDITION, None)
    drive.chapter("reverse at 30 Hz")
    drive.do("run_reverse", frequency=30.0)
    drive.chapter("stop")
    drive.do("stop")
    drive.chapter("fault: an overcurrent while running forward at 20 Hz")
    drive.do("run_forward", frequency=20.0)
    drive.trips("fault_oc")
    drive.run(1.0)
    assert drive.value("fault_oc") is True
    drive.chapter("stop and reset: terminal 4 is closed and opened")
    drive.do("stop")
    drive.do("reset_fault")
    drive.chapter("parameter: 0280H becomes 600 (section 7), then ENTER to RAM (section 8)")
    drive.put("preset_frequency_1", 600)
    drive.chapter("another unit: 000FH bit 0 is set, what else stands there is kept")
    drive.put("broadcast_terminal_5", True)
    drive.put("frequency_unit", "by_g1_03")
    drive.put("frequency_command", 30.0)
    drive.chapter("store: ENTER to EEPROM; a write while it saves is refused with 24H and asked again")
    drive.do("store_parameters")
    drive.put("frequency_command", 31.0)
    drive.chapter("refusal by the drive: 23H at undervoltage, asked again once that is gone")
    drive.trips("warning_uv")
    drive.run(0.5)
    asked = drive.ask_write("fan-1.frequency_command", 32.0)
    drive.run(1.0)
    drive.happens(Cured("warning_uv"))
    outcome = drive.until(asked, 10.0)
    assert outcome.verdict is Verdict.CONFIRMED, outcome
    drive.run(0.3)
    return drive


@life
def life_of_the_sl3(folder: Path) -> Life:
    return _sl3(Life(folder, "shihlin-sl3", unit=1, serial="9600 8E1", framing="rtu"))


@life
def life_of_the_sl3_in_ascii(folder: Path) -> Life:
    return _sl3(Life(folder, "shihlin-sl3", unit=1, serial="9600 7E1", framing="ascii"))


def _sl3(drive: Life) -> Life:
    drive.written.append("# identify: the first answer")
    drive.found()
    drive.chapter("poll: 1001H, and 1003H with P.37, which decides its decimals")
    drive.watch({"fan-1.running": 0.2, "fan-1.output_frequency": 0.2})
    drive.run(0.5)
    drive.watch({"fan-1.running": None, "fan-1.output_frequency": None})
    drive.chapter("refusal by the gateway: the drive is in the hands of its panel")
    refused = drive.do("run_forward", frequency=60.0, verdict=Verdict.REFUSED)
    assert refused.cause is Cause.PRECONDITION
    drive.chapter("take control: example 1")
    drive.do("take_control")
    drive.chapter("run forward at 60 Hz: the frequency first, then the command")
    drive.do("run_forward", frequency=60.0)
    drive.chapter("change to 30 Hz")
    drive.put("frequency_command", 30.0)
    drive.chapter("reverse at 30 Hz")
    drive.do("run_reverse", frequency=30.0)
    drive.chapter("stop")
    drive.do("stop")
    drive.chapter("fault: an overcurrent while running forward at 20 Hz")
    drive.do("run_forward", frequency=20.0)
    drive.trips("overcurrent")
    drive.run(1.0)
    assert drive.value("previous_fault_1") == 16
    drive.chapter("reset: the command is taken back, then the drive restarts without an answer")
    drive.do("reset_fault")
    drive.chapter("parameter: P.162 reads as FFFFH (example 2), becomes 5000, and the frequency is stored")
    assert drive.value("p_162") is None
    drive.put("p_162", 5000)
    drive.put("frequency_stored", 25.0)
    drive.chapter("monitor 5 behind its selector")
    drive.value("selected_value_5")
    drive.run(0.3)
    return drive


@pytest.mark.parametrize("name", LIVES)
def test_life(name: str, tmp_path: Path) -> None:
    text = LIVES[name](tmp_path).text()
    file = FOLDER / f"{name}.txt"
    if os.environ.get("TRANSCRIPTS") == "write":
        file.write_text(text, encoding="utf-8")
    assert text == file.read_text(encoding="utf-8")
