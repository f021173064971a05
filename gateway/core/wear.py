"""H14: points that wear by being written are written so often a day at most. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

from gateway.core.alarms import Alarms
from gateway.core.chain import Entry
from gateway.core.drive import Drive
from gateway.core.own import OwnTags, Tell
from gateway.core.trail import Trail
from gateway.core.worn import DAY, Wear
from gateway.mapping.own import of_a_drive
from gateway.mapping.profile import Point
from gateway.mapping.site import Site
from gateway.tag import Instant

MINUTE = 60

NEARLY = 0.1
"""Share of a memory's life at which an alarm tells that it comes to its end."""

ALL = "_writes_today"
"""The own point that counts the writes of all points of a drive."""


def wearing(drive: Drive, names: Iterable[str]) -> list[Point]:
    """Those of the points whose writes wear the drive's memory."""
    points = (drive.profile.points[name] for name in names)
    return [point for point in points if point.wear is not None]


def register_of(point: Point) -> str:
    """The register that a point wears; points that are bits of one word share it, and its budget."""
    return f"{point.address:04X}H"


class WearGuard:
    """The budgets of a site."""

    def __init__(
        self, site: Site, drives: Sequence[Drive], alarms: Alarms, own: OwnTags, trail: Trail
    ) -> None:
        self._wear = Wear()
        self._daily = site.wear_per_day
        self._drives = {drive.name: drive for drive in drives}
        self._alarms = alarms
        self._trail = trail
        trail.follow(self._count)
        for drive in drives:
            drive.worn = partial(self._worn, drive)
            self._register(drive, own)

    def restore(self, wear: Wear) -> None:
        """Take up the counts of earlier runs."""
        self._wear = wear

    def _worn(self, drive: Drive, names: Iterable[str]) -> str:
        """Why these points may not be written once more today; "" if they may."""
        return next(filter(None, (self._refusal(drive, point) for point in wearing(drive, names))), "")

    def _refusal(self, drive: Drive, point: Point) -> str:
        budget = drive.config.wear_per_day.get(point.name, self._daily)
        day = self._day(drive, point)
        place = f"the register of {point.name}" if point.encoding.width else point.name
        if len(day) < budget:
            return ""
        again = f"again in {_in_words(day[-budget] + DAY - self._trail.lived)}, or " if budget else ""
        instead = point.twin and f"write {point.twin}, which wears nothing"
        instead = instead or "raise wear_per_day in the site file"
        return (
            f"{place} was written {len(day)} times in 24 h; each time wears the drive's memory, and the site "
            f"allows {budget} ({again}{instead})"
        )

    def _count(self, entry: Entry, now: Instant) -> None:
        """An entry goes on record: count what it wears, and tell when a memory comes to its end."""
        self._wear.fold(entry)
        if entry["kind"] == "intent" and "wears" in entry:
            drive = self._drives[entry["drive"]]
            for point in wearing(drive, entry["new"]):
                self._look(drive, point, now)

    def _look(self, drive: Drive, point: Point, now: Instant) -> None:
        total = self._wear.of(drive.name, register_of(point)).total
        if isinstance(point.wear, int) and total >= (1 - NEARLY) * point.wear:
            text = f"{point.name} was written {total} times; its memory is good for {point.wear}"
            self._alarms.raise_(drive.name, f"wear_{point.name}", text, now)

    def _register(self, drive: Drive, own: OwnTags) -> None:
        points = wearing(drive, drive.profile.points)
        by_register = {register_of(point): point for point in points}.values()
        values: dict[str, Tell] = {ALL: lambda now: sum(len(self._day(drive, p)) for p in by_register)}
        for point in points:
            if isinstance(point.wear, int):
                values[f"{ALL}_{point.name}"] = self._tell_today(drive, point)
                values[f"_writes_left_{point.name}"] = self._tell_left(drive, point, point.wear)
        known = of_a_drive(drive.profile)
        own.register(drive.name, {name: known[name] for name in values}, values)

    def _day(self, drive: Drive, point: Point) -> list[float]:
        return self._wear.of(drive.name, register_of(point)).since(self._trail.lived)

    def _tell_today(self, drive: Drive, point: Point) -> Tell:
        return lambda now: len(self._day(drive, point))

    def _tell_left(self, drive: Drive, point: Point, life: int) -> Tell:
        return lambda now: max(0, life - self._wear.of(drive.name, register_of(point)).total)


def _in_words(seconds: float) -> str:
    """``3 h 20 min``, rounded up."""
    minutes = int(seconds // MINUTE) + 1
    hours, minutes = divmod(minutes, MINUTE)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"
