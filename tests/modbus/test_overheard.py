"""Frames of strangers in what came in."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.modbus.overheard import Sort, overheard
from tests.line.asciiunit import ascii_frame
from tests.line.bench import frame

REQUEST = frame(bytes((7, 3, 0, 0x20, 0, 5)))
REPLY = frame(bytes((7, 3, 4, 1, 2, 3, 4)))
EXCEPTION = frame(bytes((7, 0x83, 2)))
WRITE = frame(bytes((7, 16, 0, 1, 0, 2, 4, 1, 2, 3, 4)))
WRITTEN = frame(bytes((7, 16, 0, 1, 0, 2)))
SINGLE = frame(bytes((7, 6, 0, 1, 0, 2)))


@pytest.mark.parametrize(
    ("data", "sort", "function"),
    [
        (REQUEST, Sort.REQUEST, 3),
        (REPLY, Sort.REPLY, 3),
        (EXCEPTION, Sort.REPLY, 0x83),
        (WRITE, Sort.REQUEST, 16),
        (WRITTEN, Sort.REPLY, 16),
        (SINGLE, Sort.EITHER, 6),
    ],
)
def test_a_frame_is_known_by_its_shape(data: bytes, sort: Sort, function: int) -> None:
    heard = overheard("rtu", data)
    assert heard.rest == 0
    [found] = heard.frames
    assert (found.unit, found.function, found.sort, found.frame) == (7, function, sort, data)


noise = st.binary(max_size=5)
frames = st.sampled_from([REQUEST, REPLY, EXCEPTION, WRITE, WRITTEN, SINGLE])


@given(st.lists(st.tuples(noise, frames), max_size=4), noise)
def test_frames_are_found_between_noise(parts: list[tuple[bytes, bytes]], end: bytes) -> None:
    data = b"".join(before + whole for before, whole in parts) + end
    found = [one.frame for one in overheard("rtu", data).frames]
    assert [whole for _, whole in parts if whole in found] == [whole for _, whole in parts]


@given(st.binary(max_size=300))
def test_nothing_escapes_from_any_bytes(data: bytes) -> None:
    for framing in ("rtu", "ascii", "tcp"):
        heard = overheard(framing, data)  # type: ignore[arg-type]
        assert 0 <= heard.rest <= len(data)
        assert sum(len(one.frame) for one in heard.frames) + heard.rest == (
            len(data) if framing != "tcp" else 0
        )


def test_a_damaged_frame_is_none() -> None:
    assert overheard("rtu", REPLY[:-1] + b"\x00") == ([], len(REPLY))


def test_ascii_frames() -> None:
    request, reply = ascii_frame(REQUEST[:-2]), ascii_frame(REPLY[:-2])
    heard = overheard("ascii", b"xx" + request + b":0" + reply)
    assert [one.sort for one in heard.frames] == [Sort.REQUEST, Sort.REPLY]
    assert heard.rest == 4
    assert overheard("ascii", request[:-3] + b"0\r\n").frames == []
