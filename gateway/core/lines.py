"""The core's lines, by name, and the jobs it gave them. Pure."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

from gateway.core.drive import Drive
from gateway.core.rarely import UNFORETOLD, Rarely, never
from gateway.line.interface import Action, Job, LineSettings, Plan, Read, Want, Write
from gateway.line.line import Line
from gateway.mapping.site import LineConfig, Site


class Lines:
    """All lines of a site. What they do is collected, in order, for `next_action`."""

    def __init__(
        self,
        site: Site,
        drives: Sequence[Drive],
        admits: Callable[[int], bool],
        rarely: Rarely = never,
    ) -> None:
        self._rarely = rarely
        self._drives = {(drive.line, drive.unit): drive for drive in drives}
        self._lines = {
            config.name: Line(
                settings_of(config), [drive.facts for drive in drives if drive.line == config.name], admits
            )
            for config in site.lines
        }
        self._wakes = dict.fromkeys(self._lines, math.inf)
        """When each line needs a tick; kept, because a step concerns one line of many."""
        self._moments = dict.fromkeys(self._lines, -math.inf)
        """When each line did something last: its time never goes back."""
        self._foretold: dict[str, bytes] = {}
        """What each line will send when its time comes, if nothing happens there before."""
        self._left: dict[str, float] = {}
        """When what was foretold went out, where it has before the step that decides it."""
        self._did: deque[tuple[str, Action]] = deque()
        self._jobs: dict[int, tuple[str, Read | Write]] = {}
        self._last_job = 0

    @property
    def names(self) -> list[str]:
        """The names of the lines."""
        return list(self._lines)

    def get(self, line: str) -> Line | None:
        """The line of that name."""
        return self._lines.get(line)

    def drive(self, line: str, unit: int) -> Drive:
        """The drive at a unit address."""
        return self._drives[line, unit]

    def plan(self, line: str) -> Plan:
        """The present plan of a line."""
        return self._lines[line].plan

    def up(self, drive: Drive) -> bool | None:
        """Whether a drive answers; None while nobody knows."""
        return self._lines[drive.line].up(drive.unit)

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        at = min(self._wakes.values(), default=math.inf)
        return None if at == math.inf else at

    def next_action(self) -> tuple[str, Action] | None:
        """Remove and return the oldest thing that a line did, with the line's name."""
        return self._did.popleft() if self._did else None

    def start(self, now: float) -> None:
        """Begin on all lines."""
        for name, line in self._lines.items():
            self._take(name, line.start(now), now)

    def stop(self, now: float) -> None:
        """End on all lines."""
        for name, line in self._lines.items():
            self._take(name, line.stop(now), now)

    def look_ahead(self, at: float) -> list[tuple[str, bytes]]:
        """What `tick_foretold` will let the lines send at that instant; see `Line.look_ahead`."""
        return [(name, data) for name, data in self._foretold.items() if self._wakes[name] <= at]

    def tick_foretold(self, now: float) -> bool:
        """Let the lines whose time has come send what was foretold of them, as of the instant it was foretold
        for; False when there are none."""
        due = [name for name, at in self._wakes.items() if at <= now and name in self._foretold]
        for name in due:
            at = self._wakes[name]
            self._take(name, self._lines[name].tick(at), at)
            self._leaves(name, self._left.pop(name, at))
        return bool(due)

    def tick(self, now: float) -> bool:
        """Let the lines whose time has come look at it; False when there are none."""
        due = [name for name, at in self._wakes.items() if at <= now]
        for name in due:
            self._take(name, self._lines[name].tick(now), now)
        return bool(due)

    def asked(self) -> list[str]:
        """The lines on which a job waits."""
        return [name for name, line in self._lines.items() if line.asked]

    def port_opened(self, line: str, now: float) -> None:
        """The port of a line is open."""
        self._take(line, self._lines[line].port_opened(now), now)

    def port_lost(self, line: str, reason: str, now: float) -> None:
        """The port of a line is gone."""
        self._take(line, self._lines[line].port_lost(reason, now), now)

    def transmitting(self, line: str, at: float) -> None:
        """The request of a line goes out now: the one of its last step, or the one that was foretold."""
        if line in self._foretold:
            self._left[line] = at
        else:
            self._leaves(line, at)

    def _leaves(self, name: str, at: float) -> None:
        self._lines[name].leaves(at)
        self._note_wake(name)

    def received(self, line: str, data: bytes, at: float) -> None:
        """Bytes arrived on a line; it may have done something else since."""
        now = max(at, self._moments[line])
        self._take(line, self._lines[line].received(data, now), now)

    def demand(self, line: str, wants: list[Want], now: float) -> None:
        """Tell a line what is wanted of it."""
        self._take(line, self._lines[line].demand(wants, now), now)

    def forbid(self, drive: Drive, gaps: tuple[tuple[int, int], ...], now: float) -> None:
        """Let no planned read of a drive pass over these addresses from now on."""
        self._take(drive.line, self._lines[drive.line].forbid(drive.unit, gaps, now), now)

    def new_job(self) -> int:
        """A number for a job that is about to be asked."""
        self._last_job += 1
        return self._last_job

    def ask(self, line: str, job: Job, now: float) -> None:
        """Give a line a job."""
        self._jobs[job.id] = (line, job.request)
        self._take(line, self._lines[line].ask(job, now), now)

    def withdraw(self, job: int, now: float) -> bool:
        """Take a waiting job back; False when it is on the wire or done."""
        if job not in self._jobs or not self._lines[self._jobs[job][0]].withdraw(job, now):
            return False
        del self._jobs[job]
        return True

    def done(self, job: int) -> Read | Write:
        """Forget a job that is done; its request."""
        return self._jobs.pop(job)[1]

    def _take(self, name: str, actions: list[Action], now: float) -> None:
        self._did.extend((name, action) for action in actions)
        self._moments[name] = now
        self._foretold.pop(name, None)
        at = self._note_wake(name)
        if (
            now < at < math.inf
            and not self._rarely(UNFORETOLD)
            and (data := self._lines[name].look_ahead(at))
        ):
            self._foretold[name] = data

    def _note_wake(self, name: str) -> float:
        at = self._lines[name].wake()
        self._wakes[name] = math.inf if at is None else at
        return self._wakes[name]


def settings_of(config: LineConfig) -> LineSettings:
    """How to speak on a line: the longest silence that any of its drives needs counts for all."""
    return LineSettings(
        name=config.name,
        framing=config.framing,
        baud=config.baud,
        format=config.format,
        gap=max((drive.profile.serial.gap for drive in config.drives), default=0.0),
        echo=config.rs485.echo,
    )
