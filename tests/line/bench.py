"""A line in virtual time: simulated units, a wire that takes its time, a log of every action.

Frames are built here apart from `gateway.modbus`, so that neither hides the other's mistakes. The wire
complains by itself when a request is sent too early.
"""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import count

from gateway.line.interface import (
    Action,
    BlockRead,
    ClosePort,
    Job,
    JobDone,
    LineSettings,
    OpenPort,
    Priority,
    Read,
    Result,
    Transmit,
    UnitFacts,
    Want,
    Write,
)
from gateway.line.line import Line
from gateway.mapping.profile import SerialFormat

SETTINGS = LineSettings(name="north", framing="rtu", baud=9600, format=SerialFormat(8, "N", 2))
CHARACTER = 11 / 9600
SILENCE = 3.5 * CHARACTER


def facts(unit: int = 5, **changes: object) -> UnitFacts:
    """A unit like a 7200GS."""
    base: dict[str, object] = {
        "functions": (3, 16),
        "read_max": 16,
        "write_max": 16,
        "write_one": 16,
        "readable": ((0x01, 0x02), (0x20, 0x24), (0x27, 0x2D), (0x31, 0x33)),
        "probe": (0x20, 1),
        "reply_usual": 0.005,
        "reply_max": 1.0,
    }
    return UnitFacts(unit=unit, **{**base, **changes})  # type: ignore[arg-type]


def frame(body: bytes) -> bytes:
    """``body`` with its CRC, bit by bit as the standard tells it."""
    register = 0xFFFF
    for byte in body:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0xA001 if register & 1 else 0)
    return body + register.to_bytes(2, "little")


@dataclass
class FakeUnit:
    """Answers like a drive. ``delay`` is its turnaround; attributes may be changed while it runs."""

    unit: int = 5
    delay: float = 0.005
    on: bool = True
    refuse: dict[int, int] = field(default_factory=dict)
    """Exception code per function."""
    damage: bool = False
    functions: tuple[int, ...] = (3, 16)
    registers: dict[int, int] = field(default_factory=dict)
    late: Callable[[], float] = lambda: 0.0
    """More seconds before this answer; answers stay in order."""
    writes: list[tuple[int, tuple[int, ...]]] = field(default_factory=list)
    before: bytes = b""
    distort: Callable[[bytes], bytes] = lambda reply: reply
    """What becomes of its replies on the wire."""
    busy_until: float = 0.0

    def answer(self, request: bytes) -> bytes | None:
        if not self.on or request[0] not in (self.unit, 0) or frame(request[:-2]) != request:
            return None
        reply = self._reply(request)
        if request[0] == 0:
            return None
        if self.damage:
            reply = reply[:-1] + bytes((reply[-1] ^ 1,))
        return self.distort(self.before + reply)

    def _reply(self, request: bytes) -> bytes:
        function = request[1]
        code = self.refuse.get(function, 0 if function in self.functions else 1)
        if code:
            return frame(bytes((self.unit, function | 0x80, code)))
        address, number = int.from_bytes(request[2:4], "big"), int.from_bytes(request[4:6], "big")
        if function in (6, 8):
            if function == 6:
                self._write(address, (number,))
            return request
        if function == 16:
            body = request[7:-2]
            self._write(
                address, tuple(int.from_bytes(body[i : i + 2], "big") for i in range(0, len(body), 2))
            )
            return frame(request[:6])
        words = b"".join(self.registers.get(address + i, 0).to_bytes(2, "big") for i in range(number))
        return frame(bytes((self.unit, function, len(words))) + words)

    def _write(self, address: int, words: tuple[int, ...]) -> None:
        self.writes.append((address, words))
        self.registers.update({address + i: word for i, word in enumerate(words)})


class Bench:
    """A `Line`, its units, and the events between them."""

    def __init__(
        self,
        units: Sequence[UnitFacts],
        fakes: Sequence[FakeUnit],
        settings: LineSettings = SETTINGS,
        admit: Callable[[int], bool] = lambda job_id: True,
    ) -> None:
        self.line = Line(settings, units, admit)
        self.fakes = {fake.unit: fake for fake in fakes}
        self.twins: list[FakeUnit] = []
        """Further drives, at the addresses of others."""
        self.arrives: Callable[[float], float] = lambda at: at
        """When the host gets bytes whose last bit arrived at an instant."""
        self.lag: Callable[[], float] = lambda: 0.0
        """Seconds from the decision to send until the request leaves: the host had something else to do."""
        self.now = 100.0
        self.log: list[tuple[float, Action]] = []
        self.wire: list[tuple[float, bool, bytes]] = []
        self.port = True
        self.echo = False
        self.busy = 0.0
        """Seconds that the wire carried requests, replies or the silence of turnarounds."""
        self._events: list[tuple[float, int, Callable[[], list[Action]]]] = []
        self._order = count()
        self._ids = count(1)
        self._last_bit = 0.0
        self.quiet = True
        """Complain about requests without the silence before them; not where noise makes that impossible."""

    def start(self, *wants: Want) -> Bench:
        """Open the port and demand."""
        self._carry_out(self.line.demand(wants, self.now))
        self._carry_out(self.line.start(self.now))
        return self

    def demand(self, *wants: Want) -> None:
        self._carry_out(self.line.demand(wants, self.now))

    def ask(
        self,
        request: Read | Write,
        priority: Priority = Priority.COMMAND,
        ttl: float | None = None,
    ) -> int:
        """Ask now; the job's id."""
        job_id = next(self._ids)
        deadline = None if ttl is None else self.now + ttl
        self._carry_out(self.line.ask(Job(job_id, request, priority, deadline), self.now))
        return job_id

    def at(self, when: float, do: Callable[[], list[Action] | None]) -> None:
        """Let something happen later."""
        heapq.heappush(self._events, (when, next(self._order), lambda: do() or []))

    def run(self, seconds: float) -> None:
        """Let time pass."""
        until = self.now + seconds
        while True:
            wake = self.line.wake()
            times = [t for t in (wake, self._events[0][0] if self._events else None) if t is not None]
            if not times or min(times) > until:
                break
            assert min(times) >= self.now - 1e-9 or wake == min(times)
            self.now = max(self.now, min(times))
            if self._events and self._events[0][0] <= self.now:
                self._carry_out(heapq.heappop(self._events)[2]())
            else:
                before = (
                    self.line.counters.requests,
                    self.line.counters.timeouts,
                    self.line.counters.damaged,
                )
                ahead = self.line.look_ahead(self.now)
                actions = self.line.tick(self.now)
                sent = [action.data for action in actions if isinstance(action, Transmit)]
                assert ahead in (b"", *sent), "what was foretold was not sent"
                self._carry_out(actions)
                after = (self.line.counters.requests, self.line.counters.timeouts, self.line.counters.damaged)
                assert actions or before != after or self.line.wake() != wake, "woken for nothing"
        self.now = until

    def unplug(self) -> None:
        self.port = False
        self._carry_out(self.line.port_lost("unplugged", self.now))

    def of(self, kind: type[Action]) -> list:  # type: ignore[valid-type,type-arg]
        """The logged actions of a kind, in order."""
        return [action for _, action in self.log if isinstance(action, kind)]

    def times(self, kind: type[Action]) -> list[float]:  # type: ignore[valid-type]
        return [at for at, action in self.log if isinstance(action, kind)]

    def result(self, job_id: int) -> Result | None:
        """What was told of a job; None while nothing was. Telling twice is an error."""
        results = [action.result for action in self.of(JobDone) if action.id == job_id]
        assert len(results) <= 1
        return results[0] if results else None

    def values(self, address: int) -> list[int]:
        """What planned reads said of a register, in order."""
        return [
            block.words[address - block.address]
            for block in self.of(BlockRead)
            if block.address <= address < block.address + len(block.words)
        ]

    def transcript(self) -> str:
        """The wire as text."""
        return "".join(f"{'>>' if sent else '<<'} {data.hex(' ').upper()}\n" for _, sent, data in self.wire)

    def _carry_out(self, actions: list[Action]) -> None:
        for action in actions:
            self.log.append((self.now, action))
            if isinstance(action, Transmit):
                self._transmit(action.data)
            elif isinstance(action, OpenPort):
                self.at(self.now + 0.001, self._open)
            elif isinstance(action, ClosePort):
                self.port = False

    def _open(self) -> list[Action]:
        if self.port:
            return self.line.port_opened(self.now)
        return self.line.port_lost("no such port", self.now)

    def _transmit(self, data: bytes) -> None:
        if lag := self.lag():
            self.now += lag
            self.line.leaves(self.now)
        assert not self.quiet or self.now - self._last_bit >= SILENCE - 1e-9, (
            "a request without the silence before it"
        )
        self.wire.append((self.now, True, data))
        ends = self.now + len(data) * CHARACTER
        self._last_bit = ends
        if self.echo:
            self.receive(data, ends)
        for fake in (*self.fakes.values(), *self.twins):
            if (reply := fake.answer(data)) is not None:
                begins = max(ends, fake.busy_until) + fake.delay + fake.late()
                fake.busy_until = begins
                self.receive(reply, begins + len(reply) * CHARACTER)

    def receive(self, data: bytes, at: float) -> None:
        """Bytes whose last bit arrives at an instant."""

        def arrive() -> list[Action]:
            self._last_bit = max(self._last_bit, self.now)
            self.wire.append((self.now, False, data))
            return self.line.received(data, self.now) if self.line.is_open else []

        self.at(self.arrives(at), arrive)


def seeded(seed: int) -> random.Random:
    return random.Random(seed)
