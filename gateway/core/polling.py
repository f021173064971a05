"""From demands to reads, and from registers to samples. Pure.

Turns what clients want of tags into what each line has to read, and what the lines bring into samples
with quality, time and promised age.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from gateway.core.demands import Demands
from gateway.core.drive import Drive, depends_on, is_polled
from gateway.core.meaning import Meaningless, meaning_of
from gateway.core.store import STALE_PERIODS, Store
from gateway.line.interface import Block, BlockFailed, BlockRead, Plan, Refused, Want
from gateway.mapping.profile import Point
from gateway.modbus.encoding import decode
from gateway.tag import Instant, Quality, Sample, split_tag

FASTEST = 0.01
"""Seconds; nobody gets a shorter period, whatever he asks."""

AGE_CHECK_SECONDS = 0.1


class Polling:
    """The samples of all drives. ``publish`` is called with the samples of one transaction, or of one
    change of state, whenever there are any."""

    def __init__(
        self, drives: Sequence[Drive], rates: dict[str, float], publish: Callable[[list[Sample]], None]
    ) -> None:
        self.demands = Demands()
        self.store = Store()
        self._drives = {drive.name: drive for drive in drives}
        self._rates = rates
        self._publish = publish
        self._promised: dict[str, tuple[float, float]] = {}
        self._next_check = 0.0

    def point(self, tag: str) -> tuple[Drive, Point] | None:
        """Drive and point of a tag, None when there is none that can be read."""
        drive_name, point_name = split_tag(tag)
        drive = self._drives.get(drive_name)
        point = drive.profile.points.get(point_name) if drive else None
        return (drive, point) if drive is not None and point is not None and is_polled(point) else None

    def wants(self, line: str) -> list[Want]:
        """What a line has to read for the present demands. Points that share registers are one want."""
        periods: dict[tuple[int, int, int], float] = {}
        for drive in self._drives_on(line):
            for tag, wanted in self.demands.tags_of(drive.name):
                for point, period in self._with_deciders(tag, wanted):
                    if not point.select:
                        registers = drive.unit, point.address, point.words
                        periods[registers] = min(period, periods.get(registers, period))
        return [
            Want(unit, address, count, max(period, FASTEST), self._rank(period))
            for (unit, address, count), period in periods.items()
        ]

    def lines_of(self, tags: Iterable[str]) -> list[str]:
        """The lines on which these tags are, each once."""
        found = (self.point(tag) for tag in tags)
        return list(dict.fromkeys(one[0].line for one in found if one is not None))

    def _drives_on(self, line: str) -> Iterator[Drive]:
        return (drive for drive in self._drives.values() if drive.line == line)

    def _with_deciders(self, tag: str, period: float) -> Iterator[tuple[Point, float]]:
        """A wanted point, and the points that decide what it means: as often, but no more than normal."""
        found = self.point(tag)
        if found is None:
            return
        drive, point = found
        yield point, period
        for name in depends_on(point):
            if name not in drive.config.settings:
                yield from self._with_deciders(drive.tag(name), max(period, self._rates["normal"]))

    def _rank(self, period: float) -> int:
        """0 for periods of the fast class, which stretch last; 1 for normal, 2 for slower ones."""
        if period <= self._rates["fast"]:
            return 0
        return 1 if period <= self._rates["normal"] else 2

    def plan_changed(self, line: str, plan: Plan) -> dict[str, float]:
        """Take over a line's new plan; the periods that changed, by tag."""
        changed = {}
        for drive in self._drives_on(line):
            blocks = [block for block in plan.blocks if block.unit == drive.unit]
            for tag, _ in self.demands.tags_of(drive.name):
                found = self.point(tag)
                promise = None if found is None else _promise(blocks, found[1])
                if promise is not None and self._promised.get(tag) != promise:
                    self._promised[tag] = promise
                    changed[tag] = promise[0]
        return changed

    def promise(self, tag: str, period: float, age: float) -> None:
        """Promise a period and an age (seconds) for a tag that is read outside the plan."""
        self._promised[tag] = (period, age)

    def tell(self, sample: Sample, at: float) -> None:
        """Keep and publish a sample that came from elsewhere, unless it says what is known already."""
        held = self.store.get(sample.tag)
        if held is None or (held.sample.quality, held.sample.reason) != (sample.quality, sample.reason):
            self.store.put(sample, at)
            self._publish([sample])

    def period(self, tag: str) -> float | None:
        """The period in seconds at which a tag is read."""
        promise = self._promised.get(tag)
        return promise[0] if promise else None

    def read(self, drive: Drive, block: BlockRead, now: Instant) -> None:
        """Registers were read: decode the points in them, those that others lean on first."""
        time = wall_of(block.at, now)
        samples = []
        for point in drive.points_in(block.address, len(block.words)):
            start = point.address - block.address
            sample = self._sample(drive, point, block.words[start : start + point.words], time)
            self.store.put(sample, block.at)
            samples.append(sample)
        self._publish(samples)

    def take(self, drive: Drive, point: Point, words: Sequence[int], at: float, now: Instant) -> Sample:
        """One point's registers were read by themselves."""
        sample = self._sample(drive, point, words, wall_of(at, now))
        self.store.put(sample, at)
        self._publish([sample])
        return sample

    def _sample(self, drive: Drive, point: Point, words: Sequence[int], time: int) -> Sample:
        tag = drive.tag(point.name)
        age = self._promised.get(tag, (0.0, 0.0))[1]
        meaning = meaning_of(drive, self.store, point)
        if isinstance(meaning, Meaningless):
            return Sample(tag, None, meaning.quality, time, age, None, meaning.reason)
        decoded = decode(meaning.encoding, words, meaning.times)
        if decoded.special is not None or decoded.value is None:
            reason = decoded.special or "cannot be decoded"
            return Sample(tag, None, Quality.INVALID, time, age, decoded.special, reason)
        return Sample(tag, decoded.value, Quality.GOOD, time, age, decoded.text)

    def failed(self, drive: Drive, block: BlockFailed, now: Instant) -> None:
        """A planned read failed. A refusal says something about the points, one silence does not."""
        if not isinstance(block.result, Refused):
            return
        meaning = drive.profile.errors.get(block.result.code)
        name = f" {meaning.name}" if meaning else ""
        reason = f"the drive answers {block.result.code:02X}H{name}"
        self._mark(drive, drive.points_in(block.address, block.count), Quality.REFUSED, reason, block.at, now)

    def lost(self, drive: Drive, quality: Quality, reason: str, now: Instant) -> None:
        """The drive or its line is gone: every tag of it that anybody saw or wants says so."""
        points = [point for point in drive.profile.points.values() if is_polled(point)]
        self._mark(drive, points, quality, reason, now.mono, now)

    def restored(self, drive: Drive) -> None:
        """The drive answers again: what nobody watches is simply not known any more."""
        for point in drive.profile.points.values():
            if self.demands.period(drive.tag(point.name)) is None:
                self.store.drop(drive.tag(point.name))

    def first_sample(self, tag: str, now: Instant) -> Sample:
        """What a new watcher of a tag is told at once; a value from before anybody watched is not
        passed off as the present one."""
        held = self.store.get(tag)
        usable = held is not None and held.sample.quality in (Quality.GOOD, Quality.STALE)
        if held is not None and usable and now.mono - held.at > STALE_PERIODS * (self.period(tag) or 0.0):
            self.store.drop(tag)
        return self.store.sample(tag, now.wall)

    def _mark(
        self, drive: Drive, points: Iterable[Point], quality: Quality, reason: str, at: float, now: Instant
    ) -> None:
        samples = []
        for point in points:
            sample = Sample(drive.tag(point.name), None, quality, wall_of(at, now), 0.0, None, reason)
            held = self.store.get(sample.tag)
            if held is None or (held.sample.quality, held.sample.reason) != (quality, reason):
                self.store.put(sample, at)
                samples.append(sample)
        if samples:
            self._publish(samples)

    def check_ages(self, now: Instant) -> None:
        """Let watched samples that are older than promised say so."""
        if now.mono < self._next_check:
            return
        self._next_check = now.mono + AGE_CHECK_SECONDS
        aged = []
        for tag, _ in self.demands.tags():
            period = self.period(tag)
            sample = self.store.aged(tag, period, now.mono, now.wall) if period else None
            if sample is not None:
                aged.append(sample)
        if aged:
            self._publish(aged)

    def next_check(self) -> float:
        """When `check_ages` is next due (monotonic)."""
        return self._next_check


def _promise(blocks: Iterable[Block], point: Point) -> tuple[float, float] | None:
    """Period and worst-case age that the blocks of a drive hold for a point."""
    covering = [
        (block.period, block.worst_age)
        for block in blocks
        if block.address <= point.address and point.address + point.words <= block.address + block.count
    ]
    return min(covering, default=None)


def wall_of(at: float, now: Instant) -> int:
    """The wall-clock time of a monotonic instant in the recent past."""
    return now.wall - round((now.mono - at) * 1e9)
