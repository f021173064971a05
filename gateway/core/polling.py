"""From demands to reads, and from registers to samples. Pure.

Turns what clients want of tags into what each line has to read, and what the lines bring into samples
with quality, time and promised age.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from gateway.core.ages import Ages, Group
from gateway.core.demands import Demands
from gateway.core.drive import Drive, depends_on, is_polled
from gateway.core.readout import Reading, Readout, reading_of
from gateway.core.refusals import refusal
from gateway.core.store import STALE_PERIODS, Store
from gateway.line.interface import Block, BlockFailed, BlockRead, Plan, Refused, Want
from gateway.mapping.profile import Point
from gateway.mapping.site import SHORTEST
from gateway.tag import Instant, Quality, Sample, split_tag

FASTEST = SHORTEST
"""Seconds; nobody gets a shorter period, whatever he asks."""

AGE_CHECK_SECONDS = 0.1

_NOTHING = (0.0, 0.0)


class Polling:
    """The samples of all drives. ``publish`` is called with the samples of one transaction, or of one
    change of state, whenever there are any."""

    def __init__(
        self, drives: Sequence[Drive], rates: dict[str, float], publish: Callable[[list[Sample]], None]
    ) -> None:
        self.demands = Demands()
        self.store = Store()
        self._drives = {drive.name: drive for drive in drives}
        self.rates = rates
        self._publish = publish
        self._readouts = {drive.name: Readout(drive, self.store) for drive in drives}
        self._ages = Ages()
        self._promised: dict[str, tuple[float, float]] = {}
        self._left_out: dict[str, str] = {}
        """Tags whose registers the drive has not, and how it says so."""
        self._apart: dict[str, None] = {}
        """Tags that are read outside the plan."""
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
                    if not point.select and drive.tag(point.name) not in self._left_out:
                        registers = drive.unit, point.address, point.words
                        periods[registers] = min(period, periods.get(registers, period))
        return [
            Want(unit, address, count, max(period, FASTEST), self._rank(period))
            for (unit, address, count), period in periods.items()
        ]

    def leave_out(self, drive: Drive, reasons: Mapping[str, str], now: Instant) -> None:
        """Read these points of a drive no more, and all others; ``reasons`` say why, by point."""
        for tag in [tag for tag in self._left_out if split_tag(tag)[0] == drive.name]:
            del self._left_out[tag]
        for name, reason in reasons.items():
            self._left_out[drive.tag(name)] = reason
            self._mark(drive, [drive.profile.points[name]], Quality.REFUSED, reason, now.mono, now)

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
                yield from self._with_deciders(drive.tag(name), max(period, self.rates["normal"]))

    def _rank(self, period: float) -> int:
        """0 for periods of the fast class, which stretch last; 1 for normal, 2 for slower ones."""
        if period <= self.rates["fast"]:
            return 0
        return 1 if period <= self.rates["normal"] else 2

    def plan_changed(self, line: str, plan: Plan, now: float) -> dict[str, float]:
        """Take over a line's new plan; the periods that changed, by tag."""
        changed: dict[str, float] = {}
        for drive in self._drives_on(line):
            blocks = [block for block in plan.blocks if block.unit == drive.unit]
            groups: dict[tuple[int, int], Group] = {}
            for tag, _ in self.demands.tags_of(drive.name):
                found = self.point(tag)
                block = None if found is None else _bringing(blocks, found[1])
                if block is not None:
                    self._join(groups, block, tag, now)
                    changed.update(self._new_promise(tag, block.period, block.worst_age))
            self._ages.plan(drive.name, groups)
        return changed

    def _join(self, groups: dict[tuple[int, int], Group], block: Block, tag: str, now: float) -> None:
        held = self.store.get(tag)
        group = groups.setdefault((block.address, block.count), Group(block.period, now))
        group.at = min(group.at, now if held is None else held.at)
        group.tags.append(tag)

    def _new_promise(self, tag: str, period: float, age: float) -> dict[str, float]:
        """The tag and its period if that is new."""
        if self._promised.get(tag) == (period, age):
            return {}
        self._promised[tag] = (period, age)
        return {tag: period}

    def promise(self, tag: str, period: float, age: float) -> None:
        """Promise a period and an age (seconds) for a tag that is read outside the plan."""
        self._promised[tag] = (period, age)
        self._apart[tag] = None

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
        count = len(block.words)
        readout, samples = self._readouts[drive.name], []
        for slot in readout.slots(block.address, count):
            if self.store.knows_later(slot.tag, block.at):
                continue  # known since then, and seen by another read meanwhile
            reading = readout.reading(slot, block.words[slot.start : slot.end])
            sample = self._sample(slot.tag, reading, time)
            if drive.doubt:
                sample = doubted(drive, slot.point, sample)
            self.store.put(sample, block.at)
            samples.append(sample)
        self._ages.came(drive.name, block.address, count, block.at)
        if block.at < now.mono - AGE_CHECK_SECONDS:
            self._ages.older({sample.tag for sample in samples}, block.at)
        self._publish(samples)

    def take(self, drive: Drive, point: Point, words: Sequence[int], at: float, now: Instant) -> Sample:
        """One point's registers were read by themselves."""
        reading = reading_of(drive, self.store, point, words)
        sample = doubted(drive, point, self._sample(drive.tag(point.name), reading, wall_of(at, now)))
        self.store.put(sample, at)
        self._ages.older({sample.tag}, at)
        self._publish([sample])
        return sample

    def _sample(self, tag: str, reading: Reading, time: int) -> Sample:
        value, quality, text, reason = reading
        return Sample(tag, value, quality, time, self._promised.get(tag, _NOTHING)[1], text, reason)

    def failed(self, drive: Drive, block: BlockFailed, now: Instant) -> None:
        """A planned read failed. A refusal says something about the points, one silence does not."""
        if not isinstance(block.result, Refused):
            return
        reason = refusal(drive, block.result.code)
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
        passed off as the present one, and who watches already is told that it is not."""
        held, period = self.store.get(tag), self.period(tag) or 0.0
        usable = held is not None and held.sample.quality in (Quality.GOOD, Quality.STALE)
        if held is not None and usable and now.mono - held.at > STALE_PERIODS * period:
            if len(self.demands.sessions(tag)) < 2:
                self.store.drop(tag)
            elif (aged := self.store.aged(tag, period, now.mono, now.wall)) is not None:
                self._publish([aged])
        if self.store.get(tag) is None and (reason := self._left_out.get(tag)):
            return Sample(tag, None, Quality.REFUSED, now.wall, 0.0, None, reason)
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
        for tag in (*self._ages.late(now.mono), *self._watched_apart()):
            period = self.period(tag)
            sample = self.store.aged(tag, period, now.mono, now.wall) if period else None
            if sample is not None:
                aged.append(sample)
        if aged:
            self._publish(aged)

    def _watched_apart(self) -> Iterator[str]:
        return (tag for tag in self._apart if self.demands.period(tag) is not None)

    def next_check(self) -> float:
        """When `check_ages` is next due (monotonic)."""
        return self._next_check


def _bringing(blocks: Iterable[Block], point: Point) -> Block | None:
    """The block of a drive that brings a point, the fastest if there are more."""
    covering = [
        block
        for block in blocks
        if block.address <= point.address and point.address + point.words <= block.address + block.count
    ]
    return min(covering, key=lambda block: (block.period, block.worst_age), default=None)


def doubted(drive: Drive, point: Point, sample: Sample) -> Sample:
    """S4: while it is not known whether the drive is of its model, its registers mean nothing; but for those
    that tell."""
    if not drive.doubt or any(term.name == point.name for term in drive.profile.modbus.identity):
        return sample
    return Sample(sample.tag, None, Quality.CONFIGURATION, sample.time, sample.age, None, drive.doubt)


def wall_of(at: float, now: Instant) -> int:
    """The wall-clock time of a monotonic instant in the recent past."""
    return now.wall - round((now.mono - at) * 1e9)
