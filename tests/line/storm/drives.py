"""Drives of three kinds, and a foreign master beside us."""

from __future__ import annotations

import random
from collections.abc import Callable

from tests.line.storm.frames import LOOP_BACK, READ, WRITE_MANY, WRITE_ONE, Ascii, Rtu, Tcp, read_request
from tests.line.storm.weather import Faults
from tests.line.storm.wire import Clock, Wire

SLOT = 0.1
"""Seconds after which every register holds another value."""
SLOTS = 128
BUSY = 6


def place(unit: int, address: int) -> int:
    """What of a value tells the unit and the address."""
    return (address * 37 + unit * 101) & 0x1FF


def slot(now: float) -> int:
    """What of a value tells the time."""
    return int(now / SLOT) % SLOTS


def value(unit: int, address: int, now: float) -> int:
    """What a register holds at an instant."""
    return place(unit, address) * SLOTS + slot(now)


class Drive:
    """Answers like its kind. ``did`` and ``refused`` hold the numbers of the requests that it carried out,
    and that it refused and how; ``refused_others`` what it refused to a foreign master, and when."""

    def __init__(
        self,
        unit: int,
        clock: Clock,
        wire: Wire,
        framing: Rtu | Ascii | Tcp,
        faults: Faults,
        rng: random.Random,
    ) -> None:
        self.unit = unit
        self.on = True
        self.did: set[int] = set()
        self.refused: dict[int, int] = {}
        self.refused_others: list[tuple[bytes, float, int]] = []
        self.delay: Callable[[], float] = lambda: rng.uniform(0.004, 0.012)
        self._clock, self._wire, self._framing, self._faults, self._rng = clock, wire, framing, faults, rng
        self._busy_until = 0.0

    def hear(self, frame: bytes, number: int) -> None:
        """A frame came in whole; ``number`` names the request if it is ours."""
        content = self._framing.unpack(frame)
        if not self.on or content is None or content[0] != self.unit:
            return
        now, kind = self._clock.now, self._faults.weather.kind
        if kind == "drop" and now < self._busy_until:
            return
        begin = max(now, self._busy_until) if kind == "queue" else now
        begin += self.delay() + self._faults.lateness()
        self._busy_until = begin if kind != "overlap" else 0.0
        if (answer := self._reply(content, number)) is None:
            return
        reply = self._framing.pack(answer, frame)
        self._clock.at(begin, lambda: self._answer(reply))

    def _answer(self, reply: bytes) -> None:
        faults = self._faults
        if faults.strikes("wrong_unit"):
            reply = self._framing.pack(
                bytes((self.unit % 247 + 1,)) + (self._framing.unpack(reply) or b"")[1:]
            )
        if carried := faults.noisy(faults.carried(reply)):
            end = self._wire.say(carried)
            if faults.weather.kind == "drop":
                self._busy_until = max(self._busy_until, end)

    def _reply(self, content: bytes, number: int) -> bytes | None:
        if self._faults.strikes("refused"):
            self.refused[number] = code = BUSY + number % 100
            if not number:
                self.refused_others.append((content, self._clock.now, code))
            return bytes((self.unit, content[1] | 0x80, code))
        self.did.add(number)
        return self._content(content)

    def _content(self, content: bytes) -> bytes | None:
        """What it answers; None: nothing."""
        function = content[1]
        if function in (WRITE_ONE, LOOP_BACK):
            return content
        if function == WRITE_MANY:
            return content[:6]
        assert function == READ, "nothing else was asked"
        first, many = int.from_bytes(content[2:4], "big"), int.from_bytes(content[4:6], "big")
        words = (value(self.unit, first + i, self._clock.now) for i in range(many))
        return bytes((self.unit, READ, 2 * many)) + b"".join(word.to_bytes(2, "big") for word in words)


class Foreigner:
    """A second master, who asks strangers and our own drives."""

    def __init__(
        self, clock: Clock, wire: Wire, framing: Rtu | Ascii | Tcp, faults: Faults, rng: random.Random
    ) -> None:
        self._clock, self._wire, self._framing, self._faults, self._rng = clock, wire, framing, faults, rng

    def start(self, drives: list[Drive], last_read: Callable[[], tuple[Drive, bytes] | None]) -> None:
        """Begin to ask."""
        weather = self._faults.weather
        self._drives, self._last_read = drives, last_read
        for name, rate, ask in (
            ("strangers", weather.strangers, self._ask_stranger),
            ("rivals", weather.rivals, self._ask_ours),
            ("twins", weather.twins, self._ask_the_same),
        ):
            if rate:
                self._later(name, rate, ask)

    def _later(self, name: str, rate: float, ask: Callable[[], bool]) -> None:
        def again() -> None:
            if getattr(self._faults.weather, name) and ask():
                self._faults.counts[name] += 1
            self._later(name, rate, ask)

        self._clock.at(self._clock.now + self._rng.expovariate(rate), again)

    def _ask_stranger(self) -> bool:
        rng, pack = self._rng, self._framing.pack
        unit = rng.choice([u for u in range(1, 40) if u not in {drive.unit for drive in self._drives}])
        many = rng.randint(1, 8)
        self._wire.say(self._faults.carried(pack(read_request(unit, rng.randrange(0x200), many))))
        reply = pack(bytes((unit, READ, 2 * many)) + rng.randbytes(2 * many))
        self._clock.at(
            self._wire.free_at + 0.01, lambda: self._wire.say(self._faults.carried(reply)) and None
        )
        return True

    def _ask_ours(self) -> bool:
        """Not damaged: of what nobody can hear nobody can beware."""
        if (last := self._last_read()) is None:
            return False
        drive, content = last
        other = (int.from_bytes(content[2:4], "big") + 64) % 0x180
        request = self._framing.pack(read_request(drive.unit, other, content[5]))
        self._wire.say(request, lambda: drive.hear(request, 0))
        return True

    def _ask_the_same(self) -> bool:
        if (last := self._last_read()) is None:
            return False
        drive, content = last
        request = self._framing.pack(content)
        self._wire.say(request, lambda: drive.hear(request, 0))
        return True
