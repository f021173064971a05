"""The trace of a line: every byte once, with the time of its first bit and what it was; bounded."""

from __future__ import annotations

import tracemalloc

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.line.interface import LineSettings, Priority, Want, Write
from gateway.line.trace import BYTES, FRAMES, Trace, Traced
from gateway.mapping.profile import SerialFormat
from tests.line.bench import CHARACTER, SILENCE, Bench, FakeUnit, facts, frame

READ = frame(bytes.fromhex("05 03 00 24 00 01"))
REPLY = frame(bytes.fromhex("05 03 02 0B B8"))


def trace() -> Trace:
    return Trace(CHARACTER, SILENCE, lambda data: frame(data[:-2]) == data)


def kept(trace: Trace) -> list[Traced]:
    return trace.page(0, FRAMES)[1]


def notes(bench: Bench) -> list[tuple[str, str]]:
    """What the line kept: direction and note."""
    bench.line.trace.settle(bench.now)
    return [(">>" if frame.sent else "<<", frame.note) for frame in kept(bench.line.trace)]


def polling(fake: FakeUnit, **unit: object) -> Bench:
    return Bench([facts(**unit)], [fake]).start(Want(5, 0x24, 1, 0.5))


def test_a_read_and_its_reply_with_the_times_of_their_first_bits() -> None:
    bench = polling(FakeUnit(registers={0x24: 3000}, delay=0.005))
    bench.run(0.3)
    asked, answered = kept(bench.line.trace)
    assert (asked.sent, asked.data, asked.note) == (True, READ, "read")
    assert (answered.sent, answered.data, answered.note) == (False, REPLY, "reply")
    assert answered.at == pytest.approx(asked.at + len(READ) * CHARACTER + 0.005, abs=1e-9)
    assert asked.at == bench.wire[0][0]


def test_a_time_out_is_told_with_its_request() -> None:
    bench = polling(FakeUnit(on=False))
    bench.run(3)
    assert notes(bench)[0] == (">>", "read, time-out")


def test_a_damaged_reply_is_kept_as_such() -> None:
    bench = polling(FakeUnit(damage=True))
    bench.run(3)
    assert notes(bench)[:2] == [(">>", "read, time-out"), ("<<", "damaged")]


def test_noise_before_a_reply_is_no_part_of_it() -> None:
    bench = polling(FakeUnit(before=b"\x00\xff", registers={0x24: 3000}))
    bench.run(0.2)
    _, noise, answered = kept(bench.line.trace)
    assert (noise.data, noise.note) == (b"\x00\xff", "damaged")
    assert (answered.data, answered.note) == (REPLY, "reply")
    assert answered.at == pytest.approx(noise.at + 2 * CHARACTER, abs=1e-9)


def test_an_exception_and_a_write() -> None:
    bench = Bench([facts()], [FakeUnit(refuse={16: 0x22})]).start()
    bench.run(0.1)
    bench.ask(Write(5, 1, (1,)), Priority.COMMAND)
    bench.run(0.2)
    assert notes(bench) == [(">>", "write"), ("<<", "exception 22H")]


def test_the_instant_at_which_a_request_really_left_counts() -> None:
    record = trace()
    record.sent(READ, "read", 1.0)
    record.leaves(1.0007)
    record.received(REPLY, 1.03)
    record.answered("reply", len(REPLY))
    assert [frame.at for frame in kept(record)] == [1.0007, pytest.approx(1.03 - len(REPLY) * CHARACTER)]


def test_our_echo_is_called_by_its_name() -> None:
    settings = LineSettings(name="north", framing="rtu", baud=9600, format=SerialFormat(8, "N", 2), echo=True)
    bench = Bench([facts()], [FakeUnit()], settings).start(Want(5, 0x24, 1, 0.5))
    bench.echo = True
    bench.run(0.2)
    assert notes(bench) == [(">>", "read"), ("<<", "echo"), ("<<", "reply")]


def test_strangers_are_strays_frame_by_frame() -> None:
    bench = Bench([facts()], [FakeUnit()]).start()
    bench.run(0.1)
    question, answer = frame(bytes.fromhex("070300000001")), frame(bytes.fromhex("0703020001"))
    bench.receive(question[:3], bench.now + 0.01 + 3 * CHARACTER)
    bench.receive(question[3:], bench.now + 0.01 + 8 * CHARACTER)
    bench.receive(answer, bench.now + 0.05)
    bench.run(0.2)
    bench.line.trace.settle(bench.now)
    assert [(f.data, f.note) for f in kept(bench.line.trace)] == [(question, "stray"), (answer, "stray")]


def test_what_puts_a_unit_in_step() -> None:
    fake = FakeUnit(functions=(3, 8, 16))
    bench = Bench([facts(functions=(3, 8, 16), loop_back=True, reply_max=0.05)], [fake])
    bench.start(Want(5, 0x20, 1, 0.5)).run(0.1)
    fake.on = False
    bench.run(0.55)
    fake.on = True
    bench.run(0.5)
    told = [note for _, note in notes(bench)]
    assert told[2:4] == ["read, time-out", "resynchronise, time-out"]
    assert told[told.index("resynchronise") + 1 :][:3] == ["reply", "read", "reply"]


def test_what_is_not_believed() -> None:
    delays = iter([0.06])
    fake = FakeUnit(late=lambda: next(delays, 0.0))
    bench = Bench([facts(readable=((0x20, 0x20),), reply_max=0.05)], [fake])
    bench.quiet = False
    bench.start(Want(5, 0x20, 1, 0.5)).run(2)
    assert "reply, not believed" in [note for _, note in notes(bench)]


def test_a_write_that_is_not_answered_is_kept_at_once() -> None:
    bench = Bench([facts()], [FakeUnit()]).start()
    bench.run(0.1)
    bench.ask(Write(0, 1, (1,)))
    bench.run(0.02)
    assert notes(bench) == [(">>", "write")]


def test_a_lost_line_is_told_with_the_request() -> None:
    bench = polling(FakeUnit(on=False))
    bench.run(0.01)
    bench.unplug()
    assert notes(bench) == [(">>", "read, line lost")]


def test_frames_have_numbers_and_pages() -> None:
    record = trace()
    for number in range(5):
        record.sent(bytes((number,)), "read", float(number))
        record.unanswered("time-out")
    first, frames = record.page(2, 2)
    assert (first, [f.data for f in frames], record.last) == (3, [b"\x02", b"\x03"], 5)
    assert record.page(5, 2) == (6, [])


def test_only_so_many_frames_are_kept() -> None:
    record = trace()
    for _ in range(FRAMES + 10):
        record.sent(READ, "read", 1.0)
        record.unanswered("time-out")
    first, frames = record.page(0, FRAMES * 2)
    assert (first, len(frames), record.last) == (11, FRAMES, FRAMES + 10)


@pytest.mark.parametrize("asked", [True, False])
def test_a_babbler_fills_no_memory(asked: bool) -> None:
    record = trace()
    if asked:
        record.sent(READ, "read", 0.0)
    tracemalloc.start()
    try:
        for number in range(3 * BYTES // 4096):
            record.received(b"\x55" * 4096, 1.0 + number * 4096 * CHARACTER)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 1.5 * BYTES
    assert all(len(f.data) <= 4096 for f in kept(record))
    assert (kept(record)[0].note == "stray") or not asked


def test_nine_minutes_of_a_busy_line_are_kept() -> None:
    bench = polling(FakeUnit(), readable=((0x24, 0x24),)).start(Want(5, 0x24, 1, 0.001))
    bench.run(20)
    first, last = kept(bench.line.trace)[0], kept(bench.line.trace)[-1]
    minutes = (last.at - first.at) / 60 * FRAMES / len(kept(bench.line.trace))
    assert minutes > 6


PIECES = st.lists(st.binary(min_size=1, max_size=40), min_size=1, max_size=8)


@settings(deadline=None)
@given(pieces=PIECES, length=st.integers(1, 60))
def test_every_byte_is_kept_once_and_in_order(pieces: list[bytes], length: int) -> None:
    record = trace()
    record.sent(READ, "read", 1.0)
    at = 1.0 + len(READ) * CHARACTER
    for piece in pieces:
        at += len(piece) * CHARACTER
        record.received(piece, at)
    came = b"".join(pieces)
    record.answered("reply", min(length, len(came)))
    record.unanswered()
    frames = kept(record)
    assert (frames[0].data, frames[0].sent) == (READ, True)
    assert b"".join(f.data for f in frames[1:]) == came
    assert [f.at for f in frames] == sorted(f.at for f in frames)
