"""A line in the box: the wire with its faults, the drives from their profiles, a foreign master."""

from __future__ import annotations

import random
from collections import Counter
from typing import Protocol

from gateway.mapping.profile import Kind, NumberType, Point, Profile
from gateway.mapping.site import DriveConfig, LineConfig
from gateway.simulator.build import build_drives
from gateway.simulator.drive import Drive as Twin
from gateway.simulator.happening import Options
from gateway.simulator.model import TwinModel
from tests.line.storm.drives import Drive, Foreigner
from tests.line.storm.frames import FRAMINGS, READ, WRITE_MANY, WRITE_ONE, Ascii, Rtu
from tests.line.storm.weather import FLIPS, Faults, Weather
from tests.line.storm.wire import Clock, Wire
from tests.prove.scene import FRAME_FAULTS, LineScene
from tests.prove.seen import Answer, Frame

CALM = dict.fromkeys(FRAME_FAULTS, 0.0)
RESTLESS = 1000
"""Raw values that what is only shown goes through."""
TURN = 0.1
"""Seconds between the moments at which a motor is looked at: to show all of a drive costs more than to answer
for it."""


class Watching(Protocol):
    """Who is told of all that happens on wires."""

    def heard(self, line: str, data: bytes) -> None:
        """Bytes arrived at the gateway's port."""

    def answered(self, line: str, unit: int, answer: Answer) -> None:
        """A drive made its answer to a read."""

    def did(self, line: str, unit: int, number: int, before: dict[int, int], after: dict[int, int]) -> None:
        """A drive took over registers; request 0 is a foreigner's."""

    def refused(self, line: str, unit: int, number: int) -> None:
        """A drive answers a request with an error."""


class Quick(TwinModel):
    """A drive's model that looks at nothing while no time passes."""

    def step(self, now: float) -> None:
        """Let time pass up to ``now``."""
        if now != self._now or self._happenings:
            super().step(now)


class Station(Drive):
    """A drive on the wire that answers what the twin of its profile answers, in the way of its kind."""

    def __init__(self, line: Bus, twin: Twin, profile: Profile, *parts: object) -> None:
        super().__init__(twin.unit, *parts)  # type: ignore[arg-type]
        self.twin = twin
        twin.model.__class__ = Quick
        self.restarted = -1.0
        """When it was switched off and on last."""
        self._line = line
        self._number = 0
        self._looked = 0.0
        self._answers = 0
        self._restless = restless(profile)

    def _reply(self, content: bytes, number: int) -> bytes | None:
        self._number = number
        reply = super()._reply(content, number)
        if reply is not None and reply[1] & 0x80:
            self._line.watching.refused(self._line.name, self.unit, number)
        return reply

    def _content(self, content: bytes) -> bytes | None:
        framing, now, bank = self._framing, self._clock.now, self.twin.model.bank
        looked = self.looked_at(now)
        written = _registers_written(content)
        if written:
            self.twin.step(looked)
        before = {at: bank.present(at) for at in written if at in bank.words or at in bank.written}
        reply = framing.unpack(self.twin.handle(framing.pack(content), looked) or b"")
        if reply is not None and content[1] == READ and reply[1] == READ:
            reply = self._never_the_same(content, reply)
        watching, name = self._line.watching, self._line.name
        if reply is not None and content[1] == READ and reply[1] == READ:
            words = tuple(int.from_bytes(reply[at : at + 2], "big") for at in range(3, len(reply), 2))
            watching.answered(name, self.unit, Answer(now, int.from_bytes(content[2:4], "big"), words))
        if self.twin.model.away:
            self.restarted = now
        elif written and not (reply is not None and reply[1] & 0x80):
            watching.did(name, self.unit, self._number, before, written)
        return reply

    def _never_the_same(self, content: bytes, reply: bytes) -> bytes:
        """What is only shown differs in each answer, so that no old answer looks like a new one."""
        self._answers += 1
        first, shown = int.from_bytes(content[2:4], "big"), bytearray(reply)
        for at in range(3, len(reply), 2):
            address = first + (at - 3) // 2
            if address in self._restless:
                shown[at : at + 2] = ((self._answers * 7 + address) % RESTLESS).to_bytes(2, "big")
        return bytes(shown)

    def looked_at(self, now: float) -> float:
        """The drive's own time: it goes in steps, and never back."""
        self._looked = max(self._looked, now - now % TURN)
        return self._looked


def restless(profile: Profile) -> frozenset[int]:
    """Registers that show a plain number nothing depends on."""
    alone = Counter(point.address for point in profile.points.values())
    return frozenset(
        p.address for p in profile.points.values() if alone[p.address] == 1 and _is_shown_only(p)
    )


def _is_shown_only(point: Point) -> bool:
    encoding = point.encoding
    number = not (encoding.width or encoding.values or encoding.times or encoding.words > 1)
    plain = not (point.cases or point.when or point.select) and encoding.type is NumberType.U16
    return (
        number
        and plain
        and "frequency" not in point.name
        and not point.access.writable
        and point.kind in (Kind.MEASUREMENT, Kind.COUNTER)
    )


def _registers_written(content: bytes) -> dict[int, int]:
    """The registers that a request writes, by address."""
    first = int.from_bytes(content[2:4], "big")
    if content[1] == WRITE_ONE:
        return {first: int.from_bytes(content[4:6], "big")}
    if content[1] != WRITE_MANY:
        return {}
    words = content[7:]
    return {first + n: int.from_bytes(words[2 * n : 2 * n + 2], "big") for n in range(len(words) // 2)}


class Bus:
    """A line. ``hear`` hears what comes in at the gateway's port."""

    def __init__(
        self, clock: Clock, config: LineConfig, scene: LineScene, seed: str, watching: Watching
    ) -> None:
        self.name = config.name
        self.watching = watching
        self.open = False
        self._clock = clock
        flips = 1 if scene.framing == "ascii" else FLIPS
        self.faults = Faults(scene.weather, random.Random(f"faults {seed}"), flips)
        self.framing: Rtu | Ascii = FRAMINGS[scene.framing]()  # type: ignore[assignment]
        self.character = config.format.bits_per_character / config.baud
        self.wire = Wire(clock, scene.weather, self.character, random.Random(f"wire {seed}"), self._arrived)
        options = Options(acceleration=1.0, deceleration=1.0, fast_deceleration=0.5)
        twins = build_drives(config, {drive.name: options for drive in config.drives})
        parts = (clock, self.wire, self.framing, self.faults)
        self.stations = {
            twin.unit: Station(
                self, twin, unit_of(config, name).profile, *parts, random.Random(f"{twin.unit} {seed}")
            )
            for name, twin in twins.items()
        }
        self._foreigner = Foreigner(*parts, random.Random(f"foreigner {seed}"))
        self._last_read: tuple[Drive, bytes] | None = None
        self._foreigner.start(list(self.stations.values()), lambda: self._last_read)
        self._echoes = scene.weather.echo != "none"

    def transmit(self, data: bytes, number: int) -> Frame:
        """The gateway speaks."""
        content = self.framing.unpack(data)
        assert content is not None, f"no frame: {data.hex()}"
        station = self.stations.get(content[0])
        if station is not None and content[1] == READ:
            self._last_read = station, content
        carried = self.faults.carried(data)
        reaches = (lambda: station.hear(data, number)) if station and carried == data else None
        begins = self._clock.now
        end = self.wire.say(carried if self._echoes else data, reaches, audible=self._echoes)
        written = _registers_written(content)
        return Frame(
            number=number,
            line=self.name,
            at=begins,
            end=max(end, begins + len(data) * self.character),
            data=data,
            unit=content[0],
            function=content[1],
            address=int.from_bytes(content[2:4], "big"),
            words=tuple(written.values()),
            count=int.from_bytes(content[4:6], "big"),
        )

    def intrude(self, unit: int, address: int, word: int) -> None:
        """A foreign master writes a register."""
        content = bytes((unit, WRITE_MANY)) + address.to_bytes(2, "big") + b"\0\1\2" + word.to_bytes(2, "big")
        data = self.framing.pack(content)
        self.wire.say(data, lambda: self.stations[unit].hear(data, 0))

    def calm(self) -> None:
        """No more faults."""
        kind = self.faults.weather.kind
        self.faults.weather = Weather(kind=kind)
        for station in self.stations.values():
            station.on = True

    def _arrived(self, data: bytes) -> None:
        if data and self.open:
            self.watching.heard(self.name, data)


def unit_of(line: LineConfig, drive: str) -> DriveConfig:
    """The drive of that name."""
    return next(each for each in line.drives if each.name == drive)
