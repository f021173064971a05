"""The wire in virtual time: when a request ends, when a reply starts, what spoils either."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.simulator import CorruptByte, DelayReply, DropReply, NoiseBefore, Options
from gateway.simulator.build import build_drives, wire_timing
from gateway.simulator.line import Line
from tests.simulator.master import read, write
from tests.simulator.plant import FORMATS, line_config

READ = read(0x0020, 5)
REPLY_LENGTH = 5 + 2 * 5
TURNAROUND = 0.005
MICROSECOND = 1e-6


class Bench:
    """A line with a hand on the clock; ``got`` is what the master received, with the time of each piece."""

    def __init__(
        self,
        units: Iterable[int] = (5,),
        baud: int = 9600,
        form: str = "8N2",
        *,
        strict: bool = True,
        echo: bool = False,
        turnaround: float = TURNAROUND,
    ) -> None:
        config = line_config(units, baud, form)
        options = {drive.name: Options(turnaround=turnaround) for drive in config.drives}
        self.drives = build_drives(config, options)
        self.line = Line(wire_timing(config), self.drives.values(), strict=strict, echo=echo)
        self.character = FORMATS[form].bits_per_character / baud
        self.silence = 3.5 * self.character
        self.now = 100.0
        self.got: list[tuple[float, bytes]] = []

    def send(self, data: bytes) -> float:
        """Write at the present moment; returns it."""
        self.line.receive(data, self.now)
        return self.now

    def until(self, moment: float) -> None:
        """Let time pass, looking at every moment at which something is due."""
        while (due := self.line.due()) <= moment:
            self._look(max(due, self.now))
        self._look(moment)

    def wait(self, seconds: float) -> None:
        self.until(self.now + seconds)

    def exchange(self, data: bytes) -> bytes:
        """Everything that came within half a second after a request."""
        before = len(self.got)
        self.send(data)
        self.wait(0.5)
        return b"".join(piece for _, piece in self.got[before:])

    @property
    def last_byte_at(self) -> float:
        return self.got[-1][0]

    def _look(self, moment: float) -> None:
        self.now = moment
        if data := self.line.advance(moment):
            self.got.append((moment, data))


@pytest.mark.parametrize("form", ["8N1", "8N2", "8E1"])
@pytest.mark.parametrize("baud", [2400, 9600, 19200, 115200])
def test_a_reply_takes_its_true_time(baud: int, form: str) -> None:
    """Request, the longer of turnaround and 3.5 characters, reply."""
    bench = Bench(baud=baud, form=form)
    start = bench.send(READ)
    bench.wait(1)
    request, reply = len(READ) * bench.character, REPLY_LENGTH * bench.character
    assert bench.last_byte_at == pytest.approx(start + request + max(TURNAROUND, bench.silence) + reply)
    assert len(b"".join(piece for _, piece in bench.got)) == REPLY_LENGTH


def test_a_sixteen_register_read_at_2400_takes_about_226_ms() -> None:
    bench = Bench(baud=2400)
    start = bench.send(read(0x0200, 16))
    bench.wait(1)
    assert bench.last_byte_at - start == pytest.approx(0.2223, abs=0.0002)


def test_no_byte_comes_before_its_last_bit() -> None:
    for baud in (9600, 115200):
        bench = Bench(baud=baud)
        start = bench.send(READ)
        bench.wait(0.1)
        first_bit = start + len(READ) * bench.character + max(TURNAROUND, bench.silence)
        received = 0
        for at, piece in bench.got:
            received += len(piece)
            assert at >= first_bit + received * bench.character - MICROSECOND
            assert (
                at - first_bit - (received - len(piece)) * bench.character
                <= max(0.001, bench.character) * 1.01
            )


def test_the_profile_may_ask_for_a_longer_gap_than_the_characters() -> None:
    bench = Bench(turnaround=0.050)
    start = bench.send(READ)
    bench.wait(0.5)
    expected = start + (len(READ) + REPLY_LENGTH) * bench.character + 0.050
    assert bench.last_byte_at == pytest.approx(expected)


def test_a_request_in_pieces_is_one_frame_while_silence_is_short() -> None:
    bench = Bench()
    bench.send(READ[:3])
    bench.wait(3 * bench.character + 0.9 * bench.silence)
    bench.send(READ[3:])
    bench.wait(0.5)
    assert len(b"".join(piece for _, piece in bench.got)) == REPLY_LENGTH


def test_pieces_written_at_once_still_cross_the_wire_one_after_the_other() -> None:
    bench = Bench()
    start = bench.send(READ[:3])
    bench.send(READ[3:])
    bench.wait(0.5)
    assert bench.last_byte_at == pytest.approx(
        start + (len(READ) + REPLY_LENGTH) * bench.character + TURNAROUND
    )


def test_a_request_with_a_pause_is_two_broken_frames() -> None:
    bench = Bench()
    bench.send(READ[:3])
    bench.wait(3 * bench.character + 1.1 * bench.silence)
    assert bench.exchange(READ[3:]) == b""
    assert bench.drives["fan-5"].registers[0x003D] == 0b11


@pytest.mark.parametrize(
    ("share", "answered"), [(0.0, False), (0.5, False), (0.95, False), (1.001, True), (2.0, True)]
)
def test_strict_drives_want_their_silence(share: float, answered: bool) -> None:
    bench = Bench()
    bench.exchange(READ)
    start = bench.send(READ)
    end = start + len(READ) * bench.character + TURNAROUND + REPLY_LENGTH * bench.character
    bench.until(end + share * bench.silence)
    assert (len(bench.exchange(READ)) == REPLY_LENGTH) is answered
    assert bool(bench.line.log[-2 if answered else -1].note) is not answered
    assert bench.drives["fan-5"].registers[0x003D] == (0 if answered else 1)


def test_the_silence_counts_after_the_reply_of_any_drive() -> None:
    bench = Bench(units=(5, 6))
    start = bench.send(read(0x0020, 5, unit=6))
    bench.until(start + (len(READ) + REPLY_LENGTH) * bench.character + TURNAROUND + MICROSECOND)
    assert bench.exchange(READ) == b""


def test_lenient_drives_do_not() -> None:
    bench = Bench(strict=False)
    start = bench.send(READ)
    bench.until(start + (len(READ) + REPLY_LENGTH) * bench.character + TURNAROUND + MICROSECOND)
    assert len(bench.exchange(READ)) == REPLY_LENGTH


@pytest.mark.parametrize("strict", [True, False])
def test_two_requests_in_a_row_are_one_broken_frame(strict: bool) -> None:
    bench = Bench(strict=strict)
    assert bench.exchange(READ + READ) == b""


@pytest.mark.parametrize("strict", [True, False])
def test_talking_into_a_reply_destroys_both(strict: bool) -> None:
    bench = Bench(strict=strict)
    alone = bench.exchange(READ)
    start = bench.send(READ)
    bench.until(start + (len(READ) + 5) * bench.character + TURNAROUND)
    together = bench.exchange(write(0x0001, 1))
    assert together
    assert not alone.endswith(together)
    assert bench.drives["fan-5"].registers[0x0001] == 0
    assert [frame.note for frame in list(bench.line.log)[-2:]] == ["collision", "collision"]


def test_only_the_addressed_drive_answers() -> None:
    bench = Bench(units=(1, 2, 3))
    assert bench.exchange(read(0x0020, 1, unit=2))[0] == 2
    assert bench.exchange(read(0x0020, 1, unit=4)) == b""


def test_echo_comes_at_the_pace_of_the_wire() -> None:
    bench = Bench(echo=True)
    start = bench.send(READ)
    bench.until(start + 4 * bench.character + MICROSECOND)
    assert b"".join(piece for _, piece in bench.got) == READ[:4]
    bench.wait(0.5)
    everything = b"".join(piece for _, piece in bench.got)
    assert everything.startswith(READ)
    assert len(everything) == len(READ) + REPLY_LENGTH


def test_dropped_reply_of_a_write_that_was_done() -> None:
    bench = Bench()
    bench.drives["fan-5"].faults.inject(DropReply())
    assert bench.exchange(write(0x0002, 1234)) == b""
    assert bench.drives["fan-5"].registers[0x0002] == 1234
    assert bench.exchange(write(0x0002, 1234))


def test_corrupt_noisy_and_normal_replies_in_order() -> None:
    bench = Bench()
    good = bench.exchange(read(0x0040, 1))
    bench.drives["fan-5"].faults.inject(CorruptByte(3, 0x01))
    bench.drives["fan-5"].faults.inject(NoiseBefore(b"\x00\xff"), times=2)
    replies = [bench.exchange(read(0x0040, 1)) for _ in range(4)]
    corrupt = good[:3] + bytes((good[3] ^ 1,)) + good[4:]
    assert replies == [corrupt, b"\x00\xff" + good, b"\x00\xff" + good, good]


def test_mute_and_healed() -> None:
    bench = Bench()
    bench.drives["fan-5"].faults.mute()
    assert [bench.exchange(READ) for _ in range(3)] == [b""] * 3
    bench.drives["fan-5"].faults.clear()
    assert bench.exchange(READ)


def test_disconnected_drives_hear_nothing() -> None:
    bench = Bench()
    bench.drives["fan-5"].connected = False
    assert bench.exchange(write(0x0002, 1234)) == b""
    assert bench.drives["fan-5"].registers[0x0002] == 0


def test_a_late_reply_is_followed_by_the_next_one() -> None:
    """The late answer to one request arrives after another request has gone out."""
    bench = Bench(units=(5, 6))
    bench.drives["fan-5"].faults.inject(DelayReply(0.3))
    start = bench.send(read(0x0040, 1, unit=5))
    bench.until(start + 0.310 - len(READ) * bench.character)
    bench.send(read(0x0040, 1, unit=6))
    bench.wait(0.5)
    assert [(frame.direction, frame.data[0]) for frame in bench.line.log] == [
        (">>", 5),
        (">>", 6),
        ("<<", 5),
        ("<<", 6),
    ]
    assert [frame.note for frame in bench.line.log] == [""] * 4
    assert all(
        later.start - earlier.end >= bench.silence - MICROSECOND
        for earlier, later in pairwise(list(bench.line.log)[2:])
    )


def test_a_late_reply_that_meets_a_request_destroys_it() -> None:
    bench = Bench()
    bench.drives["fan-5"].faults.inject(DelayReply(0.3))
    start = bench.send(READ)
    bench.until(start + 0.3 + len(READ) * bench.character)
    bench.send(write(0x0002, 1234))
    bench.wait(0.5)
    assert bench.drives["fan-5"].registers[0x0002] == 0
    assert [frame.note for frame in bench.line.log] == ["", "collision", "collision"]


def test_the_log_tells_what_was_on_the_wire() -> None:
    bench = Bench()
    start = bench.send(read(0x0001, 1))
    bench.wait(0.5)
    request, reply = bench.line.log
    assert [str(request), str(reply)] == [">> 05 03 00 01 00 01 D4 4E", "<< 05 03 02 00 00 49 84"]
    assert (request.start, request.end) == (start, pytest.approx(start + 8 * bench.character))
    assert reply.start == pytest.approx(request.end + TURNAROUND)
    assert reply.end == pytest.approx(reply.start + 7 * bench.character)
    assert reply.drive == "fan-5"


@settings(deadline=None)
@given(st.lists(st.tuples(st.binary(min_size=1, max_size=40), st.floats(0, 0.1)), max_size=20), st.booleans())
def test_no_traffic_upsets_the_line(traffic: list[tuple[bytes, float]], strict: bool) -> None:
    """Whatever the master does, time goes on and a good request after a second of silence is answered."""
    bench = Bench(units=(5, 6), strict=strict)
    for data, pause in traffic:
        bench.send(data)
        bench.wait(pause)
    bench.wait(1)
    assert len(bench.exchange(READ)) == REPLY_LENGTH
    assert all(
        earlier.start <= later.start
        for earlier, later in pairwise(sorted(bench.line.log, key=lambda f: f.end))
    )


def test_another_masters_request_is_obeyed_answered_and_heard() -> None:
    wire = Bench()
    wire.line.intrude(write(0x0002, 1000), 1.0)
    wire.now = 1.5
    heard = wire.line.advance(wire.now)
    assert heard.startswith(write(0x0002, 1000))
    assert wire.drives["fan-5"].registers[0x0002] == 1000
    assert [(frame.drive, frame.note) for frame in wire.line.log] == [("stranger", ""), ("fan-5", "")]
