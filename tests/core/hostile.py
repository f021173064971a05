"""Hostile commands in virtual time: through what really reads MQTT's payloads, into the core, onto a
simulated wire; and a model of its own that says what may be there. By hand, for as many as you like::

    python -m tests.core.hostile --commands 100000 --seed 1

The model knows nothing of the gateway's code. Every message that could do something carries a value that no
other message of its scene has, so that each frame on the wire belongs to one message, or to none.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import logging
import random
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from gateway.bridge.api import BridgeError
from gateway.bridge.messages import Done, RunCommand, TurnedAway, WriteTag
from gateway.core.events import Asked
from gateway.northbound.mqtt.commander import Commander
from gateway.northbound.mqtt.message import Incoming, Message
from gateway.northbound.mqtt.runner import Runner
from gateway.northbound.mqtt.topics import Topics
from gateway.tag import Origin, Outcome, Role, Value
from tests.core.world import START, World, make_site

COMMANDS = 400
"""Messages of one scene."""
UNITS = {"fan-1": 5, "fan-2": 6}
TTL = 5.0
"""Seconds that a command may wait, at most."""
SLACK = 0.02
"""Seconds between what is decided and the last byte before it on the wire."""

SETPOINT, RUN, STOP = "frequency_command", "run_forward", "stop"
Words = tuple[int, int, tuple[int, ...]]
"""Unit, address and words of a frame."""

RAW = ("NaN", "Infinity", "-Infinity", "1e999", "-1e999", str(2**53 + 2), str(10**40), str(-(2**63)))
BEYOND = (60.01, 61, -0.01, -1, -1e-9, 655.36, 6000, 1e9, 1e300, -1e300, 60.004)
TYPES: tuple[Any, ...] = ("30", "fast", True, False, None, [30], {"a": 1}, "", "0x10")
LOCKED = (("motor_rated_current", 70), ("access_level", 14), ("run_source", 1), ("comm_loss_action", 3))
"""Parameters, which an operator may not write."""
NOTHING = (("output_frequency", 10), ("running", True), ("frequency_comand", 10), ("run", True), ("0002H", 1))
"""What cannot be written, or is not there."""


@dataclass(slots=True)
class Attack:
    """A message, as the model sees it. ``number`` is its value in hundredths of a hertz; ``bad``: nothing
    makes it right."""

    drive: str
    name: str
    number: int
    payload: bytes
    bad: str = ""
    retain: bool = False
    exp: float | None = None
    epoch: str | None = None

    @property
    def words(self) -> Words:
        """The one frame that it may put on the wire."""
        unit = UNITS[self.drive]
        return (unit, 1, (1, self.number)) if self.name == RUN else (unit, 2, (self.number,))

    def until(self, now: float, epoch: str) -> float | None:
        """If it comes now, until when its frame may go; None: never."""
        fresh = self.epoch == epoch if self.epoch is not None else self.exp is not None
        near = self.exp is None or self.exp > now
        far = self.epoch is None and self.exp is not None and self.exp > now + 60.0
        if self.bad or self.retain or not fresh or not near or far:
            return None
        return min(now + TTL, self.exp if self.exp is not None else now + TTL)


class Way:
    """The bridge of an adapter that runs beside a world."""

    def __init__(self, world: World, ceiling: Role) -> None:
        self._world = world
        self._session = world.join("mqtt", ceiling)
        self._waiting: dict[int, asyncio.Future[Outcome]] = {}
        self._heard = self._last = 0
        self._gone = False

    async def write(
        self, tag: str, value: Value, origin: Origin, ttl: float = TTL, id: str = "", confirm: str = ""
    ) -> Outcome:
        return await self._ask(WriteTag(self._next(), tag, value, origin, ttl, id, confirm))

    async def command(
        self,
        drive: str,
        name: str,
        args: Any,
        origin: Origin,
        ttl: float = TTL,
        id: str = "",
        confirm: str = "",
    ) -> Outcome:
        return await self._ask(RunCommand(self._next(), drive, name, args, origin, ttl, id, confirm))

    def turned_away(self, what: str, wanted: Any, origin: Origin, outcome: Outcome) -> None:
        self._world.feed(Asked(self._session, TurnedAway(0, what, wanted, origin, outcome)))

    def hear(self) -> None:
        """Take in what the core told."""
        told = self._world.told[self._session]
        for message in told[self._heard :]:
            if isinstance(message, Done) and message.id in self._waiting:
                self._waiting.pop(message.id).set_result(message.outcome)
        self._heard = len(told)

    def end(self) -> None:
        """The adapter is cut off."""
        self._gone = True
        for future in self._waiting.values():
            future.set_exception(BridgeError("gone"))
        self._waiting.clear()

    def _next(self) -> int:
        self._last += 1
        return self._last

    async def _ask(self, request: WriteTag | RunCommand) -> Outcome:
        if self._gone:
            raise BridgeError("gone")
        future = self._waiting[request.id] = asyncio.get_running_loop().create_future()
        self._world.feed(Asked(self._session, request))
        self.hear()
        return await future


@dataclass
class Scene:
    """A site under attack, from a seed."""

    seed: int
    kinds: Counter[str] = field(default_factory=Counter)
    answers: Counter[str] = field(default_factory=Counter)
    _allowed: dict[Words, list[tuple[float, float]]] = field(default_factory=dict)
    _stopped: dict[int, float] = field(default_factory=dict)
    """By unit, when a stop was first asked for."""
    _sent: list[Attack] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.chance = random.Random(self.seed)
        self.world = World(make_site(2), journal_delay=self.chance.choice((0.0, 0.002, 0.05)))
        self.world.run(1.0)
        self.numbers = self.chance.sample(range(1, 6001), 2 * COMMANDS)
        self.epoch = self.old_epoch = ""
        self.connect()

    def connect(self) -> None:
        """The adapter is there, for the first time or again."""
        self.old_epoch, self.epoch = self.epoch, f"{self.chance.getrandbits(64):016x}"
        self.way = Way(self.world, Role.OPERATOR)
        catalogue = self.world.core.catalogue
        topics = Topics(catalogue.site, catalogue.gateway, catalogue.drives, catalogue.lines)
        runner = Runner(self.way, Role.OPERATOR, "mqtt://b:1883")  # type: ignore[arg-type]
        self.commander = Commander(
            topics,
            catalogue.owners,
            runner,
            self,
            self.world.instant,  # type: ignore[arg-type]
        )

    def put(self, message: Message) -> None:
        """An answer (as `Outbox`)."""
        if "/ack/" in message.topic:
            self.answers[json.loads(message.payload).get("cause") or "confirmed"] += 1

    async def play(self, commands: int = COMMANDS) -> list[str]:
        """Send so many messages; everything that was done wrongly."""
        for _ in range(commands):
            attack = self._next()
            self._deliver(attack)
            await self._pass(self.chance.choice((0.0, 0.0, 0.01, 0.05, 0.3)))
            if self.chance.random() < 0.005:
                self._disturb()
        await self._pass(40.0)
        return list(self._faults())

    async def _pass(self, seconds: float) -> None:
        for _ in range(3):
            await asyncio.sleep(0)  # the adapter's tasks begin
        self.world.run(seconds)
        self.way.hear()
        await asyncio.sleep(0)

    def _disturb(self) -> None:
        """The connection is lost; or the whole gateway is killed and starts again."""
        if self.chance.random() < 0.5:
            self.world.restart()
        self.way.end()
        self.connect()

    def _deliver(self, attack: Attack) -> None:
        now = self.world.now
        if attack.name == STOP and not attack.retain:
            self._stopped.setdefault(UNITS[attack.drive], now)
        elif (until := attack.until(now, self.epoch)) is not None:
            self._allowed.setdefault(attack.words, []).append((now, until))
        self.commander.receive(
            Incoming(
                topic=f"plant7/{attack.drive}/cmd/{attack.name}",
                payload=attack.payload,
                retain=attack.retain,
                epoch=self.epoch,
                arrived=self.world.instant(),
            )
        )

    # -- the messages

    def _next(self) -> Attack:
        kind = self.chance.choice(KINDS)
        self.kinds[kind] += 1
        attack: Attack = getattr(self, f"_{kind}")()
        return attack

    def _made(self, bad: str = "", name: str = "", value: Any = None, raw: str = "", **more: Any) -> Attack:
        """A message that is right but for what is said."""
        number = self.numbers.pop()
        name = name or self.chance.choice((SETPOINT, SETPOINT, RUN))
        value = number / 100 if value is None and not raw else value
        exp = more.pop("exp", self.world.now + self.chance.uniform(0.5, 50.0))
        epoch = more.pop("epoch", None)
        body: dict[str, Any] = {"id": more.pop("id", f"id-{number}"), "by": "mallory"}
        body |= {"args": {"frequency": value}} if name == RUN else {"v": value}
        if exp is not None:
            body["exp"] = self._as_time(exp)
        if epoch is not None:
            body["epoch"] = epoch
        body |= more.pop("also", {})
        payload = json.dumps({key: each for key, each in body.items() if each != "absent"})
        payload = payload.replace("null", raw) if raw else payload
        drive = self.chance.choice(list(UNITS))
        attack = Attack(drive, name, number, payload.encode(), bad, more.get("retain", False), exp, epoch)
        self._sent.append(attack)
        return attack

    def _as_time(self, seconds: float) -> float | int:
        """A moment of the world, in one of the ways to write it."""
        at = START / 1e9 + seconds
        return at if self.chance.random() < 0.5 else round(at * 1000)

    def _good(self) -> Attack:
        return self._made()

    def _of_this_epoch(self) -> Attack:
        return self._made(exp=None, epoch=self.epoch)

    def _stop(self) -> Attack:
        payload = self.chance.choice((b"", b"{", b'{"id": 1}', json.dumps({"id": self.seed}).encode()))
        return Attack(self.chance.choice(list(UNITS)), STOP, 0, payload)

    def _retained(self) -> Attack:
        return self._made(retain=True, name=self.chance.choice((SETPOINT, RUN)))

    def _stale(self) -> Attack:
        return self._made(exp=self.world.now - self.chance.choice((0.002, 0.5, 60.0, 86400.0, 1e6)))

    def _future(self) -> Attack:
        return self._made(exp=self.world.now + self.chance.choice((60.5, 3600.0, 1e6)))

    def _wrong_epoch(self) -> Attack:
        return self._made(epoch=self.chance.choice((self.old_epoch or "0" * 16, "", "f" * 16)))

    def _without_proof(self) -> Attack:
        return self._made(exp=None)

    def _repeated(self) -> Attack:
        """Anything that was sent before, again: right after it, or much later, and in any order."""
        return self.chance.choice(self._sent[-40:]) if self._sent else self._good()

    def _retried(self) -> Attack:
        """Anything that was sent before, under its id, but with a new end, as a client's retry is: carried
        out if the first one was not, and never twice."""
        known = [attack for attack in self._sent[-40:] if attack.bad != "malformed"]
        if not known:
            return self._good()
        first = self.chance.choice(known)
        exp = self.world.now + self.chance.uniform(0.5, 50.0)
        body = json.loads(first.payload) | {"exp": self._as_time(exp)}
        body.pop("epoch", None)
        payload = json.dumps(body).encode()
        return Attack(first.drive, first.name, first.number, payload, first.bad, exp=exp)

    def _reused(self) -> Attack:
        """Another value under an id that was used."""
        if not self._sent:
            return self._good()
        other = self.chance.choice(self._sent[-20:])
        made = self._made(id=f"id-{other.number}", name=other.name)
        made.drive, made.exp, made.bad = other.drive, made.exp, ""
        return made

    def _beyond(self) -> Attack:
        return self._made("range", value=self.chance.choice(BEYOND))

    def _no_number(self) -> Attack:
        return self._made("number", raw=self.chance.choice(RAW))

    def _of_another_type(self) -> Attack:
        value = self.chance.choice(TYPES)
        return self._made("type", raw="null") if value is None else self._made("type", value=value)

    def _of_another_role(self) -> Attack:
        name, value = self.chance.choice(LOCKED)
        return self._made("role", name=name, value=value)

    def _nothing(self) -> Attack:
        name, value = self.chance.choice(NOTHING)
        return self._made("unknown", name=name, value=value)

    def _malformed(self) -> Attack:
        attack = self._made("malformed")
        text = attack.payload
        attack.payload = self.chance.choice(
            (
                text[:-1],
                text + text,
                text[:-1] + b', "v": 10}' if attack.name == SETPOINT else text[:-1] + b', "args": {}}',
                b"[" * 2000 + b"]" * 2000,
                text[:-1] + b', "note": "' + b"x" * 5000 + b'"}',
                text[:-1] + b', "force": true}',
                b"\xff" + text,
                b"30",
            )
        )
        return attack

    def _without_id(self) -> Attack:
        return self._made("id", also={"id": "absent"})

    # -- the judge

    def _faults(self) -> Iterator[str]:
        """Frames that nobody may have sent."""
        for at, text in self.world.wire:
            data = bytes.fromhex(text.replace(" ", ""))
            if data[1] == 0x03 or data[1] == 0x08:
                continue
            if data[1] != 0x10:
                yield f"seed {self.seed}, {at:.3f} s: function {data[1]:02X}H: {text}"
                continue
            words = tuple(int.from_bytes(data[i : i + 2], "big") for i in range(7, 7 + data[6], 2))
            frame = (data[0], int.from_bytes(data[2:4], "big"), words)
            if frame[1:] == (1, (0,)) and self._stopped.get(frame[0], at + 1) <= at:
                continue
            spans = self._allowed.get(frame, [])
            fitting = [span for span in spans if span[0] <= at <= span[1] + SLACK]
            if not fitting:
                yield f"seed {self.seed}, {at:.3f} s: nobody may have sent {text} (allowed: {spans})"
            self._allowed[frame] = []  # once is enough


KINDS = (
    *("good",) * 4,
    *("of_this_epoch",) * 3,
    *("repeated",) * 4,
    *("retried",) * 3,
    *("stale", "future", "wrong_epoch", "without_proof", "retained") * 2,
    *("reused", "beyond", "no_number", "of_another_type", "of_another_role", "nothing"),
    *("malformed", "without_id", "stop"),
)


def attacked(commands: int, seed: int) -> tuple[list[str], Counter[str], Counter[str]]:
    """So many commands, scene by scene: what was done wrongly, what was sent, and what was answered."""
    logging.disable(logging.WARNING)
    wrong: list[str] = []
    kinds: Counter[str] = Counter()
    answers: Counter[str] = Counter()
    for begun in range(0, commands, COMMANDS):
        scene = Scene(seed + begun)
        wrong += asyncio.run(scene.play(min(COMMANDS, commands - begun)))
        kinds += scene.kinds
        answers += scene.answers
    logging.disable(logging.NOTSET)
    return wrong, kinds, answers


def main() -> int:
    """Attack by hand; the exit code is 1 if anything was done wrongly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--commands", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    begun = time.monotonic()
    wrong, kinds, answers = attacked(args.commands, args.seed)
    print(*wrong[:20], sep="\n", end="\n" if wrong else "")
    for title, counts in (("sent", kinds), ("answered", answers)):
        print(f"{title}:", ", ".join(f"{name} {count}" for name, count in counts.most_common()))
    print(f"{args.commands} commands, {time.monotonic() - begun:.0f} s: {len(wrong)} executed wrongly")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
