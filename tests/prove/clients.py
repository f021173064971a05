"""The clients in the box: an adapter like OPC UA's, one like MQTT's, and who speaks through them."""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from gateway.bridge.api import LeaseAct
from gateway.bridge.messages import (
    Act,
    Call,
    ClientGone,
    DoLease,
    Done,
    Maintain,
    ReadTags,
    Response,
    RunCommand,
    Watch,
    WriteTag,
)
from gateway.mapping.site import DriveConfig
from gateway.tag import Origin, Outcome, Role, Value
from tests.prove import people
from tests.prove.people import EPOCH, Office, Person, hostile_message
from tests.prove.scene import CLIENT_ACTS
from tests.prove.seen import Request
from tests.prove.site import SETPOINT, switches, watchable

if TYPE_CHECKING:
    from tests.prove.box import Box

ADAPTERS = {"opcua": Role.ADMIN, "mqtt": Role.OPERATOR}
STARTS_AFTER = 0.5
TTL = 5.0
REPEATED_WITHIN = 55.0
"""Seconds after its outcome within which the same command under the same id is a repetition."""


class Clients:
    """All clients of a world."""

    def __init__(self, box: Box) -> None:
        self.box = box
        self.sessions: dict[str, int] = {}
        self.people = people.everybody()
        self._office: Office | None = None
        self._last = 0
        self._recent: deque[Request] = deque(maxlen=40)
        self._waiting: dict[tuple[int, int], tuple[Request, Callable[[Outcome], None] | None]] = {}
        self._rng = random.Random(f"clients {box.scene.seed}")
        self._wants = {name: self._wanted() for name in ADAPTERS}

    def _wanted(self) -> dict[str, float]:
        box, rng = self.box, self._rng
        wanted = {}
        for drive in box.site.drives:
            names = watchable(drive.profile.name)
            few = rng.sample(names, min(box.scene.watched, len(names)))
            wanted |= {f"{drive.name}.{name}": rng.choice(box.scene.rates) for name in few}
            wanted |= {f"{drive.name}.{SETPOINT}": box.scene.rates[0]}
        return wanted

    # -- coming and going

    def began(self) -> None:
        """The core runs: adapters connect."""
        for name in ADAPTERS:
            self._connect_later(name)

    def died(self) -> None:
        """The core is gone, and all that was asked of it."""
        self.sessions.clear()
        self._waiting.clear()
        self._office = None

    def _connect_later(self, name: str) -> None:
        life = self.box.seen.life

        def connect() -> None:
            if life == self.box.seen.life and self.box.core is not None and name not in self.sessions:
                self._connect(name)

        self.box.clock.at(self.box.clock.now + self._rng.uniform(0.05, STARTS_AFTER), connect)

    def _connect(self, name: str) -> None:
        session = self.box.join(name, ADAPTERS[name])
        if self.box.core is None:
            return  # it died of that step
        self.sessions[name] = session
        self.ask(name, Watch(self.next_id(), dict(self._wants[name])))
        if name == "mqtt" and self.box.core is not None:
            self._office = Office(self)

    def drop(self, name: str) -> None:
        """An adapter dies; it is started again."""
        session = self.sessions.pop(name, None)
        if session is None:
            return
        self._waiting = {k: v for k, v in self._waiting.items() if k[0] != session}
        for person in self.people:
            person.visits += person.through == name
        self.box.leave(session)
        self._connect_later(name)

    def go(self, rng: random.Random) -> None:
        """A client of the OPC UA adapter vanishes, or ends his session; he comes back under another."""
        person = rng.choice([p for p in self.people if p.through == "opcua"])
        self.ask("opcua", ClientGone(self.next_id(), person.origin, rng.random() < 0.5))
        person.visits += 1

    # -- asking

    def next_id(self) -> int:
        """A number for a request."""
        self._last += 1
        return self._last

    def ask(self, name: str, call: Call) -> None:
        """Something is asked through an adapter, if it is there."""
        session = self.sessions.get(name)
        if session is not None and self.box.core is not None:
            self.box.ask(session, call)

    def commit(
        self,
        name: str,
        ask: WriteTag | RunCommand,
        hostile: str = "",
        done: Callable[[Outcome], None] | None = None,
    ) -> Request | None:
        """A write or command is asked through an adapter."""
        session = self.sessions.get(name)
        if session is None or self.box.core is None:
            return None
        key = ask.key or f"#{ask.id}"
        requests = self.box.seen.requests
        if key not in requests or self._is_forgotten(requests[key]):
            owner = ask.target.partition(".")[0] if isinstance(ask, WriteTag) else ask.drive
            drive = next((d for d in self.box.site.drives if d.name == owner), None)
            online = drive is not None and self.box.buses[drive.line].open
            requests[key] = Request(
                key, self.box.clock.now, ask, drive, session, self.box.seen.life, hostile, online
            )
            self._recent.append(requests[key])
            self.box.count(f"asked: {'hostile' if hostile else 'command'}")
        else:
            self.box.count("asked: again under the same id")
        self._waiting[session, ask.id] = requests[key], done
        self.box.ask(session, ask)
        return requests[key]

    def _is_forgotten(self, request: Request) -> bool:
        """Nothing of it was sent, and the core died before it was on the disk: nobody can know its id."""
        if request.life == self.box.seen.life or request.frames:
            return False
        return not any(entry.get("id") == request.key for entry in self.box.safe.entries())

    def told(self, session: int, message: Response) -> None:
        """The core tells a client something."""
        if not isinstance(message, Done):
            return
        request, done = self._waiting.pop((session, message.id), (None, None))
        if request is not None:
            request.told.append((self.box.clock.now, message.outcome))
        if done is not None:
            done(message.outcome)

    @property
    def waiting(self) -> list[Request]:
        """What was asked and has no outcome."""
        return [request for request, _ in self._waiting.values()]

    # -- acting

    def acts(self, what: str) -> bool:
        """True if this is something that clients do."""
        return what in CLIENT_ACTS

    def act(self, what: str, rng: random.Random) -> None:
        """Somebody does something."""
        drive = rng.choice(self.box.site.drives)
        getattr(self, f"_{what}")(drive, rng.choice(self.people), rng)

    def calm(self) -> None:
        """In the end somebody commands each drive, and it obeys (`observers.Recovered`)."""

    def write(self, tag: str, value: Value, person: Person, ttl: float = TTL, hostile: str = "") -> None:
        """Somebody writes; through MQTT by a message."""
        number = self.next_id()
        key = f"k{number}"
        if person.through == "mqtt" and self._office is not None and ttl == TTL and not hostile:
            drive, _, name = tag.partition(".")
            self._office.publish(drive, name, {"id": key, "v": value, "epoch": EPOCH, "by": person.name})
            return
        self.commit(person.through, WriteTag(number, tag, value, person.origin, ttl, key), hostile)

    def command(self, drive: str, name: str, person: Person, ttl: float = TTL, **args: Value) -> None:
        """Somebody gives a command; through MQTT by a message."""
        number = self.next_id()
        key = f"k{number}"
        if person.through == "mqtt" and self._office is not None and ttl == TTL:
            order = {"id": key, "args": args, "epoch": EPOCH, "by": person.name}
            self._office.publish(drive, name, order)
            return
        self.commit(person.through, RunCommand(number, drive, name, args, person.origin, ttl, key))

    def _setpoint(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        value = rng.choice((0.0, round(rng.uniform(0.0, 50.0), 1), round(rng.uniform(0.0, 50.0), 2)))
        self.write(f"{drive.name}.{SETPOINT}", value, person, rng.choice((TTL, TTL, 1.0, 0.2)))

    def _bit(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        point = rng.choice(switches(drive.profile.name))
        self.write(f"{drive.name}.{point.name}", rng.random() < 0.7, person)

    def _run(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        name = rng.choice(("run_forward", "run_forward", "run_reverse"))
        self.command(drive.name, name, person, frequency=round(rng.uniform(1.0, 50.0), 1))

    def _stop(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        self.command(drive.name, "stop", person)

    def _command(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        names = [c.name for c in drive.profile.commands.values() if not c.args and not c.urgent]
        wanted = "take_control" if "take_control" in names and rng.random() < 0.6 else rng.choice(names)
        self.command(drive.name, wanted, person)

    def _stream(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        at = self.box.clock.now
        for _ in range(rng.randint(5, 20)):
            value = round(rng.uniform(0.0, 50.0), 1)
            tag = f"{drive.name}.{SETPOINT}"
            self.box.clock.at(at, lambda value=value, tag=tag: self.write(tag, value, person))  # type: ignore[misc]
            at += rng.uniform(0.02, 0.4)

    def _replay(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        old = [request for request in self._recent if request.ask.key and self._is_known(request)]
        if not old:
            return
        first = rng.choice(old)
        ask = first.ask
        number = self.next_id()
        if isinstance(ask, WriteTag):
            again: WriteTag | RunCommand = WriteTag(
                number, ask.target, ask.value, ask.origin, ask.ttl, ask.key
            )
        else:
            again = RunCommand(number, ask.drive, ask.name, ask.args, ask.origin, ask.ttl, ask.key)
        self.commit(ask.origin.through, again)

    def _is_known(self, request: Request) -> bool:
        """Its id still means it and no later command: not so after a minute, nor for sure where a clock was
        set, which decides how long a restart of the machine took."""
        since = request.told[0][0] if request.told else request.at
        return self.box.clock.now - since < REPEATED_WITHIN and self.box.clock_set <= request.at

    def _hasty(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        """Somebody commands, and has the right to it no more before it is on the wire."""
        (self._setpoint if rng.random() < 0.5 else self._run)(drive, person, rng)
        bert = next(p for p in self.people if p.role is Role.ENGINEER)
        number, name, origin = self.next_id(), drive.name, person.origin
        calls: tuple[Call, ...] = (
            DoLease(number, name, LeaseAct.RELEASE, origin, ""),
            DoLease(number, name, LeaseAct.TAKE, bert.origin, ""),
            Maintain(number, name, True, bert.origin, "box"),
        )
        call = rng.choice(calls)

        def then() -> None:
            self.ask("opcua" if call is not calls[0] else person.through, call)

        self.box.clock.at(self.box.clock.now + rng.choice((0.0, 0.001, 0.01, 0.05)), then)
        if call is calls[2]:
            self.box.clock.at(self.box.clock.now + 2.0, lambda: self.maintain(drive, False))

    def _lease(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        acts = (LeaseAct.ACQUIRE, LeaseAct.ACQUIRE, LeaseAct.RENEW, LeaseAct.RELEASE, LeaseAct.TAKE)
        self.ask(person.through, DoLease(self.next_id(), drive.name, rng.choice(acts), person.origin, ""))

    def _read(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        names = rng.sample(watchable(drive.profile.name), 3)
        tags = tuple(f"{drive.name}.{name}" for name in names)
        self.ask(person.through, ReadTags(self.next_id(), tags, rng.choice((0.0, 0.0, 5.0))))

    def _watch(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        """Somebody wants more, or less, or at another rate."""
        name = person.through
        wanted = self._wants[name]
        changes: dict[str, float | None] = {}
        for point in rng.sample(watchable(drive.profile.name), 3):
            tag = f"{drive.name}.{point}"
            changes[tag] = None if tag in wanted and rng.random() < 0.5 else rng.choice(self.box.scene.rates)
        for tag, period in changes.items():
            if period is None:
                wanted.pop(tag, None)
            else:
                wanted[tag] = period
        self.ask(name, Watch(self.next_id(), changes))

    def _hostile(self, drive: DriveConfig, person: Person, rng: random.Random) -> None:
        key = f"k{self.next_id()}"
        if rng.random() < 0.5 and self._office is not None:
            wall = self.box.instant().wall
            why, payload, extras = hostile_message(rng, key, wall)
            self.box.count(f"hostile: {why}")
            self._office.publish(drive.name, SETPOINT, payload, why, **extras)
            return
        setpoint = f"{drive.name}.{SETPOINT}"
        viewer = Origin(through="opcua", who="mallory", role=Role.VIEWER, session="m")
        someone = Origin(through="opcua", who="mallory", role=Role.OPERATOR, session="m")
        why, tag, value, origin, ttl = rng.choice(
            (
                (
                    "out of range",
                    setpoint,
                    rng.choice((-0.01, 50.01, 1e300, math.inf, math.nan)),
                    someone,
                    TTL,
                ),
                ("wrong type", setpoint, rng.choice(("50", True, None)), someone, TTL),
                ("wrong role", setpoint, 20.0, viewer, TTL),
                ("stale", setpoint, 20.0, someone, rng.choice((0.0, -1.0))),
                ("read-only", f"{drive.name}.running", True, someone, TTL),
                ("unknown", f"{drive.name}.nothing", 1, someone, TTL),
                ("the gateway's own", f"{drive.name}._locked", True, someone, TTL),
                ("by command only", f"{drive.name}.run_command", 1, someone, TTL),
                ("no such drive", f"z-9.{SETPOINT}", 1.0, someone, TTL),
            )
        )
        self.box.count(f"hostile: {why}")
        self.commit("opcua", WriteTag(self.next_id(), tag, value, origin, ttl, key), why)

    def maintain(self, drive: DriveConfig, on: bool) -> None:
        """Maintenance is switched."""
        bert = next(p for p in self.people if p.role is Role.ENGINEER)
        self.ask(bert.through, Maintain(self.next_id(), drive.name, on, bert.origin, "box"))


__all__ = ["ADAPTERS", "Act", "Clients"]
