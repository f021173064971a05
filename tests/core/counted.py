"""Writes in virtual time, counted: frames on the wire against intents on record (R1, R2, H3, H5).

The core, simulated drives, and the real ledger on a disk that fails, fills, tears and hangs; replies are
lost, and the gateway is killed at any instant, with the power or without. By hand, for as many as you like::

    python -m tests.core.counted --writes 100000 --seed 1

Nothing is estimated: at each kill it is written down which intents had no frame yet, and which frames of
stops had no intent on the disk yet; but for those, both sides have to be equal, frame by frame.
"""

from __future__ import annotations

import argparse
import contextlib
import logging
import math
import random
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from gateway.bridge.messages import Done, RunCommand, WriteTag
from gateway.core.audit import check
from gateway.core.chain import lines_of
from gateway.core.core import Core
from gateway.core.events import Asked, Record, Recorded, Started, Tell, Transmit
from gateway.core.ledger import Found, Ledger
from gateway.core.runs import Boot
from gateway.core.scribe import RETRY_SECONDS, Scribe
from gateway.simulator.faults import DropReply
from tests.core.faultydisk import FaultyDisk
from tests.core.world import ENGINEER, RESTART_SECONDS, World, make_site

WRITES = 2000
"""Writes of one scene."""
DRIVES = 3
LATER = 0.0002
"""Seconds from a flush to the moment at which the core hears of it."""
ROTATE = 32 * 1024
UNDER_WAY = 40
KNOWN = 100
"""Intents of frames that were sent, kept in case that they are said to be unsent."""
REPEATED = 15
"""Commands asked for again after a kill."""

Frame = tuple[int, int, tuple[int, ...]]
"""Unit, address and words of a write."""


@dataclass(slots=True)
class Intent:
    """An intent of the present life: its frame, and whether it is on the disk and was sent."""

    frame: Frame
    durable: bool = False
    sent: bool = False


def frame_of(intent: dict[str, Any]) -> Frame:
    """The frame that an intent is about."""
    words = tuple(int(word[:-1], 16) for word in intent["words"])
    return intent["unit"], int(intent["address"][:-1], 16), words


class Counted(World):
    """A world whose journal is the real one, on a disk of its own."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        self.disk = FaultyDisk()
        self.wrong: list[str] = []
        self.intents: dict[int, Intent] = {}
        """By the number of their record, of this life."""
        self.cut: Counter[Frame] = Counter()
        """Intents that had no frame when the gateway was killed."""
        self.excused: Counter[Frame] = Counter()
        """Frames that waited for no record and had none on the disk when the gateway was killed."""
        self.outcomes: Counter[str] = Counter()
        self.under_way = 0
        self.stated: list[dict[str, Any]] = []
        """The intents that stand for a frame, once all is over."""
        self.kills = 0
        self.failed = 0
        self._queue: list[Record] = []
        self._numbers: dict[int, dict[str, Any]] = {}
        self._flush_at = math.inf
        self.slow = 0.0
        """Seconds that the disk takes."""
        self._open()
        super().__init__(make_site(DRIVES))

    def _open(self) -> Found:
        self.ledger = Ledger(self.disk, rotate=ROTATE, keep=100_000)
        self.scribe = Scribe(self.ledger, self._report, "data")
        return self.ledger.open()

    # -- the journal

    def _record(self, record: Record) -> None:
        if record.entry["kind"] == "intent":
            self.intents[record.number] = Intent(frame_of(record.entry))
            self._numbers[record.number] = record.entry
        elif record.entry["kind"] == "unsent":
            self._take_back(record.entry)
        self._queue.append(record)
        self._flush_at = min(self._flush_at, self.now + max(self.slow, self.chance.uniform(0.0, 0.01)))

    def _take_back(self, unsent: dict[str, Any]) -> None:
        """The core says that a frame did not go after all: its intent stands for none."""
        for number, intent in self.intents.items():
            entry = self._numbers[number]
            if (entry["ask"], entry["frame"]) == (unsent["ask"], unsent["frame"]):
                twins = [i for i in self.intents.values() if i.frame == intent.frame and not i.sent]
                if intent.sent and not twins:
                    self.wrong.append(f"{entry} is said to be unsent, and was sent")
                for twin in twins[:1]:  # of two that are the same, nobody can tell which one was sent
                    twin.sent = True

    def _flush(self) -> None:
        for record in self._queue:
            self.scribe.take(record)
        self._queue.clear()
        self.scribe.flush()
        self._flush_at = self.now + RETRY_SECONDS if self.scribe.waiting else math.inf

    def _report(self, events: Sequence[Recorded]) -> None:
        for event in events:
            self._later.append((self.now + LATER, event))
            if event.number in self.intents:
                self.intents[event.number].durable = not event.problem
            self.failed += bool(event.problem)

    def _next_due(self) -> float:
        return max(self.now, min(super()._next_due(), self._flush_at))

    def _step(self) -> None:
        super()._step()
        if self._flush_at <= self.now:
            self._flush()

    # -- the wire

    def _carry_out(self, action: Any) -> None:
        if isinstance(action, Transmit) and action.data[1] in (0x06, 0x10):
            self._sent(action.data)
        super()._carry_out(action)
        if isinstance(action, Tell):
            if isinstance(action.message, Done):
                self.outcomes[action.message.outcome.cause.value or "confirmed"] += 1
                self.under_way -= 1
            self.told[action.session].clear()

    def ask(self, request: WriteTag | RunCommand) -> None:
        """A client asks."""
        self.under_way += 1
        self.feed(Asked(self.session, request))

    def _sent(self, data: bytes) -> None:
        frame = on_wire(data)
        waiting = [i for i in self.intents.values() if i.frame == frame and not i.sent]
        durable = [intent for intent in waiting if intent.durable]
        if not waiting or not (durable or is_harmless(frame)):
            self.wrong.append(
                f"{self.now:.3f} s: {data.hex(' ')} is on the wire before its intent is on the disk"
            )
        for intent in (durable or waiting)[:1]:
            intent.sent = True
        done = [number for number, i in self.intents.items() if i.sent and i.durable]
        for number in done[: max(0, len(done) - KNOWN)]:
            del self.intents[number], self._numbers[number]

    # -- the end of a life

    def kill(self) -> None:
        """The gateway is killed here and now, perhaps in the middle of a write to the disk; half the time
        the power fails too."""
        self.kills += 1
        self.cut += Counter(i.frame for i in self.intents.values() if not i.sent)
        self.excused += Counter(i.frame for i in self.intents.values() if i.sent and not i.durable)
        fails, stopped = self.disk.fails, self.chance.choice(("none", "open", "append", "sync", "in place"))
        self.disk.fails = lambda operation: operation == stopped
        with contextlib.suppress(OSError):
            if self._queue:
                self.ledger.write([record.entry for record in self._queue])
        self.disk.fails = fails
        if self.chance.random() < 0.5:
            chance, room = self.chance, self.disk.room
            self.disk = self.disk.crash(
                lambda count: chance.randint(0, count), chance.random() < 0.3, lambda _: chance.random() < 0.5
            )
            self.disk.fails, self.disk.room = fails, room
        self.restart()

    def restart(self) -> None:
        self._later, self._queue, self._flush_at = [], [], math.inf
        self.intents, self._numbers = {}, {}
        self.now += RESTART_SECONDS
        self.simulated.advance(self.now)
        self.core = Core(self.site, "test")
        fails, self.disk.fails = self.disk.fails, lambda operation: False
        found = self._open()
        self.disk.fails = fails
        if found.broken:
            self.wrong.append(f"the journal is broken: {found.broken}")
        boot = Boot(id=f"boot-{self.kills}", machine="machine")
        self.feed(Started(found.memory, boot, cut=found.cut))
        self.under_way = 0
        self.session = self.join()
        self.run(0.01)  # the port opens

    # -- the account

    def entries(self) -> list[dict[str, Any]]:
        """Everything on record."""
        files = [bytes(self.disk.files[name].now) for name in sorted(self.disk.files)]
        return [line.entry for data in files for line in lines_of(data) if line.entry is not None]

    def frames(self) -> Counter[Frame]:
        """Every write frame that was on the wire."""
        sent = (bytes.fromhex(text.replace(" ", "")) for _, text in self.wire)
        return Counter(on_wire(data) for data in sent if data[1] in (0x06, 0x10))

    def faults(self) -> Iterator[str]:
        """What is wrong between wire and record, when all is over."""
        yield from self.wrong
        yield from (f"{b.file}:{b.line}: {b.problem}" for b in check(self.disk).breaks)
        entries = self.entries()
        self.stated = intents = stated(entries)
        recorded, wire = Counter(frame_of(entry) for entry in intents), self.frames()
        yield from (f"not on record: {frame}" for frame in (wire - recorded - self.excused).elements())
        yield from (f"never sent: {frame}" for frame in (recorded - wire - self.cut).elements())
        lives: dict[str, set[str]] = {}
        for entry in intents:
            if "id" in entry:
                lives.setdefault(entry["id"], set()).add(entry["boot"])
        yield from (f"{id} was sent in {len(boots)} lives" for id, boots in lives.items() if len(boots) > 1)
        outcomes = Counter(entry["ask"] for entry in entries if entry["kind"] == "outcome")
        yield from (f"ask {ask} has {count} outcomes" for ask, count in outcomes.items() if count > 1)
        asks = {entry["ask"] for entry in intents if "outcome" not in entry}
        yield from (f"ask {ask} has no outcome" for ask in asks - set(outcomes))


def stated(entries: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The intents that stand for a frame."""
    unsent = {(e["ask"], e["frame"]) for e in entries if e["kind"] == "unsent"}
    return [e for e in entries if e["kind"] == "intent" and (e["ask"], e["frame"]) not in unsent]


def on_wire(data: bytes) -> Frame:
    """The write in a frame."""
    body = data[7:-2] if data[1] == 0x10 else data[4:6]
    words = tuple(int.from_bytes(body[at : at + 2], "big") for at in range(0, len(body), 2))
    return data[0], int.from_bytes(data[2:4], "big"), words


def is_harmless(frame: Frame) -> bool:
    """A stop, a setpoint of zero, the end of a pulse: none of them waits for the disk for long."""
    _, address, words = frame
    return (address == 1 and not words[0] & 0x8) or (address, words) == (2, (0,))


class Scene:
    """So many writes on one site, from a seed."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.world = Counted(self.chance)
        self.world.run(2.0)
        self.asked: list[WriteTag | RunCommand] = []
        self._calm_at = math.inf

    def play(self, writes: int) -> list[str]:
        """Ask for so many; everything that was wrong."""
        world, chance = self.world, self.chance
        for number in range(writes):
            request = self._request(number)
            if request.key:
                self.asked.append(request)
            world.ask(request)
            world.run(chance.choice((0.0, 0.05, 0.1, 0.2)))
            while world.under_way > UNDER_WAY:
                world.run(0.2)
            self._disturb()
        self._heal()
        world.run(60.0)
        return list(world.faults())

    def _request(self, number: int) -> WriteTag | RunCommand:
        """What is asked. Each value comes once in a scene, where it is one."""
        chance, value = self.chance, (number % 5900 + 1) / 100
        drive, key = f"fan-{chance.randint(1, DRIVES)}", f"id-{number}"
        name, wanted = chance.choices(
            (
                ("frequency_command", value),
                ("frequency_command", 0.0),
                ("input_5", chance.random() < 0.5),
                ("input_6", chance.random() < 0.5),
                ("preset_frequency_2", value),
                ("run_forward", {"frequency": value}),
                ("reset_fault", {}),
                ("stop", {}),
            ),
            (40, 4, 14, 14, 6, 10, 4, 8),
        )[0]
        if isinstance(wanted, dict):
            return RunCommand(number, drive, name, wanted, ENGINEER, 5.0, "" if name == "stop" else key)
        return WriteTag(number, f"{drive}.{name}", wanted, ENGINEER, 5.0, key)

    def _disturb(self) -> None:
        world, chance = self.world, self.chance
        if world.now >= self._calm_at:
            self._heal()
        if chance.random() < 0.02:
            world.drives[f"fan-{chance.randint(1, DRIVES)}"].faults.inject(DropReply())
        if self._calm_at == math.inf and chance.random() < 0.01:
            self._calm_at = world.now + chance.uniform(0.5, 5.0)
            what, share = chance.choice(("fails", "full", "slow")), chance.choice((0.2, 0.6, 1.0))
            if what == "fails":
                world.disk.fails = lambda operation: chance.random() < share
            elif what == "full":
                world.disk.room = chance.randint(0, 2000)
            else:
                world.slow = chance.uniform(0.2, 7.0)
        if chance.random() < 0.01:
            world.run(chance.uniform(0.0, 0.1))
            world.kill()
            for request in self.asked[-REPEATED:]:
                world.ask(request)

    def _heal(self) -> None:
        world = self.world
        world.disk.fails, world.disk.room, world.slow = (lambda operation: False), None, 0.0
        self._calm_at = math.inf


def counted(writes: int, seed: int) -> tuple[list[str], Counter[str]]:
    """So many writes, scene by scene: what was wrong, and the account."""
    logging.disable(logging.CRITICAL)
    wrong: list[str] = []
    account: Counter[str] = Counter()
    for begun in range(0, writes, WRITES):
        scene = Scene(seed + begun)
        wrong += [f"seed {seed + begun}: {fault}" for fault in scene.play(min(WRITES, writes - begun))]
        world = scene.world
        frames, intents = world.frames(), Counter(map(frame_of, world.stated))
        account["frames on the wire"] += frames.total()
        account["intents on record"] += intents.total()
        account["intents without a frame, at kills"] += (intents - frames).total()
        account["frames of stops without an intent, at kills"] += (frames - intents).total()
        account["kills"] += world.kills
        account["entries that the disk refused"] += world.failed
        account += world.outcomes
    logging.disable(logging.NOTSET)
    return wrong, account


def main() -> int:
    """Count by hand; the exit code is 1 if anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--writes", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    begun = time.monotonic()
    wrong, account = counted(args.writes, args.seed)
    print(*wrong[:20], sep="\n", end="\n" if wrong else "")
    print(", ".join(f"{name}: {count}" for name, count in account.items()))
    print(f"{args.writes} writes, {time.monotonic() - begun:.0f} s: {len(wrong)} faults")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
