"""Reads on request: values that are wanted once, and fresh. Pure."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from gateway.core.drive import Drive, depends_on
from gateway.core.own import OwnTags
from gateway.core.polling import Polling
from gateway.core.procedure import READ_AGAIN
from gateway.core.refusals import address_codes, apart, refusal
from gateway.line.interface import Answered, Read, Refused, Result, Silent, Unsent
from gateway.mapping.profile import Point
from gateway.tag import Instant, Quality, Sample

READ_SECONDS = 5.0
"""Time that a read on request may wait for the line."""

AskLine = Callable[[str, Read, float], int]
ReadSelected = Callable[[str, Instant, Callable[[Sample], None]], None]
Reply = Callable[[tuple[Sample, ...]], None]


@dataclass(slots=True)
class Pending:
    """A request whose values are on their way; ``told`` holds the samples of tags that failed, and of the
    gateway's own."""

    tags: tuple[str, ...]
    reply: Reply
    jobs: set[int] = field(default_factory=set)
    told: dict[str, Sample] = field(default_factory=dict)
    starting: bool = True


@dataclass(frozen=True, slots=True)
class Asked:
    """A read under way for some points of a request. A read without an answer is asked again; one that holds
    a register that the drive has not is taken apart."""

    pending: Pending
    drive: Drive
    points: tuple[Point, ...]
    request: Read
    deadline: float
    tries: int = 0


class Reads:
    """All reads on request that are under way."""

    def __init__(
        self,
        polling: Polling,
        own: OwnTags,
        is_down: Callable[[Drive], bool],
        ask_line: AskLine,
        read_selected: ReadSelected,
    ) -> None:
        self._polling = polling
        self._own = own
        self._is_down = is_down
        self._ask_line = ask_line
        self._read_selected = read_selected
        self._last_selected = 0
        self._pending: list[Pending] = []
        self._jobs: dict[int, Asked] = {}

    def start(self, tags: Sequence[str], max_age: float, reply: Reply, now: Instant) -> None:
        """Answer with a sample per tag: from the store where it is young enough, else from the drive."""
        pending = Pending(tuple(tags), reply)
        wanted: dict[str, tuple[Drive, list[Point]]] = {}
        for tag in dict.fromkeys(tags):
            found = self._polling.point(tag)
            if (own := self._own.sample(tag, now)) is not None:
                pending.told[tag] = own
            elif found is None:
                reason = "no such tag, or it cannot be read"
                pending.told[tag] = Sample(tag, None, Quality.CONFIGURATION, now.wall, 0.0, None, reason)
            elif self._young(tag, max_age, now):
                continue
            elif self._is_down(found[0]):
                reason = f"{found[0].name} does not answer"
                pending.told[tag] = Sample(tag, None, Quality.NO_COMMUNICATION, now.wall, 0.0, None, reason)
            elif found[1].select:
                self._ask_selected(pending, tag, now)
            else:
                wanted.setdefault(found[0].name, (found[0], []))[1].append(found[1])
        for drive, points in wanted.values():
            self._ask(pending, drive, deciders(drive, points), now)
            self._ask(pending, drive, points, now)
        pending.starting = False
        self._answer_if_complete(pending, now)

    def job_done(self, job: int, result: Result, at: float, now: Instant) -> None:
        """What became of a read; the values of an answered one are in the store already."""
        asked = self._jobs.pop(job)
        asked.pending.jobs.discard(job)
        if isinstance(result, Silent) and asked.tries < READ_AGAIN:
            self._ask_line_for(dataclasses.replace(asked, tries=asked.tries + 1), now)
            return
        if isinstance(result, Refused) and (parts := _halves(asked, result.code)):
            for points in parts:
                self._ask(asked.pending, asked.drive, points, now)
            return
        if not isinstance(result, Answered):
            quality, reason = _quality(asked.drive, result)
            for point in asked.points:
                tag = asked.drive.tag(point.name)
                asked.pending.told[tag] = Sample(tag, None, quality, now.wall, 0.0, None, reason)
        self._answer_if_complete(asked.pending, now)

    def _young(self, tag: str, max_age: float, now: Instant) -> bool:
        held = self._polling.store.get(tag)
        return held is not None and held.sample.quality is Quality.GOOD and now.mono - held.at <= max_age

    def _ask(self, pending: Pending, drive: Drive, points: Iterable[Point], now: Instant) -> None:
        points = tuple(points)
        for address, count in spans(points, drive.facts.read_max):
            inside = tuple(p for p in points if address <= p.address < address + count)
            request = Read(drive.unit, address, count)
            self._ask_line_for(Asked(pending, drive, inside, request, now.mono + READ_SECONDS), now)

    def _ask_line_for(self, asked: Asked, now: Instant) -> None:
        job = self._ask_line(asked.drive.line, asked.request, asked.deadline)
        self._jobs[job] = asked
        asked.pending.jobs.add(job)

    def _ask_selected(self, pending: Pending, tag: str, now: Instant) -> None:
        self._last_selected -= 1
        turn = self._last_selected
        pending.jobs.add(turn)

        def done(sample: Sample) -> None:
            if sample.quality is not Quality.GOOD:
                pending.told[tag] = sample
            pending.jobs.discard(turn)
            if not pending.starting:
                self._answer_if_complete(pending, now)

        self._read_selected(tag, now, done)

    def _answer_if_complete(self, pending: Pending, now: Instant) -> None:
        if not pending.jobs:
            store = self._polling.store
            pending.reply(tuple(pending.told.get(tag) or store.sample(tag, now.wall) for tag in pending.tags))


def deciders(drive: Drive, points: Iterable[Point]) -> list[Point]:
    """The points that decide what these mean, those that decide first in front."""
    found: dict[str, Point] = {}
    for point in points:
        others = [drive.profile.points[name] for name in depends_on(point) if name in drive.profile.points]
        for other in [*deciders(drive, others), *others]:
            found.setdefault(other.name, other)
    return list(found.values())


def spans(points: Iterable[Point], longest: int) -> list[tuple[int, int]]:
    """Address and count of the reads that bring these points: touching registers together, no gaps."""
    found: list[tuple[int, int]] = []
    for point in sorted(points, key=lambda point: (point.address, point.words)):
        end = point.address + point.words
        if found:
            address, count = found[-1]
            if point.address <= address + count and end - address <= longest:
                found[-1] = (address, max(count, end - address))
                continue
        found.append((point.address, point.words))
    return found


def _halves(asked: Asked, code: int) -> list[list[Point]]:
    """What to read instead where the drive says that it has not all of these registers; none where they
    cannot be told apart."""
    pieces = apart(asked.points) if code in address_codes(asked.drive.profile) else []
    middle = len(pieces) // 2
    halves = pieces[:middle], pieces[middle:]
    return [[point for piece in half for point in piece] for half in halves] if middle else []


def _quality(drive: Drive, result: Result) -> tuple[Quality, str]:
    match result:
        case Refused(code):
            return Quality.REFUSED, refusal(drive, code)
        case Unsent("line_down"):
            return Quality.LINE_DOWN, "the line is down"
        case Unsent():
            return Quality.NO_COMMUNICATION, f"no answer within {READ_SECONDS:g} s"
        case _:
            return Quality.NO_COMMUNICATION, "the drive does not answer"
