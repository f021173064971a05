"""From a plan and registers to samples, and what becomes of them when reads do not come."""

from __future__ import annotations

from gateway.core.drive import Drive
from gateway.core.polling import Polling
from gateway.core.readout import Readout
from gateway.core.store import Store
from gateway.line.interface import Block, BlockRead, Plan
from gateway.tag import Instant, Quality, Sample
from tests.core.world import make_site

UNIT = 5
STATUS, FREQUENCY = 0x20, 0x24
"""inverter_status, output_frequency."""


def at(mono: float) -> Instant:
    return Instant(mono, round(mono * 1e9))


class Bench:
    """A drive whose registers 0020H to 0024H are read every second."""

    def __init__(self) -> None:
        self.drive = Drive(make_site().drives[0])
        self.told: list[Sample] = []
        self.polling = Polling([self.drive], {"fast": 0.2, "normal": 1.0}, self.told.extend)

    def watch(self, point: str, now: float) -> None:
        self.polling.demands.change(1, {self.drive.tag(point): 1.0})
        self.polling.plan_changed("north", Plan((Block(UNIT, STATUS, 5, 1.0, 0.04, 1.5),)), now)

    def read(self, now: float, *words: int, address: int = STATUS) -> None:
        self.polling.read(self.drive, BlockRead(UNIT, address, words, now), at(now))

    def check(self, now: float) -> list[tuple[str, Quality]]:
        """What an age check at that time tells."""
        self.told.clear()
        self.polling.check_ages(at(now))
        return [(sample.tag.partition(".")[2], sample.quality) for sample in self.told]


def test_the_age_of_what_is_read_in_time_is_nobodys_business() -> None:
    bench = Bench()
    bench.watch("output_frequency", 0.0)
    for second in range(10):
        bench.read(second, 0, 0, 0, 0, 5000)
        assert bench.check(second + 0.9) == []


def test_h17_a_read_that_does_not_come_makes_its_watched_tags_stale_and_then_bad() -> None:
    bench = Bench()
    bench.watch("output_frequency", 0.0)
    bench.read(0.0, 0, 0, 0, 0, 5000)
    assert bench.check(2.0) == []
    assert bench.check(2.2) == [("output_frequency", Quality.STALE)]
    assert bench.check(5.2) == [("output_frequency", Quality.NO_COMMUNICATION)]
    bench.read(6.0, 0, 0, 0, 0, 5000)
    assert bench.polling.store.sample("fan-1.output_frequency", 0).quality is Quality.GOOD


def test_a_tag_that_joins_a_read_has_its_own_age() -> None:
    bench = Bench()
    bench.read(0.0, 5000, address=FREQUENCY)
    bench.watch("output_frequency", 1.9)
    assert bench.check(2.2) == [("output_frequency", Quality.STALE)]


def test_a_read_of_the_tag_alone_counts_for_its_age() -> None:
    bench = Bench()
    bench.watch("output_frequency", 0.0)
    bench.read(0.0, 0, 0, 0, 0, 5000)
    bench.read(1.5, 5000, address=FREQUENCY)
    assert bench.check(3.0) == []
    assert bench.check(3.6) == [("output_frequency", Quality.STALE)]


def test_the_same_words_again_are_a_new_sample() -> None:
    bench = Bench()
    for second in (1.0, 2.0):
        bench.read(second, 5000, address=FREQUENCY)
    assert [(sample.value, sample.time) for sample in bench.told] == [(50.0, 10**9), (50.0, 2 * 10**9)]


def test_other_words_are_another_value() -> None:
    bench = Bench()
    for word in (5000, 5001, 5000):
        bench.read(1.0, word, address=FREQUENCY)
    assert [sample.value for sample in bench.told] == [50.0, 50.01, 50.0]


def test_what_depends_on_another_point_is_decoded_anew_although_its_words_are_the_same() -> None:
    store, drive = Store(), Drive(make_site().drives[0])
    readout = Readout(drive, store)
    address = drive.profile.points["overtorque_measure"].address
    (slot,) = (s for s in readout.slots(address, 1) if s.point.name == "overtorque_measure")
    seen = []
    for mode in (0, 1):
        store.put(Sample(drive.tag("control_mode"), mode, Quality.GOOD, 1), 1.0)
        seen.append(readout.reading(slot, (0b1000,)).quality)
    assert seen == [Quality.NOT_APPLICABLE, Quality.GOOD]
