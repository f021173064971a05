"""Lines go first: what was read is looked at when no line is due, and in its order."""

from __future__ import annotations

from gateway.bridge.api import Batch, DriveState
from gateway.bridge.messages import ReadTags, Samples, Watch
from gateway.core.core import Core
from gateway.core.events import Asked, Event, Joined, PortOpened, Received, Started, Tell, Ticked, Transmit
from gateway.tag import Instant, Quality, Role, Sample
from tests.core.world import make_site
from tests.line.bench import FakeUnit

FREQUENCY = "fan-1.output_frequency"


class Bench:
    """A core whose events and times the test gives one by one."""

    def __init__(self) -> None:
        self.core = Core(make_site(), "test")
        self.unit = FakeUnit(registers={0x24: 5000})
        self.now = self.heard_at = 1.0
        self.sent: list[bytes] = []
        self.told: list[object] = []
        for event in (Started(), PortOpened("north"), Joined(1, "client", Role.ADMIN)):
            self.feed(event)
        self.feed(Asked(1, Watch(1, {FREQUENCY: 0.05})))

    def feed(self, event: Event) -> None:
        for action in self.core.step(event, Instant(self.now, round(self.now * 1e9))):
            if isinstance(action, Transmit):
                self.sent.append(action.data)
            elif isinstance(action, Tell):
                self.told.append(action.message)

    def tick(self) -> None:
        """Let the core wake when it wants to."""
        wake = self.core.wake()
        assert wake is not None
        self.now = max(self.now, wake)
        self.feed(Ticked())

    def until_sent(self) -> None:
        before = len(self.sent)
        while len(self.sent) == before:
            self.tick()

    def reply(self, after: float = 0.03) -> None:
        self.now += after
        self.heard_at = self.now
        answer = self.unit.answer(self.sent[-1])
        assert answer is not None
        self.feed(Received("north", answer))
        end = self.now + 0.002  # the silence that ends a frame
        while not self.core._aftermath.waits and (self.core.wake() or end) < end:
            self.tick()

    def samples(self) -> list[Sample]:
        batches = [message for message in self.told if isinstance(message, Batch)]
        return [s for batch in batches for s in batch.samples if s.quality is Quality.GOOD]

    def until_read(self) -> None:
        """Until the frequency was read, the drive being known, and its reply is the last that happened."""
        for _ in range(6):
            self.until_sent()
            self.reply()
        while not self.sent[-1][3] <= 0x24 < self.sent[-1][3] + self.sent[-1][5]:
            self.until_sent()
            self.reply()
        self.told.clear()


def test_what_was_read_is_looked_at_at_once_when_nothing_is_due() -> None:
    bench = Bench()
    bench.until_read()
    assert bench.core.wake() == bench.now
    bench.tick()
    last = bench.samples()[-1]
    assert (last.tag, last.value, last.time) == (FREQUENCY, 50.0, round(bench.heard_at * 1e9))


def test_a_line_that_is_due_goes_first() -> None:
    bench = Bench()
    bench.until_read()
    read_at, requests = bench.heard_at, len(bench.sent)
    bench.now += 0.1
    bench.feed(Ticked())
    assert len(bench.sent) == requests + 1
    assert [s for s in bench.samples() if s.tag == FREQUENCY] == []
    bench.tick()
    assert bench.samples()[-1].time == round(read_at * 1e9)


def test_what_was_read_before_is_looked_at_before_a_job_is_told() -> None:
    bench = Bench()
    bench.until_read()
    bench.feed(Asked(1, ReadTags(2, (FREQUENCY,), 0.0)))
    bench.unit.registers[0x24] = 1234
    answers: list[Samples] = []
    while not answers:
        bench.now += 0.1  # a line that is always due: nobody has the time to look at what it read
        bench.feed(Ticked())
        bench.reply()
        answers = [message for message in bench.told if isinstance(message, Samples)]
    told = [s for s in bench.samples() if s.tag == FREQUENCY]
    assert (told[0].value, told[-1].value) == (50.0, 12.34)
    assert [s.time for s in told] == sorted(s.time for s in told)
    assert [answer.samples[0].value for answer in answers] == [12.34]


def test_what_was_read_before_a_drive_was_lost_does_not_bring_it_back() -> None:
    bench = Bench()
    bench.until_read()
    bench.unit.on = False
    while not any(isinstance(message, DriveState) and not message.up for message in bench.told):
        bench.now += 0.5
        bench.feed(Ticked())
    while bench.core.wake() == bench.now:
        bench.tick()
    batches = [message for message in bench.told if isinstance(message, Batch)]
    told = [s for batch in batches for s in batch.samples if s.tag == FREQUENCY]
    assert [s.quality for s in told] == [Quality.GOOD, Quality.NO_COMMUNICATION]
