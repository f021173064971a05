"""The box: one world, played step by step in virtual time."""

from __future__ import annotations

import hashlib
import math
import random
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec

from gateway.bridge.messages import Call, Response
from gateway.core.core import Core
from gateway.core.events import (
    Action,
    Asked,
    Event,
    Joined,
    Left,
    Open,
    PortLost,
    PortOpened,
    Received,
    Record,
    Recorded,
    Started,
    Tell,
    Ticked,
    Transmit,
)
from gateway.core.runs import Boot
from gateway.tag import Instant, Role
from tests.core.world import START
from tests.line.storm.wire import Clock
from tests.prove.bus import Bus
from tests.prove.clients import Clients
from tests.prove.observers import Observer, everybody
from tests.prove.safe import Safe
from tests.prove.scene import Scene
from tests.prove.seen import Answer, Seen
from tests.prove.site import site_of
from tests.prove.troubles import Troubles

MOST_AT_ONCE = 5_000
"""Steps at one instant: with more of them the core does nothing but go round in circles."""
JUST_AFTER = 1e-7
"""Seconds: what came in is looked at before the time that has come."""
PORT_OPENS = 0.002
_encode = msgspec.msgpack.Encoder().encode


@dataclass(frozen=True)
class Violation:
    """An invariant that does not hold."""

    invariant: str
    at: float
    text: str

    def __str__(self) -> str:
        return f"{self.at:.6f} {self.invariant}: {self.text}"


@dataclass
class Report:
    """What came of a world."""

    seed: int
    seconds: float = 0.0
    line_seconds: float = 0.0
    steps: int = 0
    requests: int = 0
    """Frames of ours on wires."""
    counts: Counter[str] = field(default_factory=Counter)
    looked: Counter[str] = field(default_factory=Counter)
    """How often each invariant was put to the test."""
    wrong: list[Violation] = field(default_factory=list)
    trace: str = ""
    """A hash over everything that went into the core and came out of it."""


class Box:
    """A world. Everything in it happens in the order of its clock."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.site = site_of(scene)
        self.clock = Clock()
        self.clock.now = 0.0
        self.report = Report(scene.seed)
        self.seen = Seen()
        self.core: Core | None = None
        self.wall_offset = 0
        self._offsets = [(0.0, 0)]
        self.mono_base = 0.0
        """When the machine was switched on."""
        self._mono = 0.0
        self._wake_mono = self._wake_at = math.inf
        self.stalled_until = 0.0
        """Until then the process stands still."""
        self._at_once = 0
        """Steps at the present instant."""
        self.machine = 0
        self.calm = False
        self.dying = -1
        """Steps that the core has left to live; negative: no end is near."""
        self._rng = random.Random(f"box {scene.seed}")
        self._rare = random.Random(f"rare {scene.seed}")
        self._hash = hashlib.blake2b(digest_size=16)
        self._numbers = 0
        self._sessions = 0
        parts = zip(self.site.lines, scene.lines, strict=True)
        self.buses = {
            config.name: Bus(self.clock, config, line, f"{scene.seed} {config.name}", self)
            for config, line in parts
        }
        self.plugged = dict.fromkeys(self.buses, True)
        self.safe = Safe(self.clock, scene.disk_delay, random.Random(f"disk {scene.seed}"), self.count)
        self.clients = Clients(self)
        self.troubles = Troubles(self)
        self.observers: list[Observer] = everybody(self)

    # -- playing

    def run(self, until: float = math.inf) -> Report:
        """Play it to its end, to the first violation, or ``until`` then."""
        for each in self.scene.happenings:
            self.clock.at(each.at, lambda each=each: self._happen(each.what, each.number))  # type: ignore[misc]
        self.clock.at(self.scene.seconds, self._calm_down)
        self.boot()
        clock, report = self.clock, self.report
        while not report.wrong:
            wake = self._wake_at
            if wake < self.stalled_until:
                wake = self.stalled_until + JUST_AFTER
            if min(wake, clock.next()) > min(self.scene.end, until):
                break
            if wake <= clock.next():
                clock.now = max(clock.now, wake)
                self._tick()
            else:
                clock.happen()
        if not report.wrong and self.scene.end <= until:
            clock.now = self.scene.end
            self._all("ended")
        return self._finished()

    def _finished(self) -> Report:
        report = self.report
        report.seconds = self.clock.now
        report.requests = self._numbers
        report.line_seconds = self.clock.now * len(self.buses)
        for bus in self.buses.values():
            report.counts += bus.faults.counts
        for observer in self.observers:
            report.looked[f"{observer.name} ({observer.hazard})"] += observer.looked
        report.trace = self._hash.hexdigest()
        return report

    def _happen(self, what: str, number: int) -> None:
        rng = random.Random(number)
        if self.clients.acts(what):
            self.clients.act(what, rng)
        else:
            self.troubles.strike(what, rng)

    def _calm_down(self) -> None:
        self.calm = True
        for bus in self.buses.values():
            bus.calm()
        self.safe.heal()
        self.troubles.end()
        self.clients.calm()

    def count(self, name: str) -> None:
        """A fault was there."""
        self.report.counts[name] += 1

    def fail(self, invariant: str, text: str) -> None:
        """An invariant does not hold."""
        self.report.wrong.append(Violation(invariant, self.clock.now, text))

    # -- time

    def instant(self) -> Instant:
        """The present moment as the machine's clocks show it."""
        now = self.clock.now
        self._mono = max(self._mono, now - self.mono_base)
        return Instant(self._mono, START + self.wall_offset + round(now * 1e9))

    def jump(self, seconds: float) -> None:
        """The wall clock is set."""
        self.wall_offset += round(seconds * 1e9)
        self._offsets.append((self.clock.now, self.wall_offset))

    @property
    def clock_set(self) -> float:
        """When the wall clock was set last."""
        return self._offsets[-1][0]

    def moment_of(self, wall: int) -> float:
        """The latest moment so far at which the wall clock showed this."""
        until = self.clock.now
        for since, offset in reversed(self._offsets):
            at = (wall - START - offset) / 1e9
            if since - 1e-6 <= at <= until + 1e-6:
                return at
            until = since
        return (wall - START - self.wall_offset) / 1e9

    def _tick(self) -> None:
        """The core's moment has come: on its own clock no rounding makes it too early."""
        self._mono = max(self._mono, self._wake_mono)
        ahead = self.core.look_ahead(self.instant().mono) if self.core is not None else []
        for action in ahead:  # as the shell does: first the bytes, then the decision
            self._carry_out(action)
        self.feed(Ticked(), ahead)

    def _look_for_wake(self) -> None:
        """When the core wants to be woken."""
        wake = None if self.core is None else self.core.wake()
        self._wake_mono = math.inf if wake is None else wake
        self._wake_at = max(self.clock.now, self._wake_mono + self.mono_base)

    # -- the core's life

    def boot(self) -> None:
        """The core starts, out of what is on the disk."""
        try:
            found = self.safe.start(self._recorded)
        except OSError:
            self.count("start failed: the journal cannot be read")
            self.clock.at(self.clock.now + 1.0, self.boot)
            return
        self.seen.begin()
        self.dying = -1
        self._all("began")
        self.core = Core(self.site, "box", self._rarely)
        boot = Boot(id=f"boot-{self.seen.life}", machine=f"machine-{self.machine}")
        self.feed(Started(found.memory, boot, found.broken, found.cut))
        self.clients.began()

    def _rarely(self, path: str) -> bool:
        """Whether the core takes a rare path for no reason."""
        share = self.scene.rare.get(path, 0.0)
        if not share or self.calm or self._rare.random() >= share:
            return False
        self.count(f"rare: {path}")
        return True

    def die(self, power: bool) -> None:
        """The core is gone, at once; with ``power`` the machine is too."""
        if self.core is None:
            return
        self.core = None
        self._wake_at = math.inf
        self.dying = -1
        for bus in self.buses.values():
            bus.open = False
        self.safe.crash(power)
        self.clients.died()
        self._all("died")
        self.count("reboots" if power else "crashes")
        if power:
            self.machine += 1
            away = self._rng.uniform(3.0, 10.0)
            self._mono = 0.0
            self.mono_base = self.clock.now + away - self._rng.uniform(0.5, 2.0)
        else:
            away = self._rng.uniform(0.2, 3.0)
        self.clock.at(self.clock.now + away, self.boot)

    # -- steps

    def feed(self, event: Event, sent: Sequence[Transmit] = ()) -> None:
        """Take the core a step further, and carry out what it says. It may die on the way. ``sent``: what is
        on the wire already of that."""
        if self.core is None:
            return
        self.report.steps += 1
        seen, now = self.seen, self.clock.now
        self._at_once = self._at_once + 1 if now == seen.now else 0
        if self._at_once > MOST_AT_ONCE:
            self.fail(
                "the core comes to rest", f"{MOST_AT_ONCE} steps at one instant, now with {event!r:.300}"
            )
            return
        seen.now = now
        self._note("event", event)
        try:
            actions = self.core.step(event, self.instant())
        except Exception as error:  # whatever it is, it is a finding
            self.fail("the core never falls over", f"{type(error).__name__}: {error} at {event!r:.300}")
            return
        last = self._rng.randint(0, len(actions)) if self.dying == 0 else len(actions)
        for action in actions[:last]:
            if action not in sent:
                self._carry_out(action)
        if self.dying == 0:
            self.die(power=False)
        elif self.dying > 0:
            self.dying -= 1
        for observer in self._stepping:
            observer.stepped()
        self._look_for_wake()

    def _carry_out(self, action: Action) -> None:
        match action:
            case Transmit(line, data):
                self._note("sent", (line, data))
                self._transmit(line, data)
            case Tell(session, message):
                self._note("told", message)
                self.clients.told(session, message)
                for observer in self._listening:
                    observer.told(session, message)
            case Record(number, entry, keep):
                self._note("record", entry)
                self.seen.intend(number, entry, keep)
                self.safe.append(action)
                self._all("recorded", number, entry)
            case Open(line):
                self.clock.at(self.clock.now + PORT_OPENS, lambda: self._open(line))
            case _:
                pass

    def _transmit(self, line: str, data: bytes) -> None:
        bus = self.buses[line]
        if not bus.open:
            return
        self._numbers += 1
        frame = bus.transmit(data, self._numbers)
        if self.core is not None:
            self.core.transmitting(line, self.instant().mono)
        self.seen.sent(frame)
        self._all("sent", frame)

    def _open(self, line: str) -> None:
        if self.core is None or self.buses[line].open:
            return
        if not self.plugged[line]:
            self.feed(PortLost(line, "no such device"))
            return
        self.buses[line].open = True
        self._all("opened", line)
        self.feed(PortOpened(line))

    def unplug(self, line: str, seconds: float) -> None:
        """The port of a line goes away for so long."""
        bus = self.buses[line]
        self.plugged[line] = False

        def back() -> None:
            self.plugged[line] = True

        self.clock.at(self.clock.now + seconds, back)
        if bus.open:
            bus.open = False
            self._all("closed", line)
            self.feed(PortLost(line, "gone"))

    def _recorded(self, events: Sequence[Recorded]) -> None:
        for event in events:
            if not event.problem:
                self.seen.flushed(event.number)
                self._all("flushed", event.number)
            else:
                self.seen.dropped(event.number)
            self.feed(event)

    # -- clients

    def join(self, name: str, ceiling: Role) -> int:
        """A client connects; its session."""
        self._sessions += 1
        self._all("joined", self._sessions)
        self.feed(Joined(self._sessions, name, ceiling))
        return self._sessions

    def leave(self, session: int) -> None:
        """A client's connection is gone."""
        self._all("left", session)
        self.feed(Left(session))

    def ask(self, session: int, request: Call) -> None:
        """A client asks."""
        self._all("asked", session, request)
        self.feed(Asked(session, request))

    # -- what happens on wires

    def heard(self, line: str, data: bytes) -> None:
        """Bytes arrived at a port; a process that stands still finds them there afterwards."""
        self._all("heard", line, data)
        if self.clock.now >= self.stalled_until:
            self.feed(Received(line, data))
        else:
            found = Received(line, data, self.instant().mono)
            self.clock.at(self.stalled_until, lambda life=self.seen.life: self._find(found, life))  # type: ignore[misc]

    def _find(self, found: Received, life: int) -> None:
        if life == self.seen.life and self.buses[found.line].open:
            self.feed(found)

    def answered(self, line: str, unit: int, answer: Answer) -> None:
        """A drive answers a read."""
        self.seen.answers[line, unit].append(answer)

    def did(self, line: str, unit: int, number: int, before: dict[int, int], after: dict[int, int]) -> None:
        """A drive took registers over."""
        frame = self.seen.by_number.get(number)
        if frame is not None:
            frame.done = self.clock.now
        self._all("did", line, unit, frame, before, after)

    def refused(self, line: str, unit: int, number: int) -> None:
        """A drive refuses a request."""
        frame = self.seen.by_number.get(number)
        if frame is not None:
            frame.refused = True

    # -- who looks on

    def _all(self, method: str, *args: Any) -> None:
        self.seen.now = self.clock.now
        for observer in self._hearers(method):
            getattr(observer, method)(*args)

    def _hearers(self, method: str) -> Iterable[Observer]:
        """The observers that want to know."""
        known = self.__dict__.setdefault("_known", {})
        if method not in known:
            plain = getattr(Observer, method)
            known[method] = [o for o in self.observers if getattr(type(o), method) is not plain]
        return known[method]  # type: ignore[no-any-return]

    @property
    def _stepping(self) -> Iterable[Observer]:
        return self._hearers("stepped")

    @property
    def _listening(self) -> Iterable[Observer]:
        return self._hearers("told")

    def _note(self, what: str, value: Any) -> None:
        """Into the trace."""
        self._hash.update(f"{self.clock.now!r} {what} ".encode())
        self._hash.update(_encode(_plain(value)))


def _plain(value: Any) -> Any:
    match value:
        case Received(line, data):
            return line, data
        case Asked(session, request):
            return session, request
        case Started() | Ticked():
            return type(value).__name__
        case Joined() | Left() | Recorded() | PortOpened() | PortLost():
            return msgspec.to_builtins(value)
    return value


__all__ = ["Box", "Report", "Response", "Violation"]
