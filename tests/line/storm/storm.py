"""The storm itself: a `Line` on a sick wire, and whether all that it tells is true."""

from __future__ import annotations

import random
from collections import Counter, deque
from dataclasses import dataclass, field
from itertools import count, takewhile
from typing import Literal, NamedTuple

from gateway.line.interface import (
    Action,
    Answered,
    BlockFailed,
    BlockRead,
    ClosePort,
    Job,
    JobDone,
    JobSent,
    LineSettings,
    OpenPort,
    Priority,
    Read,
    Refused,
    Transmit,
    UnitFacts,
    Want,
    Write,
)
from gateway.line.line import Line
from gateway.mapping.profile import SerialFormat
from tests.line.storm.drives import SLOTS, Drive, Foreigner, place, slot
from tests.line.storm.frames import FRAMINGS
from tests.line.storm.weather import FLIPS, Faults, Weather, draw
from tests.line.storm.wire import Clock, Wire

Framing = Literal["rtu", "ascii", "tcp"]
FRAMING_NAMES: tuple[Framing, ...] = ("rtu", "ascii", "tcp")
WRITABLE = 0x1C0


class Sent(NamedTuple):
    """A request of ours: its number, when it began, and its bytes."""

    number: int
    at: float
    data: bytes


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A line and what is wanted of it: so many drives, each asked for reads of one length."""

    seed: int
    weather: Weather
    framing: Framing = "rtu"
    baud: int = 9600
    drives: int = 1
    blocks: int = 6
    length: int = 2
    wide: bool = True
    """Registers beside those wanted may be read too."""
    single: bool = True
    """Each register is a want of its own, so that a block may be read in parts."""
    loop_back: bool = False
    reply_max: float = 1.0
    writes: float = 0.0
    """Writes and reads on request per second."""
    period: float = 0.001


def scene_of(seed: int) -> Scene:
    """The scene of a seed."""
    rng = random.Random(f"scene {seed}")
    reply_max = rng.choice((0.2, 1.0))
    framing: Framing = rng.choices(FRAMING_NAMES, (8, 1, 1))[0]
    return Scene(
        seed=seed,
        framing=framing,
        weather=draw(rng, reply_max, framing),
        baud=rng.choice((9600, 9600, 38400, 115200)),
        drives=rng.choice((1, 1, 2, 4)),
        blocks=rng.choice((2, 4, 6)),
        length=rng.choice((1, 2, 4)),
        wide=rng.random() < 0.7,
        single=rng.random() < 0.5,
        loop_back=rng.random() < 0.4,
        reply_max=reply_max,
        writes=rng.choice((0.0, 1.0)),
        period=rng.choice((0.001, 0.1)),
    )


@dataclass
class Report:
    """What was found."""

    transactions: int = 0
    good: int = 0
    seconds: float = 0.0
    counts: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)


class Storm:
    """One scene, played."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.report = Report()
        self.clock = Clock()
        rng = random.Random(f"storm {scene.seed}")
        self._rng = rng
        flips = 1 if scene.framing == "ascii" else FLIPS  # two may cancel in an LRC
        self._faults = Faults(scene.weather, random.Random(f"faults {scene.seed}"), flips)
        self._framing = FRAMINGS[scene.framing]()
        form = SerialFormat(8, "N", 2)
        character = 0.0 if scene.framing == "tcp" else form.bits_per_character / scene.baud
        self.wire = Wire(
            self.clock, scene.weather, character, random.Random(f"wire {scene.seed}"), self._heard
        )
        parts = (self.clock, self.wire, self._framing, self._faults)
        self.drives = {u: Drive(u, *parts, random.Random(f"{u} {scene.seed}")) for u in self._units()}
        settings = LineSettings(
            name="storm",
            framing=scene.framing,
            baud=scene.baud,
            format=form,
            echo=scene.weather.echo == "declared",
        )
        self.line = Line(settings, [self._facts(unit) for unit in self.drives])
        self._foreigner = Foreigner(*parts, random.Random(f"foreigner {scene.seed}"))
        self._sent: deque[Sent] = deque(maxlen=16)
        self._numbers = count(1)
        self._jobs = count(1)
        self._asked: dict[int, tuple[Read | Write, int]] = {}
        self._writes: dict[int, dict[int, bytes]] = {unit: {} for unit in self.drives}
        self._last_read: tuple[Drive, bytes] | None = None

    def run(self, transactions: int) -> Report:
        """Play until so many requests were sent."""
        self._begin()
        line, clock = self.line, self.clock
        while line.counters.requests < transactions:
            wake = line.wake()
            if wake is not None and wake <= clock.next():
                clock.now = max(clock.now, wake)
                self._carry_out(line.tick(clock.now))
            else:
                clock.happen()
        self.report.transactions = line.counters.requests
        self.report.seconds = clock.now - 100.0
        self.report.counts = self._faults.counts + self.report.counts
        self.report.counts["timeouts"] = line.counters.timeouts
        self.report.counts["damaged"] = line.counters.damaged
        return self.report

    def _begin(self) -> None:
        wants = [want for unit in self.drives for want in self._wants(unit)]
        self._carry_out(self.line.demand(wants, self.clock.now))
        self._carry_out(self.line.start(self.clock.now))
        self._foreigner.start(list(self.drives.values()), lambda: self._last_read)
        self._hang_up_later()
        if self.scene.writes:
            self._ask_later()

    # The scene

    def _units(self) -> list[int]:
        return [5 + unit for unit in range(self.scene.drives)]

    def _starts(self) -> list[int]:
        return [0x10 + 0x18 * block for block in range(self.scene.blocks)]

    def _facts(self, unit: int) -> UnitFacts:
        scene = self.scene
        blocks = tuple((start, start + scene.length - 1) for start in self._starts())
        functions = (3, 6, 8, 16) if scene.loop_back else (3, 6, 16)
        return UnitFacts(
            unit=unit,
            functions=functions,
            read_max=16,
            write_max=16,
            write_one=6 if unit % 2 else 16,
            readable=((0, 0x1FF),) if scene.wide else blocks,
            probe=(self._starts()[0], 1),
            loop_back=scene.loop_back,
            reply_usual=0.01,
            reply_max=scene.reply_max,
        )

    def _wants(self, unit: int) -> list[Want]:
        step = 1 if self.scene.single else self.scene.length
        return [
            Want(unit, start + part, step, self.scene.period)
            for start in self._starts()
            for part in range(0, self.scene.length, step)
        ]

    def _ask_later(self) -> None:
        self.clock.at(self.clock.now + self._rng.expovariate(self.scene.writes), self._ask)

    def _ask(self) -> None:
        unit = self._rng.choice(list(self.drives))
        if self._rng.random() < 0.5:
            start = self._rng.choice(self._starts())
            request: Read | Write = Read(unit, start, self._rng.randint(1, self.scene.length))
        else:
            words = tuple(self._rng.randrange(4) for _ in range(self._rng.randint(1, 2)))
            request = Write(unit, WRITABLE + self._rng.randrange(2), words)
        job = Job(
            next(self._jobs),
            request,
            self._rng.choice((Priority.STOP, Priority.COMMAND, Priority.READ)),
            self.clock.now + 5.0,
        )
        self._asked[job.id] = (request, 0)
        self._carry_out(self.line.ask(job, self.clock.now))
        self._ask_later()

    def _hang_up_later(self) -> None:
        if self.scene.weather.hang_ups:
            self.clock.at(self.clock.now + self._rng.expovariate(self.scene.weather.hang_ups), self._hang_up)

    def _hang_up(self) -> None:
        self._faults.counts["hang_ups"] += 1
        self._carry_out(self.line.port_lost("hung up", self.clock.now))
        self._hang_up_later()

    # The wire

    def _carry_out(self, actions: list[Action]) -> None:
        for action in actions:
            match action:
                case Transmit(data):
                    self._transmit(data)
                case BlockRead(unit, address, words, at):
                    self._check(unit, address, words, self._behind(at), at)
                case BlockFailed(unit, _, _, Refused(code), at):
                    self._check_refusal(unit, code, self._behind(at))
                case JobSent(id):
                    self._asked[id] = (self._asked[id][0], self._sent[-1].number)
                case JobDone(id, result, at):
                    self._check_job(*self._asked.pop(id), result, at)
                case OpenPort():
                    self.clock.at(
                        self.clock.now, lambda: self._carry_out(self.line.port_opened(self.clock.now))
                    )
                case ClosePort():
                    raise AssertionError("nobody stops the line")

    def _transmit(self, data: bytes) -> None:
        sent = Sent(next(self._numbers), self.clock.now, data)
        self._sent.append(sent)
        content = self._framing.unpack(data)
        assert content is not None
        drive = self.drives[content[0]]
        if content[1] == 3:
            self._last_read = drive, content
        elif content[1] in (6, 16):
            self._writes[drive.unit][sent.number] = content
        arrives = self._faults.carried(data) == data
        reaches = (lambda: drive.hear(data, sent.number)) if arrives else None
        echo = self.scene.weather.echo != "none"
        # the transceiver gives back what it sends; that may be damaged, but it is there
        self.wire.say((self._faults.carried(data) or data) if echo else data, reaches, audible=echo)

    def _heard(self, data: bytes) -> None:
        if data and self.line.is_open:
            self._carry_out(self.line.received(data, self.clock.now))

    # The truth

    def _behind(self, at: float) -> Sent:
        """The request that was on the wire at an instant."""
        return next(sent for sent in reversed(self._sent) if sent.at <= at)

    def _check(self, unit: int, address: int, words: tuple[int, ...], sent: Sent, at: float) -> None:
        self.report.good += 1
        for offset, word in enumerate(words):
            if word // SLOTS != place(unit, address + offset):
                self._complain("misattributed", f"{unit}:{address + offset:04X} = {word:04X}", sent)
                return
            if (word - slot(sent.at)) % SLOTS > (slot(at) - slot(sent.at)) % SLOTS:
                self._complain("stale", f"{unit}:{address + offset:04X} = {word:04X}", sent)
                return

    def _check_refusal(self, unit: int, code: int, sent: Sent) -> None:
        """A foreign master who asks the very same meanwhile is told what we would be."""
        drive, asked = self.drives[unit], self._framing.unpack(sent.data)
        same = [c for content, at, c in drive.refused_others if content == asked and at >= sent.at]
        if code not in (drive.refused.get(sent.number), *same):
            self._complain("refusal", f"{unit} {code:02X}", sent)

    def _check_job(self, request: Read | Write, number: int, result: object, at: float) -> None:
        sent = next((sent for sent in self._sent if sent.number == number), None)
        match result:
            case Answered(words) if isinstance(request, Read):
                assert sent is not None
                self._check(request.unit, request.address, words, sent, at)
                self.report.counts["reads on request"] += 1
            case Answered():
                self.report.counts["writes answered"] += 1
                if not self._done(request.unit, number):
                    self._complain("write", f"{request}", sent)
            case Refused(code):
                assert sent is not None
                self._check_refusal(request.unit, code, sent)

    def _done(self, unit: int, number: int) -> bool:
        """Did the drive do that write, or the very same one before it with no other between?"""
        writes = self._writes[unit]
        same = list(takewhile(lambda each: each[1] == writes[number], sorted(writes.items(), reverse=True)))
        return any(each in self.drives[unit].did for each, _ in same if each <= number)

    def _complain(self, what: str, words: str, sent: Sent | None) -> None:
        asked = sent.data.hex(" ") if sent else "?"
        self.report.counts[f"WRONG {what}"] += 1
        self.report.wrong.append(f"seed {self.scene.seed} at {self.clock.now:.3f}: {what} {words} ({asked})")
