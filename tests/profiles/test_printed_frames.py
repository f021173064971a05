"""All 33 frames that the three documents print: 30 carry the right check bytes, 3 are corrected here by
name; and what the profiles make of registers and values is what is printed."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import NamedTuple

import pytest

from gateway.core.drive import Drive
from gateway.mapping.site import DriveConfig
from gateway.modbus import pdu
from gateway.modbus.ascii import AsciiFraming
from gateway.modbus.encoding import encode
from gateway.modbus.rtu import RtuFraming, crc
from tests.modbus.printed import S2000, S2000_ERRATA, SL3, SL3_ASCII, TECO_7200GS
from tests.profiles.test_facts import profile

RTU = {
    # 000, section 8
    "000 8.1 query": "05 03 00 01 00 01 D4 4E",
    "000 8.1 return": "05 03 02 00 01 88 44",
    "000 8.1 error": "05 83 01 C1 31",
    "000 8.2 query": "05 10 00 01 00 01 02 00 01 54 81",
    "000 8.2 return": "05 10 00 01 00 01 51 8D",
    "000 8.2 error": "05 90 06 8D C3",
    # 000, section 11
    "000 11 step 1": "05 10 00 01 00 02 04 00 01 17 70 78 87",
    "000 11 step 1 return": "05 10 00 01 00 02 11 8C",
    "000 11 step 2": "05 10 00 01 00 02 04 00 01 0B B8 71 D1",
    "000 11 step 2 return": "05 10 00 01 00 02 11 8C",
    "000 11 step 3": "05 10 00 01 00 02 04 00 03 0B B8 D0 11",
    "000 11 step 3 return": "05 10 00 01 00 02 11 8C",
    "000 11 step 4": "05 10 00 01 00 01 02 00 00 95 41",
    "000 11 step 4 return": "05 10 00 01 00 01 51 8D",
    # 002, sections 6, 7, 9
    "002 6 command": "02 03 01 00 00 04 45 C6",
    "002 6 normal": "02 03 08 00 01 00 02 00 00 00 00 F3 93",
    "002 6 abnormal": "02 83 03 F1 31",
    "002 7 command": "01 10 02 80 00 02 04 02 58 01 F4 62 D3",
    "002 7 normal": "01 10 02 80 00 02 41 98",
    "002 7 abnormal": "01 90 02 CD C1",
    "002 9 command": "01 08 00 00 A5 37 DA 8D",
    "002 9 normal": "01 08 00 00 A5 37 DA 8D",
    # 003, RTU lines
    "003 1 query": "01 06 10 00 00 00 8D 0A",
    "003 1 reply": "01 06 10 00 00 00 8D 0A",
    "003 2 query": "01 03 00 A2 00 01 25 E8",
    "003 2 reply": "01 03 02 FF FF B9 F4",
}
ASCII = {
    "003 1 query": ":010610000000E9",
    "003 1 reply": ":010610000000E9",
    "003 2 query": ":010300A2000159",
    "003 2 reply": ":010302FFFFFC",
}


class Misprint(NamedTuple):
    """A frame with wrong check bytes."""

    body: str
    printed: str
    right: str


MISPRINTS = {
    "002 8 ENTER, saved into EEPROM": Misprint("01 10 FF FD 00 01 02 00 00", "BB D2", "BC B2"),
    "002 8 ENTER, not saved": Misprint("01 10 FF DD 00 01 02 00 00", "38 BA", "BB D2"),
    "002 9 abnormal": Misprint("01 88 01", "86 50", "87 C0"),
}


def test_there_are_33() -> None:
    assert len(RTU) + len(ASCII) == 30
    assert len(RTU) + len(ASCII) + len(MISPRINTS) == 33


@pytest.mark.parametrize("place", RTU)
def test_thirty_are_right(place: str) -> None:
    frame = bytes.fromhex(RTU[place])
    assert crc(frame[:-2]) == frame[-2:]


@pytest.mark.parametrize("place", ASCII)
def test_in_ascii_too(place: str) -> None:
    body = bytes.fromhex(ASCII[place][1:])
    assert sum(body) & 0xFF == 0


@pytest.mark.parametrize("place", MISPRINTS)
def test_three_are_not(place: str) -> None:
    misprint = MISPRINTS[place]
    body = bytes.fromhex(misprint.body)
    assert crc(body).hex(" ").upper() == misprint.right != misprint.printed


def test_the_tests_of_the_codec_use_these_frames() -> None:
    used = {text for e in (*TECO_7200GS, *S2000, *SL3) for text in (e.request, e.reply)}
    assert used == set(RTU.values())
    lines = {bytes.fromhex(text).decode().rstrip() for e in SL3_ASCII for text in (e.request, e.reply)}
    assert lines == set(ASCII.values())
    assert {(e.body, e.printed, e.right) for e in S2000_ERRATA} == set(MISPRINTS.values())


def drive(name: str, **settings: int) -> Drive:
    """A drive of a shipped profile."""
    made = profile(name)
    values = {s.name: s.default for s in made.settings.values() if s.default is not None}
    values |= {setting: Fraction(value) for setting, value in settings.items()}
    return Drive(DriveConfig(name="d", line="l", profile=made, unit=1, settings=values))


def write_frame(unit: int, of: Drive, raws: Mapping[str, int]) -> str:
    """The RTU frame in which the core writes these raw values, every word at rest before."""
    address, words = of.compose(raws, {})
    one = len(words) == 1 and of.facts.write_one == pdu.WRITE_ONE
    request = pdu.write_register(address, words[0]) if one else pdu.write_registers(address, words)
    return RtuFraming().encode(unit, request.pdu).hex(" ").upper()


def read_frame(unit: int, of: Drive, first: str, last: str) -> str:
    """The RTU frame that reads from one point to another."""
    points = of.profile.points
    start, end = points[first].address, points[last].address + points[last].words
    return RtuFraming().encode(unit, pdu.read_registers(start, end - start).pdu).hex(" ").upper()


@pytest.mark.parametrize(
    ("place", "command", "hertz"),
    [
        ("000 11 step 1", "run_forward", 60),
        ("000 11 step 2", "run_forward", 30),
        ("000 11 step 3", "run_reverse", 30),
        ("000 11 step 4", "stop", None),
    ],
)
def test_the_commands_of_the_7200gs_are_the_printed_steps(
    place: str, command: str, hertz: int | None
) -> None:
    teco = drive("teco-7200gs")
    (step,) = teco.profile.commands[command].steps
    raws = {}
    for name, value in step.write.items():
        number = getattr(value, "value", None)
        raws[name] = encode(teco.profile.points[name].encoding, Fraction(hertz if number is None else number))
    assert write_frame(5, teco, raws) == RTU[place]


def test_examples_of_section_8() -> None:
    teco = drive("teco-7200gs")
    assert read_frame(5, teco, "run", "run") == RTU["000 8.1 query"]
    assert write_frame(5, teco, {"run": 1}) == RTU["000 8.2 query"]
    errors = teco.profile.errors
    assert (errors[0x01].name, errors[0x06].name) == ("illegal_function", "busy")


def test_parameters_of_the_s2000() -> None:
    s2000 = drive("s2000", e1_04=60)
    assert read_frame(2, s2000, "language", "initialise") == RTU["002 6 command"]
    presets = {"preset_frequency_1": 0x0258, "preset_frequency_2": 0x01F4}
    assert write_frame(1, s2000, presets) == RTU["002 7 command"]


@pytest.mark.parametrize(
    ("place", "point"),
    [("002 8 ENTER, saved into EEPROM", "enter_eeprom"), ("002 8 ENTER, not saved", "enter_ram")],
)
def test_enter_is_sent_with_the_right_check_bytes(place: str, point: str) -> None:
    misprint = MISPRINTS[place]
    sent = write_frame(1, drive("s2000", e1_04=60), {point: 0})
    assert sent == f"{misprint.body} {misprint.right}"


def test_examples_of_the_sl3() -> None:
    sl3 = drive("shihlin-sl3")
    assert write_frame(1, sl3, {"operation_mode": 0}) == RTU["003 1 query"]
    assert read_frame(1, sl3, "p_162", "p_162") == RTU["003 2 query"]
    request = pdu.write_register(sl3.profile.points["operation_mode"].address, 0)
    assert AsciiFraming().encode(1, request.pdu) == f"{ASCII['003 1 query']}\r\n".encode()
