"""Any trace can be exported and read again, byte by byte: as text and as pcapng."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bridge.api import Frame
from gateway.capture.pcapng import MAGIC
from gateway.capture.source import Captured, CaptureError, Source
from gateway.capture.text import frame_line, head_line, read_text
from gateway.capture.wireshark import Writer, read_capture
from tests.capture.runs import eventful, trace_of

NORTH = Source("north", "rtu", "9600 8N2", "/dev/ttyUSB0")
MICROSECOND = 1000

names = st.from_regex(r"[a-z][a-z0-9-]{0,10}", fullmatch=True)
serials = st.sampled_from(["9600 8N2", "19200 8E1", "1200 7O1"])
printable = st.text(st.characters(categories=["L", "N", "P", "S"]), max_size=20)
ports = st.from_regex(r"[!-~]([ -~]{0,20}[!-~])?", fullmatch=True)
sources = st.builds(Source, names, st.sampled_from(["rtu", "ascii"]), serials, ports) | st.builds(
    Source, names, st.just("tcp"), st.just(""), ports
)
notes = st.lists(printable.filter(bool), max_size=3).map(" ".join)
frames = st.builds(
    Frame,
    st.integers(0, 2**33).map(lambda seconds: seconds * 999_983_000),
    st.booleans(),
    st.binary(min_size=1, max_size=300),
    notes,
)


@st.composite
def captures(draw: st.DrawFn) -> tuple[list[Source], list[Captured]]:
    lines = draw(st.lists(sources, min_size=1, max_size=3, unique_by=lambda source: source.name))
    return lines, draw(st.lists(st.builds(Captured, st.sampled_from(lines), frames), max_size=12))


def as_text(lines: list[Source], captured: list[Captured]) -> str:
    return "".join(f"{line}\n" for line in [*map(head_line, lines), *map(frame_line, captured)])


def as_pcapng(lines: list[Source], captured: list[Captured]) -> bytes:
    writer = Writer("gateway test", lines)
    return writer.head + b"".join(map(writer.frame, captured))


@settings(deadline=None)
@given(captures())
def test_any_trace_comes_back_from_text(capture: tuple[list[Source], list[Captured]]) -> None:
    assert list(read_text(as_text(*capture))) == capture[1]


@settings(deadline=None)
@given(captures())
def test_any_trace_comes_back_from_pcapng(capture: tuple[list[Source], list[Captured]]) -> None:
    assert list(read_capture(as_pcapng(*capture))) == capture[1]


@settings(deadline=None)
@given(st.binary(max_size=200), st.integers(0, 400), captures())
def test_a_file_that_is_no_trace_is_refused_with_words(
    noise: bytes, at: int, capture: tuple[list[Source], list[Captured]]
) -> None:
    file = as_pcapng(*capture)
    for damaged in (noise, MAGIC + noise, file[:at] + noise + file[at:], file[: -1 - at % 8]):
        try:
            list(read_capture(damaged))
        except CaptureError as error:
            assert str(error)


@settings(deadline=None)
@given(st.text(max_size=200))
def test_a_text_that_is_no_trace_is_refused_with_words(noise: str) -> None:
    try:
        list(read_text(noise))
    except CaptureError as error:
        assert str(error)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("2026-11-24T12:00:00.123456Z  north  >> 05", "line 1: nothing describes line 'north'"),
        ("# line north: rtu 9600 8N2 on /dev/ttyS0\nrubbish", "line 2 is no frame: 'rubbish'"),
        (
            "# line north: rtu 9600 8N2 on x\n2026-13-24T12:00:00.123456Z  north  >> 05",
            "line 2 is no frame: '2026-13-24T12:00:00.123456Z  north  >> 05'",
        ),
        (
            "# line north: rtu 9600 8N2 on x\n2026-11-24T12:00:00.123456Z  north  >> 0",
            "line 2 is no frame: '2026-11-24T12:00:00.123456Z  north  >> 0'",
        ),
        ("# line north: profibus on x", "'profibus on x' does not describe a line"),
    ],
)
def test_what_is_wrong_with_a_text(text: str, words: str) -> None:
    with pytest.raises(CaptureError) as refused:
        list(read_text(text))
    assert str(refused.value) == words


def test_the_text_of_a_frame() -> None:
    frame = Frame(1_795_521_600_123_456_000, True, bytes.fromhex("050300240001C585"), "read")
    assert head_line(NORTH) == "# line north: rtu 9600 8N2 on /dev/ttyUSB0"
    assert frame_line(Captured(NORTH, frame)) == (
        "2026-11-24T12:00:00.123456Z  north  >> 05 03 00 24 00 01 C5 85  read"
    )


def test_a_capture_in_the_other_byte_order_can_be_read() -> None:
    """Section header and an interface as a big-endian machine would write them."""
    description = b"rtu 9600 8N2 on x\0\0\0"
    file = bytes.fromhex("0A0D0D0A 0000001C 1A2B3C4D 0001 0000 FFFFFFFFFFFFFFFF 0000001C")
    file += bytes.fromhex("00000001 00000038 00FC 0000 00000000 0002 0001 61000000 0003 0011")
    file += description + bytes.fromhex("0000 0000 00000038")
    assert list(read_capture(file)) == []


@pytest.mark.parametrize(
    ("profile", "serial", "framing", "settings"),
    [
        ("teco-7200gs", "9600 8N2", "rtu", "{}"),
        ("s2000", "9600 8N1", "rtu", "{e1_04: 50}"),
        ("shihlin-sl3", "9600 7E1", "ascii", "{}"),
    ],
)
def test_times_are_those_of_the_bits(
    profile: str, serial: str, framing: str, settings: str, tmp_path: Path
) -> None:
    """The simulated wire keeps a log of its own: every frame is in both, at the same microsecond."""
    life = eventful(tmp_path, profile, serial, framing, settings)
    traced = [captured.frame for captured in trace_of(life)]
    wire = list(life.simulated.log)[: len(traced)]
    assert len(traced) > 30
    assert [(frame.sent, frame.data) for frame in traced] == [(w.direction == ">>", w.data) for w in wire]
    start = life.instant().wall - round(life.now * 1e9)
    late = [frame.time - start - w.start * 1e9 for frame, w in zip(traced, wire, strict=True)]
    assert all(abs(each) <= 2 * MICROSECOND for each in late), max(map(abs, late))
    assert {frame.note for frame in traced} >= {"read", "reply", "read, time-out", "damaged", "write"}
