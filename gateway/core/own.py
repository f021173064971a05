"""The gateway's own tags: what it tells of itself, of its lines, of its dealings with drives. Pure.

They are watched and read like the tags of drives, but no read brings them: whoever knows a value registers a
function that tells it, and it is asked when somebody wants to know.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from gateway.bridge.api import DIAGNOSTIC, PointInfo
from gateway.core.demands import Demands
from gateway.mapping.own import OwnPoint
from gateway.tag import Instant, Quality, Sample, Value, split_tag

SHORTEST = 1.0
"""Seconds; nobody gets such a tag more often, except when something calls for telling it at once."""

Tell = Callable[[float], Value]
"""The present value, given the monotonic time; None while there is none."""


@dataclass(slots=True)
class _Owner:
    """A drive, a line or the gateway, and the values that are told of it."""

    name: str
    place: int
    points: dict[str, OwnPoint] = field(default_factory=dict)
    values: dict[str, Tell] = field(default_factory=dict)
    due: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Tags that are watched: when each is next told, and how often."""


class OwnTags:
    """All of them. ``publish`` is called with the samples of one owner."""

    def __init__(self, demands: Demands, publish: Callable[[list[Sample]], None]) -> None:
        self._demands = demands
        self._publish = publish
        self._owners: dict[str, _Owner] = {}
        self._queue: list[tuple[float, str]] = []

    def register(self, owner: str, points: Mapping[str, OwnPoint], values: Mapping[str, Tell]) -> None:
        """Add points to an owner, and how to learn the value of each."""
        known = self._owners.setdefault(owner, _Owner(owner, len(self._owners)))
        known.points.update(points)
        known.values.update({name: values[name] for name in points})

    def infos(self, owner: str) -> tuple[PointInfo, ...]:
        """The points of an owner, for the catalogue."""
        known = self._owners.get(owner)
        return () if known is None else tuple(_info(point) for point in known.points.values())

    def knows(self, tag: str) -> bool:
        """True for a tag that was registered."""
        return self._find(tag) is not None

    def period(self, tag: str) -> float | None:
        """How often a watched tag is told, in seconds."""
        owner = self._owners.get(split_tag(tag)[0])
        return owner.due[tag][1] if owner is not None and tag in owner.due else None

    def sample(self, tag: str, now: Instant) -> Sample | None:
        """The tag as it is now; None for a tag that is not one of these."""
        tell = self._find(tag)
        if tell is None:
            return None
        value, age = tell(now.mono), self.period(tag) or 0.0
        if value is None:
            return Sample(tag, None, Quality.WAITING, now.wall, age, None, "nothing to tell yet")
        return Sample(tag, value, Quality.GOOD, now.wall, age)

    def demanded(self, tags: Iterable[str], now: float) -> None:
        """The demands on these tags changed, as far as they are ours."""
        ours = [tag for tag in tags if self._find(tag) is not None]
        for tag in ours:
            self._schedule(tag, self._owners[split_tag(tag)[0]], now)
        if ours:
            self._queue = [(_next(owner), owner.name) for owner in self._owners.values() if owner.due]
            heapq.heapify(self._queue)

    def _schedule(self, tag: str, owner: _Owner, now: float) -> None:
        period = self._demands.period(tag)
        if period is None:
            owner.due.pop(tag, None)
            return
        every = max(period, SHORTEST)
        first = owner.due.get(tag, (self._first(owner, now), 0.0))[0]
        owner.due[tag] = (min(first, now + every), every)

    def changed(self, tags: Iterable[str], now: Instant) -> None:
        """Tell these tags at once, as far as somebody watches them."""
        samples = [self.sample(tag, now) for tag in tags if self._demands.period(tag) is not None]
        if told := [sample for sample in samples if sample is not None]:
            self._publish(told)

    def tick(self, now: Instant) -> None:
        """Tell what is due: one owner at a time, so that a busy line is not kept waiting."""
        if not self._queue or self._queue[0][0] > now.mono:
            return
        owner = self._owners[self._queue[0][1]]
        due = [tag for tag, (at, _) in owner.due.items() if at <= now.mono]
        for tag in due:
            at, every = owner.due[tag]
            owner.due[tag] = (max(at + every, now.mono), every)
        heapq.heapreplace(self._queue, (_next(owner), owner.name))
        self.changed(due, now)

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic); None while nobody watches."""
        return self._queue[0][0] if self._queue else None

    def _find(self, tag: str) -> Tell | None:
        name, point = split_tag(tag)
        owner = self._owners.get(name)
        return None if owner is None else owner.values.get(point)

    def _first(self, owner: _Owner, now: float) -> float:
        """Owners take turns within the shortest period."""
        return now + SHORTEST * (1 + owner.place / len(self._owners))


def _next(owner: _Owner) -> float:
    return min(at for at, _ in owner.due.values())


def _info(point: OwnPoint) -> PointInfo:
    return PointInfo(
        name=point.name,
        group=point.group,
        kind=DIAGNOSTIC,
        type=point.type,
        rate="normal",
        unit=point.unit,
        values=dict(point.values),
        help=point.help,
    )
