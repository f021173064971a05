"""What the core looks after beside reading and writing: is each drive what the site says, does it do what was
commanded, and will it do what the site demands when the line dies? Pure.

Puts the parts together that look after one of these each, so that the core tells what happens once.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence

from gateway.core.alarms import Alarms
from gateway.core.commloss import CommLossWatch, Read
from gateway.core.drive import Drive
from gateway.core.identity import Identities
from gateway.core.lookout import Consequences, Lookout
from gateway.core.own import OwnTags
from gateway.core.polling import Polling
from gateway.line.interface import Plan
from gateway.tag import Instant, Sample


class Oversight:
    """All of it.

    Args:
        read: reads tags once.
        replan: tells the lines that the demands on tags changed.
        consequences: what follows when a drive is not as it was commanded.
    """

    def __init__(
        self,
        drives: Sequence[Drive],
        polling: Polling,
        alarms: Alarms,
        own: OwnTags,
        read: Read,
        replan: Callable[[Collection[str]], None],
        consequences: Consequences,
    ) -> None:
        self._drives = drives
        self._identities = Identities(drives, polling.store, alarms, own, read)
        self._comm_loss = CommLossWatch(drives, polling, alarms, own, read, replan)
        self._lookout = Lookout(drives, polling, alarms, read, consequences)

    def moment(self, now: Instant) -> None:
        """The core's present moment, for what comes in."""
        self._identities.moment(now)
        self._comm_loss.moment(now)
        self._lookout.moment(now)

    def drive_up(self, drive: Drive, now: Instant) -> None:
        """A drive answers, for the first time or again."""
        self._identities.drive_up(drive)
        self._comm_loss.drive_up(drive, now)
        self._lookout.drive_up(drive)

    def drive_down(self, drive: Drive) -> None:
        """A drive does not answer any more."""
        self._comm_loss.drive_down(drive)
        self._lookout.drive_down(drive)

    def line_down(self, line: str) -> None:
        """The port of a line is gone."""
        for drive in self._drives:
            if drive.line == line:
                self.drive_down(drive)

    def plan_changed(self, line: str, plan: Plan, now: Instant) -> None:
        """A line reads otherwise from now on."""
        self._comm_loss.plan_changed(line, plan, now)

    def demanded(self, tags: Collection[str], now: Instant) -> None:
        """The demands on these tags changed."""
        self._comm_loss.demanded(tags, now)

    def tick(self, now: Instant) -> None:
        """Do what is due."""
        self._comm_loss.tick(now)
        self._lookout.tick(now)

    def objection(self, drive: Drive) -> str:
        """Why nothing but a stop may go to a drive; empty: it may."""
        return self._lookout.objection(drive)

    def look(self, samples: Iterable[Sample]) -> None:
        """Samples came in."""
        self._lookout.look(samples)

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        times = (self._comm_loss.wake(), self._lookout.wake())
        return min((time for time in times if time is not None), default=None)
