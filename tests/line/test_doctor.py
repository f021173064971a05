"""Each illness of a line is told within ten seconds, and a sound line has none."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.line.doctor.finding import Finding, Illness
from gateway.line.interface import Want
from tests.line.bench import SETTINGS, SILENCE, Bench, FakeUnit, facts, frame, seeded

SOON = 10.0
"""Seconds within which an illness has to be told."""
FASTER = {"readable": ((0x01, 0x02), (0x20, 0x2D), (0x31, 0x33))}


def line_of(units: int = 4, *, echo: bool = False, period: float = 0.3, **fakes: object) -> Bench:
    """A line with units 1, 2 ..., of each of which a short and a long block is wanted."""
    numbers = range(1, units + 1)
    bench = Bench(
        [facts(unit) for unit in numbers],
        [FakeUnit(unit, **fakes) for unit in numbers],  # type: ignore[arg-type]
        replace(SETTINGS, echo=echo),
    )
    bench.quiet = False
    wants = [Want(unit, address, count, period) for unit in numbers for address, count in ((1, 2), (0x27, 5))]
    return bench.start(*wants)


class Ward:
    """Examines a line once a second and remembers when each illness was told first."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.first: dict[Illness, float] = {}
        self.last: list[Finding] = []
        self.since = bench.now

    def watch(self, seconds: float) -> Ward:
        """Let time pass."""
        for _ in range(round(seconds)):
            self.bench.run(1.0)
            self.last = self.bench.line.examine(self.bench.now)
            for finding in self.last:
                self.first.setdefault(finding.illness, self.bench.now - self.since)
        return self

    def fault(self) -> None:
        """Count from now on; what was told before is forgotten."""
        self.first, self.since = {}, self.bench.now

    @property
    def told(self) -> set[Illness]:
        """All that was told."""
        return set(self.first)

    def the(self, illness: Illness) -> Finding:
        """The one finding there is now, told in time."""
        assert self.told == {illness}
        assert self.first[illness] <= SOON
        [found] = [one for one in self.last if one.illness is illness]
        return found


def garbage(seed: int) -> Callable[[bytes], bytes]:
    """What a reply at another speed looks like: other bytes, and another number of them."""
    draw = seeded(seed)
    return lambda reply: draw.randbytes(max(3, round(len(reply) * draw.choice((0.5, 0.6, 1.7, 2.0)))))


def flipped(share: float, seed: int = 1) -> Callable[[bytes], bytes]:
    """Noise: of so many replies up to three bits are turned."""
    draw = seeded(seed)

    def distort(reply: bytes) -> bytes:
        if draw.random() >= share:
            return reply
        damaged = bytearray(reply)
        for _ in range(draw.randint(1, 3)):
            damaged[draw.randrange(len(damaged))] ^= 1 << draw.randrange(8)
        return bytes(damaged)

    return distort


def everybody(bench: Bench, **changes: object) -> None:
    for fake in (*bench.fakes.values(), *bench.twins):
        for name, value in changes.items():
            setattr(fake, name, value)


# -- a sound line


@settings(max_examples=25, deadline=None)
@given(
    st.integers(1, 6),
    st.lists(st.floats(0.001, 0.03), min_size=6, max_size=6),
    st.sampled_from([0.0, 0.001, 0.01]),
    st.sampled_from([0.05, 0.2, 1.0, 10.0]),
    st.randoms(use_true_random=False),
    st.booleans(),
)
def test_a_sound_line_has_no_diagnosis(units, delays, jitter, period, random, echo) -> None:  # type: ignore[no-untyped-def]
    """Whatever its drives need, however full it is, with a few writes and refusals."""
    bench = line_of(units, period=period, echo=echo)
    bench.echo = echo
    for fake, delay in zip(bench.fakes.values(), delays, strict=False):
        fake.delay = delay
        fake.late = lambda: random.uniform(0, jitter)
    if random.random() < 0.3:
        bench.fakes[1].refuse = {3: 2}
    ward = Ward(bench).watch(25)
    assert not ward.first
    assert bench.line.doctor.line.violations == 0
    assert bench.line.doctor.line.strays == 0


def test_no_diagnosis_before_anything_happened() -> None:
    bench = Bench([facts(5)], [FakeUnit(5)])
    bench.start()
    assert not Ward(bench).watch(20).first


# -- each illness


@pytest.mark.parametrize("units", [1, 2, 8])
@pytest.mark.parametrize("after", [0.0, 20.0])
def test_wrong_speed_or_format(units: int, after: float) -> None:
    bench = line_of(units)
    ward = Ward(bench).watch(after)
    assert not ward.first
    ward.fault()
    everybody(bench, distort=garbage(units))
    found = ward.watch(20).the(Illness.WRONG_FORMAT)
    assert found.units == ()
    assert found.evidence["valid"] == 0
    everybody(bench, distort=lambda reply: reply)
    ward.watch(12)
    assert ward.last == []


@pytest.mark.parametrize("seconds", [0.2, 1.0, 3.0])
@pytest.mark.parametrize("units", [1, 4])
def test_a_burst_of_noise_is_no_wrong_speed(units: int, seconds: float) -> None:
    for damage in (garbage(7), flipped(1.0)):
        bench = line_of(units)
        ward = Ward(bench).watch(5)
        everybody(bench, distort=damage)
        bench.run(seconds)
        everybody(bench, distort=lambda reply: reply)
        ward.watch(30)
        assert ward.told <= {Illness.NOISE}
        assert ward.last == []


@pytest.mark.parametrize("damage", [garbage(7), flipped(1.0)])
def test_garbage_of_all_that_is_over_is_no_second_drive_of_one_that_is_asked_seldom(damage) -> None:  # type: ignore[no-untyped-def]
    """The others have answered well a hundred times while it was not asked once."""
    bench = Bench([facts(1), facts(2)], [FakeUnit(1), FakeUnit(2)])
    bench.quiet = False
    reads = ((1, 2), (0x27, 5))
    wants = [Want(unit, *read, period) for unit, period in ((1, 5.0), (2, 0.05)) for read in reads]
    ward = Ward(bench.start(*wants)).watch(10)
    everybody(bench, distort=damage)
    ward.watch(15)
    everybody(bench, distort=lambda reply: reply)
    ward.watch(40)
    assert Illness.TWO_DRIVES not in ward.told


@pytest.mark.parametrize("units", [2, 8])
def test_silence_of_one_drive(units: int) -> None:
    bench = line_of(units)
    ward = Ward(bench).watch(5)
    ward.fault()
    bench.fakes[2].on = False
    found = ward.watch(30).the(Illness.DRIVE_SILENT)
    assert found.units == (2,)
    assert found.evidence["unanswered"] >= 3
    bench.fakes[2].on = True
    ward.watch(12)
    assert ward.last == []


def test_silence_of_a_drive_that_was_never_there() -> None:
    bench = line_of(8)
    bench.fakes[3].on = False
    assert Ward(bench).watch(20).the(Illness.DRIVE_SILENT).units == (3,)


@pytest.mark.parametrize("units", [1, 2, 8, 31])
@pytest.mark.parametrize("after", [0.0, 10.0])
def test_silence_of_all(units: int, after: float) -> None:
    bench = line_of(units, period=2.0)
    everybody(bench, on=after > 0)
    ward = Ward(bench).watch(after)
    ward.fault()
    everybody(bench, on=False)
    found = ward.watch(25).the(Illness.ALL_SILENT)
    assert found.evidence["answered_before"] == (after > 0)
    everybody(bench, on=True)
    ward.watch(20 + 5 * units)  # probes take their share of the line only
    assert ward.last == []


def test_a_port_that_is_gone() -> None:
    bench = line_of(2)
    ward = Ward(bench).watch(3)
    ward.fault()
    bench.unplug()
    ward.watch(5).the(Illness.PORT_DOWN)
    bench.port = True
    ward.watch(12)
    assert ward.last == []


@pytest.mark.parametrize("share", [0.05, 0.2])
@pytest.mark.parametrize("units", [1, 8])
def test_noise(units: int, share: float) -> None:
    bench = line_of(units, period=0.1)
    ward = Ward(bench).watch(5)
    ward.fault()
    everybody(bench, distort=flipped(share))
    found = ward.watch(30).the(Illness.NOISE)
    assert found.units == ()
    assert found.evidence["damaged"] >= 3


def test_noise_on_the_cable_of_one_drive() -> None:
    bench = line_of(4)
    bench.fakes[2].distort = flipped(0.3)
    found = Ward(bench).watch(30).the(Illness.NOISE)
    assert found.units == (2,)


def test_noise_that_makes_bytes_of_its_own() -> None:
    bench = line_of(2, period=2.0)
    draw = seeded(3)
    for n in range(200):
        bench.receive(draw.randbytes(2), bench.now + 0.5 + 0.3 * n)
    assert Ward(bench).watch(20).told == {Illness.NOISE}


@pytest.mark.parametrize("differ", [False, True])
@pytest.mark.parametrize("units", [1, 4])
def test_two_drives_that_answer_one_after_the_other(units: int, differ: bool) -> None:
    bench = line_of(units)
    twin = FakeUnit(1, delay=0.0)
    twin.late = lambda: 1.5 * SILENCE + bench.fakes[1].busy_until - bench.now + 12 * 11 / 9600
    twin.registers = dict.fromkeys(range(64), 7) if differ else {}
    bench.twins.append(twin)
    ward = Ward(bench).watch(20)
    assert Illness.TWO_DRIVES in ward.told
    assert ward.first[Illness.TWO_DRIVES] <= SOON
    [found] = [one for one in ward.last if one.illness is Illness.TWO_DRIVES]
    assert found.units == (1,)


@pytest.mark.parametrize("units", [1, 4])
def test_two_drives_that_talk_at_once(units: int) -> None:
    """Both begin alike; where their data differ, the wire carries neither."""
    bench = line_of(units)
    ward = Ward(bench).watch(5)
    ward.fault()
    bench.fakes[1].distort = lambda reply: reply[:3] + bytes(byte & 0x5A for byte in reply[3:]) + b"\x11\x22"
    found = ward.watch(20).the(Illness.TWO_DRIVES)
    assert found.units == (1,)


def test_an_echo_that_the_site_does_not_declare() -> None:
    bench = line_of(2)
    bench.echo = True
    Ward(bench).watch(20).the(Illness.ECHO_UNDECLARED)


def test_an_echo_that_is_declared_and_not_there() -> None:
    bench = line_of(2, echo=True)
    Ward(bench).watch(20).the(Illness.ECHO_MISSING)


@pytest.mark.parametrize("answers", [False, True])
@pytest.mark.parametrize("unit", [2, 17])
def test_a_foreign_master(unit: int, answers: bool) -> None:
    """It asks a drive of ours, or one that we do not know, every 700 ms."""
    bench = line_of(3, period=1.0)
    ward = Ward(bench).watch(5)
    ward.fault()
    request = frame(bytes((unit, 3, 0, 0x20, 0, 3)))
    reply = frame(bytes((unit, 3, 6, 0, 1, 0, 2, 0, 3)))
    for n in range(30):
        bench.receive(request, bench.now + 0.5 + 0.7 * n)
        if answers:
            bench.receive(reply, bench.now + 0.53 + 0.7 * n)
    found = ward.watch(15).the(Illness.FOREIGN_MASTER)
    assert found.units == (unit,)


def grid(period: float, phase: float = 0.0037) -> Callable[[float], float]:
    return lambda at: math.ceil((at - phase) / period) * period + phase


@pytest.mark.parametrize("units", [1, 4])
def test_a_latency_timer_that_runs_all_the_time(units: int) -> None:
    bench = line_of(units)
    ward = Ward(bench).watch(5)
    ward.fault()
    bench.arrives = grid(0.016)
    ward.watch(15).the(Illness.LATENCY_TIMER)


def test_a_latency_timer_that_begins_with_the_request() -> None:
    bench = line_of(3)
    ward = Ward(bench).watch(5)
    ward.fault()

    def arrives(at: float) -> float:
        asked = max(when for when, sent, _ in bench.wire if sent)
        return asked + math.ceil((at - asked) / 0.016) * 0.016

    bench.arrives = arrives
    ward.watch(15).the(Illness.LATENCY_TIMER)


def of_one_length(units: int, period: float, delay: float = 0.005) -> Bench:
    numbers = range(1, units + 1)
    bench = Bench([facts(unit) for unit in numbers], [FakeUnit(unit, delay=delay) for unit in numbers])
    bench.quiet = False
    return bench.start(*(Want(unit, 0x27, 5, period) for unit in numbers))


@pytest.mark.parametrize(
    ("units", "period"), [(1, 0.1), (1, 0.2), (1, 0.3), (2, 0.1), (2, 0.3), (4, 0.2), (4, 0.3)]
)
def test_a_latency_timer_where_all_replies_are_of_one_length(units: int, period: float) -> None:
    bench = of_one_length(units, period)
    ward = Ward(bench).watch(5)
    ward.fault()
    bench.arrives = grid(0.016)
    ward.watch(25)
    assert ward.told == {Illness.LATENCY_TIMER}


@pytest.mark.parametrize("units", [1, 3])
@pytest.mark.parametrize("period", [0.016, 0.05, 0.08, 0.1, 0.2, 0.25, 0.3, 0.4, 1.0])
def test_replies_of_one_length_on_a_sound_line_are_on_no_grid(units: int, period: float) -> None:
    for step in range(8):
        assert not Ward(of_one_length(units, period, 0.004 + 0.0021 * step)).watch(30).first


@pytest.mark.parametrize("period", [0.016, 0.08, 0.4])
def test_a_sound_line_in_step_with_the_grid_has_no_latency_timer(period: float) -> None:
    """Each drive takes a time of its own, and everything comes again after multiples of 16 ms."""
    bench = line_of(4, period=period)
    for number, fake in enumerate(bench.fakes.values()):
        fake.delay = 0.004 + 0.005 * number
    assert not Ward(bench).watch(40).first


def test_drives_that_are_slow_by_nature_have_no_latency_timer() -> None:
    bench = line_of(4)
    everybody(bench, delay=0.0165)
    assert not Ward(bench).watch(30).first


def test_late_answers_are_no_foreign_master_and_no_twin() -> None:
    bench = line_of(3)
    draw = seeded(5)
    bench.fakes[2].late = lambda: 0.4 if draw.random() < 0.2 else 0.0
    ward = Ward(bench).watch(30)
    assert ward.told <= {Illness.DRIVE_SILENT}


# -- figures


def test_figures_of_a_unit() -> None:
    bench = line_of(2, delay=0.012)
    bench.fakes[2].refuse = {3: 6}
    Ward(bench).watch(30)
    doctor, now = bench.line.doctor, bench.now
    good, bad = doctor.units[1], doctor.units[2]
    assert good.traffic.requests - 1 <= good.traffic.answered <= good.traffic.requests
    assert good.traffic.answered > 100
    assert good.turnaround.share(0.5, now) == pytest.approx(0.012, rel=0.05)
    assert good.turnaround.share(0.95, now) == pytest.approx(0.012, rel=0.05)
    assert good.turnaround.share(1.0, now) == pytest.approx(0.012, rel=0.01)
    assert good.jitter < 0.0001
    assert 0.2 < good.share.get(now) <= 1.0
    assert bad.codes == {6: bad.traffic.refused}
    assert good.traffic.sent_bytes == 8 * good.traffic.requests


def test_figures_of_silence() -> None:
    bench = line_of(2)
    Ward(bench).watch(5)
    bench.fakes[2].on = False
    Ward(bench).watch(30)
    figures = bench.line.doctor.units[2]
    assert figures.traffic.timeouts >= 4
    assert figures.traffic.retries >= 2
    assert figures.traffic.probes >= 3
    age = bench.line.doctor.units[1].age.get(bench.now)
    assert age is not None
    assert age < 2.0
    before = figures.age.get(bench.now)
    bench.fakes[2].on = True
    Ward(bench).watch(10)
    assert figures.age.get(bench.now) == pytest.approx(before)  # nobody promised anything while it was down
