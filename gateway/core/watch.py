"""What the core watches by itself: which drives answer, and faults that come and go. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from gateway.bridge.api import DriveState, Happened
from gateway.core.clients import Clients
from gateway.core.drive import Drive
from gateway.core.polling import Polling
from gateway.line.interface import Plan
from gateway.mapping.profile import Kind
from gateway.tag import Event, Instant, Quality, Sample, Value

OWN = "core"
"""The name under which the core itself wants tags."""

FEED_SHARE = 0.5
"""Each drive is read at least once in this share of its communication time-out."""


class Watchkeeper:
    """Keeps every drive in view and tells clients what happens to it."""

    def __init__(
        self, drives: Sequence[Drive], rates: dict[str, float], polling: Polling, clients: Clients
    ) -> None:
        self._drives = drives
        self._rates = rates
        self._polling = polling
        self._clients = clients
        self._states: dict[str, DriveState] = {}
        self._faults: dict[str, Value] = {}
        self._may_tell = {
            drive.tag(point.name): (drive, point)
            for drive in drives
            for point in drive.profile.points.values()
            if point.kind is Kind.FAULT
        }

    def start(self) -> list[str]:
        """Want one status point of each drive, often enough to feed the drive's own watchdog; the tags."""
        wanted: list[str] = []
        for drive in self._drives:
            address, count = drive.facts.probe
            points = drive.points_in(address, count)
            after = drive.profile.serial.comm_loss.after
            period = min(self._rates["normal"], after * FEED_SHARE if after else self._rates["normal"])
            wanted += self._polling.demands.change(OWN, {drive.tag(points[0].name): period})
        return wanted

    def states(self) -> Iterator[DriveState]:
        """The state of every drive of which something is known."""
        return iter(self._states.values())

    def up(self) -> dict[str, bool]:
        """Which drives answer."""
        return {
            drive.name: drive.name in self._states and self._states[drive.name].up for drive in self._drives
        }

    def drive_up(self, drive: Drive, now: Instant) -> None:
        """A drive answers, for the first time or again. What it holds is no longer known."""
        known = drive.name in self._states
        drive.forget()
        self._polling.restored(drive)
        self._change(DriveState(drive.name, True, now.wall))
        if known:
            self._tell(drive, "communication_restored", f"{drive.name} answers again", now)

    def drive_down(self, drive: Drive, reason: str, now: Instant) -> None:
        """A drive does not answer any more."""
        self._polling.lost(drive, Quality.NO_COMMUNICATION, reason, now)
        self._change(DriveState(drive.name, False, now.wall, reason))
        self._tell(drive, "communication_lost", f"{drive.name}: {reason}", now)

    def line_down(self, line: str, reason: str, now: Instant) -> None:
        """The port of a line is gone, and with it all its drives."""
        for drive in self._drives:
            if drive.line != line:
                continue
            text = f"line {line}: {reason}"
            was = self._states.get(drive.name)
            self._polling.lost(drive, Quality.LINE_DOWN, text, now)
            self._change(DriveState(drive.name, False, now.wall, text))
            if was is None or was.up:
                self._tell(drive, "line_down", text, now)

    def plan_changed(self, line: str, plan: Plan, now: Instant) -> None:
        """Tell those concerned which periods the new plan holds."""
        self._clients.periods(self._polling.plan_changed(line, plan, now.mono))

    def look(self, samples: Iterable[Sample], now: Instant) -> None:
        """Make events of faults that come and go."""
        for sample in samples:
            found = self._may_tell.get(sample.tag)
            if found is None or sample.quality is not Quality.GOOD:
                continue
            before = self._faults.get(sample.tag)
            self._faults[sample.tag] = sample.value
            if bool(sample.value) != bool(before) or (before is not None and sample.value != before):
                name = "fault_raised" if sample.value else "fault_cleared"
                text = found[1].help or found[1].name
                self._tell(found[0], name, text, now, sample)

    def _change(self, state: DriveState) -> None:
        before = self._states.get(state.drive)
        self._states[state.drive] = state
        if before is None or (before.up, before.reason) != (state.up, state.reason):
            self._clients.tell_all(state)

    def _tell(self, drive: Drive, name: str, text: str, now: Instant, sample: Sample | None = None) -> None:
        event = Event(
            time=sample.time if sample else now.wall,
            drive=drive.name,
            name=name,
            text=text,
            tag=sample.tag if sample else "",
            value=sample.value if sample else None,
        )
        self._clients.tell_all(Happened(event))
