"""What each drive does when the line dies, held against what the site demands (H9). Pure.

Where the site says anything of it, or somebody watches the tag that shows it, it is read when a drive is
first heard, whenever it comes back, and every hour; what the panel alone knows is given in the site file. A
drive that contradicts gets nothing but stops, and an alarm says why. Reads feed the drive's own watchdog;
where the line cannot do that in time, an alarm says so too.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterable, Sequence
from fractions import Fraction
from typing import Any

from gateway.core.alarms import Alarms
from gateway.core.conditions import shown_as
from gateway.core.drive import Drive, is_polled
from gateway.core.establishing import fresh_sample
from gateway.core.guard import refuse
from gateway.core.own import OwnTags, Tell
from gateway.core.polling import Polling
from gateway.core.procedure import Effect
from gateway.core.store import Store
from gateway.line.interface import Plan
from gateway.mapping.lossdemand import Judgement, Look, Shown, described, judge, settings_of
from gateway.mapping.own import OF_A_DRIVE
from gateway.mapping.profile import Point
from gateway.mapping.site import LossDemand
from gateway.tag import Cause, Instant, Quality, Sample, split_tag

EVERY = 3600.0
"""Seconds between two looks at the parameters of a drive."""

AGAIN = 60.0
"""Seconds after which a look that brought no answer is repeated."""

FEED_SHARE = 0.5
"""Each drive is read at least once in this share of its communication time-out."""

WATCHER = "comm loss"
"""The name under which the reads that feed a drive's watchdog are wanted."""

ALARM, UNFED = "comm_loss", "watchdog_unfed"
"""Names of the alarms."""

TAG = "_comm_loss"
"""The point that tells in words what the drive does."""

ANY = LossDemand("any")

AWAY = (Quality.NO_COMMUNICATION, Quality.LINE_DOWN)
"""Qualities of a read that says nothing about the drive."""

Read = Callable[[Sequence[str], float, Callable[[tuple[Sample, ...]], None], Instant], None]
"""Reads tags once: tags, greatest age, who is told, now."""


def points_of(drive: Drive) -> list[Point]:
    """The points that tell what the drive does when the line dies; the rest stands in its settings."""
    known = drive.profile.points
    names = drive.profile.serial.comm_loss.names
    return [known[name] for name in names if name in known and is_polled(known[name])]


def demand_on(drive: Drive) -> LossDemand:
    """What the site demands of a drive."""
    return drive.config.comm_loss or ANY


def judged(drive: Drive, store: Store) -> Judgement:
    """Whether the drive does what is demanded, by what is known of it."""
    return judge(drive.profile.serial.comm_loss, demand_on(drive), _look(drive, store))


def _look(drive: Drive, store: Store) -> Look:
    settings = settings_of(drive.config)

    def look(name: str) -> Shown | None:
        held = store.get(drive.tag(name))
        if held is None or held.sample.quality is not Quality.GOOD or isinstance(held.sample.value, str):
            return settings(name)
        value = held.sample.value
        place = drive.profile.points[name].notation
        text = shown_as(held.sample) + (f" ({place})" if place else "")
        return None if value is None else Shown(Fraction(str(float(value))), text)

    return look


def comm_loss_settled(drive: Drive, store: Store, now: float) -> Generator[Effect, Any, None]:
    """A part of a procedure: go on only if the drive does what the site demands when the line dies.

    Raises:
        Ended: if it does not, or cannot be told.
    """
    if demand_on(drive).action == "any":
        return
    for point in points_of(drive):
        why = f"what {drive.name} does when the line dies depends on {point.name}"
        yield from fresh_sample(drive, store, point, now, why, now - EVERY)
    judgement = judged(drive, store)
    if judgement.met is not True:
        raise refuse(Cause.PRECONDITION, f"nothing but a stop is written to {drive.name}: {judgement.reason}")


class CommLossWatch:
    """Looks at all drives. ``read`` reads tags once, ``replan`` tells the lines that demands changed."""

    def __init__(
        self,
        drives: Iterable[Drive],
        polling: Polling,
        alarms: Alarms,
        own: OwnTags,
        read: Read,
        replan: Callable[[Collection[str]], None],
    ) -> None:
        self._drives = list(drives)
        self._polling = polling
        self._alarms = alarms
        self._own = own
        self._read = read
        self._replan = replan
        for drive in self._drives:
            own.register(drive.name, {TAG: OF_A_DRIVE[TAG]}, {TAG: self._tells(drive)})
        self._due: dict[str, float] = {}
        self._unfed: dict[str, str] = {}
        self._now = Instant(0.0, 0)

    def drive_up(self, drive: Drive, now: Instant) -> None:
        """A drive answers: what it does when the line dies is to be read, and may be another than before."""
        self._due[drive.name] = now.mono

    def drive_down(self, drive: Drive) -> None:
        """A drive does not answer: nothing is to be read."""
        self._due.pop(drive.name, None)

    def moment(self, now: Instant) -> None:
        """The core's present moment, for what comes in."""
        self._now = now

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        return min(self._due.values(), default=None)

    def tick(self, now: Instant) -> None:
        """Look at the drives whose time has come."""
        if not self._due or min(self._due.values()) > now.mono:
            return
        for drive in self._drives:
            if self._due.get(drive.name, now.mono + 1) <= now.mono:
                self._due[drive.name] = now.mono + EVERY
                if drive.config.comm_loss is not None or self._is_watched(drive):
                    self._look_at(drive, now)

    def demanded(self, tags: Iterable[str], now: Instant) -> None:
        """The demands on these tags changed: what somebody begins to watch is read at once."""
        for drive, point in map(split_tag, tags):
            if point == TAG and drive in self._due:
                self._due[drive] = now.mono

    def _is_watched(self, drive: Drive) -> bool:
        return self._polling.demands.period(drive.tag(TAG)) is not None

    def plan_changed(self, line: str, plan: Plan, now: Instant) -> None:
        """Say where the plan does not visit a drive before it takes the line for dead."""
        for drive in self._drives:
            after = self.after(drive)
            if drive.line == line and after is not None:
                planned = min((b.worst_age for b in plan.blocks if b.unit == drive.unit), default=after)
                text = f"{drive.name} takes the line for dead after {after:g} s, and may be asked only every"
                unfed = f"{text} {planned:.2f} s: the line is too full" if planned > after else ""
                self._alarms.set(drive.name, UNFED, unfed, now)

    def after(self, drive: Drive) -> float | None:
        """Seconds after which the drive takes the line for dead; None: not known, or never."""
        loss = drive.profile.serial.comm_loss
        if loss.after is not None or loss.after_from is None:
            return loss.after
        shown = _look(drive, self._polling.store)(loss.after_from)
        return float(shown.number) if shown and shown.number > 0 else None

    def _look_at(self, drive: Drive, now: Instant) -> None:
        tags = [drive.tag(point.name) for point in points_of(drive)]
        self._read(tags, 0.0, lambda samples: self._seen(drive, samples), now)

    def _seen(self, drive: Drive, samples: Sequence[Sample]) -> None:
        """What a drive does when the line dies was read, or could not be."""
        if any(sample.quality in AWAY for sample in samples):
            if drive.name in self._due:
                self._due[drive.name] = min(self._due[drive.name], self._now.mono + AGAIN)
            return
        self._feed(drive)
        judgement = judged(drive, self._polling.store)
        text = f"{drive.name}: {judgement.reason}; nothing but a stop is written to it"
        self._alarms.set(drive.name, ALARM, "" if judgement.met else text, self._now)
        self._told(drive)

    def _tells(self, drive: Drive) -> Tell:
        return lambda now: described(drive.profile.serial.comm_loss, _look(drive, self._polling.store))

    def _told(self, drive: Drive) -> None:
        self._own.changed([drive.tag(TAG)], self._now)

    def _feed(self, drive: Drive) -> None:
        """Want a status point often enough where only the drive itself tells how often that is."""
        after = self.after(drive)
        if drive.profile.serial.comm_loss.after_from is None or after is None:
            return
        point = drive.points_in(*drive.facts.probe)[0]
        self._replan(self._polling.demands.change(WATCHER, {drive.tag(point.name): after * FEED_SHARE}))
