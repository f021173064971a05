"""ASCII on a line in virtual time."""

from dataclasses import replace

import pytest

from gateway.line.interface import Answered, LineSettings, Read, Silent, Want, Write
from gateway.line.line import Line
from gateway.mapping.profile import SerialFormat
from tests.line.asciiunit import AsciiUnit, ascii_frame
from tests.line.bench import Bench, FakeUnit, facts

FORMATS = [SerialFormat(7, "E", 1), SerialFormat(7, "N", 2), SerialFormat(7, "O", 1)]
ASCII = LineSettings(name="north", framing="ascii", baud=9600, format=FORMATS[0])
SL3 = {"functions": (3, 6, 8, 16), "write_one": 6}
FREQUENCY = Want(5, 0x24, 1, 0.3)


def one(settings: LineSettings = ASCII, **unit: object) -> Bench:
    bench = Bench([facts(**SL3)], [AsciiUnit(functions=(3, 6, 8, 16), **unit)], settings)  # type: ignore[arg-type]
    bench.quiet = False  # frames end by their CR LF, not by silence
    return bench


@pytest.mark.parametrize("form", FORMATS, ids=str)
def test_reads_and_writes(form: SerialFormat) -> None:
    bench = one(replace(ASCII, format=form), registers={0x24: 6000}).start(FREQUENCY)
    bench.run(2)
    job = bench.ask(Write(5, 0x02, (3000,)))
    bench.run(1)
    assert set(bench.values(0x24)) == {6000}
    assert bench.result(job) == Answered()
    assert bench.fakes[5].writes == [(2, (3000,))]
    assert bench.line.counters.timeouts == 0
    requests = [data for _, sent, data in bench.wire if sent]
    assert b":050300240001D3\r\n" in requests
    assert b":050600020BB830\r\n" in requests


@pytest.mark.parametrize("form", FORMATS, ids=str)
def test_a_character_has_ten_bits(form: SerialFormat) -> None:
    bench = one(replace(ASCII, format=form)).start(FREQUENCY)
    [block] = bench.line.plan.blocks
    assert block.cost == pytest.approx((17 + 15) * 10 / 9600 + 0.005)


@pytest.mark.parametrize(("gap", "kept"), [(0.0, 0.0), (0.01, 0.01)])
def test_silence_only_where_the_profile_wants_it(gap: float, kept: float) -> None:
    assert Line(replace(ASCII, gap=gap), [facts()]).gap == kept


@pytest.mark.parametrize(
    ("baud", "gap", "kept"),
    [(9600, 0.0, 3.5 * 11 / 9600), (9600, 0.01, 0.01), (2400, 0.01, 3.5 * 11 / 2400), (38400, 0.0, 0.00175)],
)
def test_rtu_keeps_the_longer_of_characters_and_milliseconds(baud: int, gap: float, kept: float) -> None:
    rtu = LineSettings(name="north", framing="rtu", baud=baud, format=SerialFormat(8, "N", 2), gap=gap)
    assert Line(rtu, [facts()]).gap == pytest.approx(kept)


def slowly(bench: Bench, reply: bytes, pause: float, start: float) -> None:
    """The characters of a reply one by one."""
    for number, character in enumerate(reply):
        bench.receive(bytes((character,)), start + number * pause)


@pytest.mark.parametrize(("pause", "result"), [(0.9, Answered((6000,))), (1.2, Silent(damaged=True))])
def test_up_to_a_second_may_pass_between_two_characters(pause: float, result: object) -> None:
    bench = one().start(FREQUENCY)
    bench.run(5)
    bench.demand()
    bench.run(1)
    bench.fakes[5].on = False
    job = bench.ask(Read(5, 0x24, 1))
    slowly(bench, ascii_frame(bytes((5, 3, 2)) + (6000).to_bytes(2, "big")), pause, bench.now + 0.03)
    bench.run(20)
    assert bench.result(job) == result


def test_characters_that_begin_no_reply_are_not_waited_for() -> None:
    bench = one().start(FREQUENCY)
    bench.run(5)
    bench.demand()
    bench.run(1)
    bench.fakes[5].on = False
    job = bench.ask(Read(5, 0x24, 1))
    bench.receive(b"\x7f", bench.now + 0.03)
    bench.receive(b":07", bench.now + 0.031)
    bench.run(0.3)
    assert bench.result(job) == Silent(damaged=True)


@pytest.mark.parametrize("declared", [True, False])
def test_own_echo(declared: bool) -> None:
    bench = one(replace(ASCII, echo=declared), registers={0x24: 6000})
    bench.echo = True
    bench.start(FREQUENCY)
    bench.run(3)
    assert set(bench.values(0x24)) == {6000}
    job = bench.ask(Write(5, 2, (7,)))
    bench.run(1)
    assert bench.result(job) == Answered()
    assert bench.line.counters.timeouts == 0
    bench.fakes[5].on = False
    job = bench.ask(Write(5, 2, (8,)))
    bench.run(3)
    assert bench.result(job) == Silent(), "our own echo is not the drive's answer"


def test_a_unit_that_speaks_rtu_is_not_understood() -> None:
    class Rtu(FakeUnit):
        def answer(self, request: bytes) -> bytes | None:
            return bytes.fromhex("05 03 02 17 70 45 8A")

    bench = Bench([facts()], [Rtu()], ASCII)
    bench.quiet = False
    bench.start(FREQUENCY)
    bench.run(10)
    assert bench.values(0x24) == []
    assert bench.line.up(5) is False
