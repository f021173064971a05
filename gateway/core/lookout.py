"""Looks out for drives that are not as they were commanded: restarted, taken over by their panel or by
another master, or running although nobody here commanded it (H7, H8, H12, H13). Pure.

What was commanded and seen on a drive is looked at again from time to time, at the first contact after a
loss, and when the motor starts or stops by itself; nothing is judged by one look alone. Nothing is corrected,
unless the site says ``on_reappear: stop``. A motor that runs when the gateway starts is reported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from gateway.core.alarms import Alarms
from gateway.core.conditions import holds, shown_as
from gateway.core.drive import Drive, is_polled
from gateway.core.polling import Polling
from gateway.mapping.profile import Condition, Kind, Term
from gateway.tag import Instant, Quality, Sample, Value, own_name, split_tag

RUNNING, FAULT = "running", "fault"
"""The names by which all profiles tell whether the motor is driven and whether the drive has tripped."""

SETTLE = 0.3
"""Seconds between what looks wrong and the look that judges it."""

EVERY = 5.0
"""What was commanded is looked at again after so many of the site's normal periods."""

RESTARTED, LOCAL, FOREIGN, LATCHED = "restarted", "local", "foreign_master", "latched_run"
"""Names of the alarms."""

AWAY = (Quality.NO_COMMUNICATION, Quality.LINE_DOWN)

Shown = Mapping[str, Sample]
"""What a drive shows, by point."""

Read = Callable[[Sequence[str], float, Callable[[tuple[Sample, ...]], None], Instant], None]
"""Reads tags once: tags, greatest age, who is told, now."""


class Consequences(Protocol):
    """What follows from what is seen."""

    def void(self, drive: Drive, reason: str) -> None:
        """Whoever commands the drive has to acquire it anew."""

    def stop(self, drive: Drive, why: str) -> None:
        """Stop the drive."""

    def tell_event(self, drive: Drive, name: str, text: str) -> None:
        """Tell everybody that something happened."""


@dataclass(slots=True)
class _Watched:
    """A drive, and when it is next looked at (monotonic; None: it need not be)."""

    drive: Drive
    remote: Condition
    """While this holds, the drive obeys the line."""
    due: float | None = None
    gap: bool = False
    """It was away since it was last looked at."""
    looking: bool = False
    suspect: bool = False
    """The last look found something wrong; the next one judges."""
    met: bool = False
    """It was seen at least once since the gateway started."""
    ran: bool | None = None


class Lookout:
    """Looks after all drives.

    Args:
        read: reads tags once.
        consequences: what follows from what is seen.
    """

    def __init__(
        self,
        drives: Iterable[Drive],
        polling: Polling,
        alarms: Alarms,
        read: Read,
        consequences: Consequences,
    ) -> None:
        self._watched = {drive.name: _Watched(drive, remote_of(drive)) for drive in drives}
        self._store = polling.store
        self._alarms = alarms
        self._read = read
        self._every = EVERY * polling.rates["normal"]
        self._do = consequences
        self._now = Instant(0.0, 0)
        self._running = {
            w.drive.tag(RUNNING): w for w in self._watched.values() if RUNNING in w.drive.profile.points
        }
        for watched in self._watched.values():
            watched.drive.expected.sources = frozenset(term.name for term in watched.remote)

    # -- what happens

    def moment(self, now: Instant) -> None:
        """The core's present moment, for what comes in."""
        self._now = now

    def drive_down(self, drive: Drive) -> None:
        """A drive does not answer any more."""
        watched = self._watched[drive.name]
        watched.gap, watched.due, watched.ran = True, None, None

    def drive_up(self, drive: Drive) -> None:
        """A drive answers, for the first time or again: what it holds is held against what was commanded."""
        watched = self._watched[drive.name]
        if watched.gap and (drive.expected.values or drive.expected.runs is not None):
            watched.due = self._now.mono

    def look(self, samples: Iterable[Sample]) -> None:
        """Samples came in: notice a motor that starts or stops."""
        for sample in samples:
            watched = self._running.get(sample.tag)
            if watched is None or sample.quality is not Quality.GOOD:
                continue
            if sample.value != watched.ran:
                self._turned(watched, bool(sample.value))
            held = watched.drive.expected.values or watched.drive.expected.unseen
            if watched.due is None and held and not watched.looking:
                watched.due = self._now.mono + self._every

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        return min((w.due for w in self._watched.values() if w.due is not None), default=None)

    def tick(self, now: Instant) -> None:
        """Look at what is due."""
        for watched in self._watched.values():
            if watched.due is not None and watched.due <= now.mono:
                watched.due = None
                self._look_at(watched)

    def objection(self, drive: Drive) -> str:
        """Why nothing but a stop may go to a drive (H12); empty: it may. Another master was seen to command
        it, or is heard on its line."""
        alarms = (self._alarms.get(subject, FOREIGN) for subject in (drive.name, own_name(drive.line)))
        alarm = next((alarm for alarm in alarms if alarm and not alarm.acknowledged), None)
        if alarm is None:
            return ""
        return f"{alarm.text}; nothing but a stop is written until the alarm {alarm.key} is acknowledged"

    # -- looking

    def _turned(self, watched: _Watched, runs: bool) -> None:
        """The motor began to run, or ceased to: was that commanded?"""
        first, watched.ran = not watched.met, runs
        watched.met = True
        drive, expected = watched.drive, watched.drive.expected
        if first and runs and expected.runs is None:
            text = f"{drive.name} runs as the gateway starts; it is left alone"
            self._do.tell_event(drive, "running_at_start", text)
        if not runs:
            self._alarms.clear(drive.name, LATCHED, self._now)
        if expected.runs is not None and expected.runs != runs and not self._shows(drive, FAULT):
            watched.due = min(watched.due or self._now.mono + SETTLE, self._now.mono + SETTLE)

    def _look_at(self, watched: _Watched) -> None:
        """Read everything that was commanded, and what tells whether the drive obeys."""
        if watched.looking:
            return
        drive = watched.drive
        names = [
            *drive.expected.values,
            *drive.expected.unseen,
            *(term.name for term in watched.remote),
            RUNNING,
            FAULT,
        ]
        points = drive.profile.points
        tags = [
            drive.tag(name) for name in dict.fromkeys(names) if name in points and is_polled(points[name])
        ]
        watched.looking = True
        self._read(tags, 0.0, lambda samples: self._seen(watched, samples), self._now)

    def _seen(self, watched: _Watched, samples: Sequence[Sample]) -> None:
        watched.looking = False
        if any(sample.quality in AWAY for sample in samples):
            return
        shown = {split_tag(sample.tag)[1]: sample for sample in samples if sample.quality is Quality.GOOD}
        watched.drive.expected.look_at({name: sample.value for name, sample in shown.items()})
        if not watched.suspect and self._is_wrong(watched, shown):
            watched.suspect, watched.due = True, self._now.mono + SETTLE
            return
        gap, watched.gap, watched.suspect = watched.gap, False, False
        self._judge(watched, shown, gap)

    def _is_wrong(self, watched: _Watched, shown: Shown) -> bool:
        expected = watched.drive.expected
        obeys = not _against(watched.remote, shown)
        latched = expected.runs is False and _is(shown, RUNNING)
        return bool(_drift(watched.drive, shown)) or latched or obeys != (expected.obeys is not False)

    # -- judging

    def _judge(self, watched: _Watched, shown: Shown, gap: bool) -> None:
        drive = watched.drive
        obeys = self._obeys(watched, shown)
        drift = _drift(drive, shown)
        if drift and (gap or _at_rest(drive, drift, shown)):
            self._restarted(drive, drift, shown)
        elif drift and obeys and not _tripped(drive, drift, shown):
            self._foreign(drive, drift, shown)
        for name in drift:
            drive.expected.values.pop(name, None)
        if drive.expected.runs is not False or not _is(shown, RUNNING):
            self._alarms.clear(drive.name, LATCHED, self._now)
        elif obeys:
            self._latched(drive)

    def _obeys(self, watched: _Watched, shown: Shown) -> bool:
        """Whether the drive takes its commands from the line; that it ceased to is told (H13)."""
        against, drive = _against(watched.remote, shown), watched.drive
        did = drive.expected.runs if drive.expected.obeys is None else drive.expected.obeys
        drive.expected.obeys = not against
        drive.local = f"{drive.name} is not commanded from here: {_words(against, shown)}" if against else ""
        if not against:
            self._alarms.clear(drive.name, LOCAL, self._now)
        elif did:
            ours = all(drive.expected.values.get(t.name) == shown[t.name].value for t in against)
            if not ours:
                self._alarms.raise_(drive.name, LOCAL, drive.local, self._now)
            self._do.void(drive, drive.local)
        return not against

    def _restarted(self, drive: Drive, drift: Mapping[str, Value], shown: Shown) -> None:
        """H7: the drive has lost what was commanded. It ought to stand now."""
        drive.forget()
        drive.expected.forget(runs=False)
        self._void(drive, RESTARTED, f"{drive.name} restarted: {_differences(drift, shown)}")

    def _foreign(self, drive: Drive, drift: Mapping[str, Value], shown: Shown) -> None:
        """H12: somebody else has commanded the drive."""
        text = f"another master commands {drive.name}: {_differences(drift, shown)}"
        self._void(drive, FOREIGN, text)

    def _latched(self, drive: Drive) -> None:
        """H8: the drive runs although it ought to stand."""
        text = f"{drive.name} runs, and nobody commanded that from here"
        new = self._alarms.raise_(drive.name, LATCHED, text, self._now)
        if new and drive.config.control.on_reappear == "stop":
            self._do.stop(drive, "on_reappear")

    def _void(self, drive: Drive, name: str, text: str) -> None:
        self._alarms.raise_(drive.name, name, text, self._now, once=True)
        self._do.void(drive, text)

    def _shows(self, drive: Drive, name: str) -> bool:
        held = self._store.get(drive.tag(name))
        return held is not None and held.sample.quality is Quality.GOOD and bool(held.sample.value)


def remote_of(drive: Drive) -> Condition:
    """What must hold for the drive to obey the line, as far as the drive itself shows it: what all its run
    commands ask for."""
    commands = [c for name, c in drive.profile.commands.items() if name.startswith("run_")]
    terms = {term.name: term for command in commands for term in command.only_when if not term.setting}
    return tuple(
        term
        for name, term in terms.items()
        if all(any(t.name == name for t in c.only_when) for c in commands)
    )


def _against(remote: Condition, shown: Shown) -> list[Term]:
    """What says that the drive does not obey the line."""
    return [term for term in remote if term.name in shown and not holds(term, shown[term.name].value)]


def _drift(drive: Drive, shown: Shown) -> dict[str, Value]:
    """What was commanded and is shown otherwise; what decides whether the line is obeyed is judged apart."""
    return {
        name: value
        for name, value in drive.expected.values.items()
        if name in shown and shown[name].value != value and name not in drive.expected.sources
    }


def _at_rest(drive: Drive, drift: Mapping[str, Value], shown: Shown) -> bool:
    """Everything that was commanded is gone: what is left when the power was away for a moment."""
    wanted = [name for name, value in drive.expected.values.items() if value and name in shown]
    wanted = [name for name in wanted if name not in drive.expected.sources]
    return bool(wanted) and all(name in drift and not shown[name].value for name in wanted)


def _tripped(drive: Drive, drift: Mapping[str, Value], shown: Shown) -> bool:
    """A drive that has tripped may take its run command back by itself."""
    only_run = all(drive.profile.points[name].kind is Kind.COMMAND for name in drift)
    return only_run and _is(shown, FAULT)


def _is(shown: Shown, name: str) -> bool:
    return name in shown and bool(shown[name].value)


def _words(against: Sequence[Term], shown: Shown) -> str:
    return ", ".join(f"{term.name} is {shown_as(shown[term.name])}" for term in against)


def _differences(drift: Mapping[str, Value], shown: Shown) -> str:
    """``frequency_command shows 0, 30 was commanded``."""
    texts = (
        f"{name} shows {shown_as(shown[name])}, {_text(value)} was commanded" for name, value in drift.items()
    )
    return "; ".join(texts)


def _text(value: Value) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)
