"""What a world is made of, all of it drawn from a seed: what there is, and what happens when."""

from __future__ import annotations

import random
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Literal, NamedTuple

from gateway.core.rarely import PATHS
from gateway.mapping.site import LeaseMode
from tests.line.storm.weather import KINDS, Weather

FRAME_FAULTS = (
    "late",
    "damage",
    "lost_byte",
    "doubled_byte",
    "lost_frame",
    "noise",
    "wrong_unit",
    "refused",
    "strangers",
    "rivals",
    "twins",
)
"""Kinds of `Weather` that strike at their own rate."""

CLIENT_ACTS = {
    "setpoint": 0.10,
    "bit": 0.06,
    "run": 0.05,
    "stop": 0.05,
    "stream": 0.01,
    "replay": 0.04,
    "hostile": 0.06,
    "lease": 0.05,
    "read": 0.02,
    "watch": 0.02,
    "command": 0.01,
    "hasty": 0.02,
}
"""What clients do, and how often in a second in all of a world."""

TROUBLES = {
    "crash": 0.012,
    "reboot": 0.004,
    "power": 0.01,
    "latched": 0.01,
    "away": 0.006,
    "trip": 0.006,
    "panel": 0.006,
    "intruder": 0.006,
    "unplugged": 0.006,
    "hang_up": 0.006,
    "stall": 0.02,
    "clock_jump": 0.01,
    "disk_fails": 0.008,
    "disk_full": 0.005,
    "disk_hangs": 0.005,
    "adapter_dies": 0.01,
    "client_goes": 0.015,
    "maintenance": 0.003,
}
"""What goes wrong beside the wire, and how often in a second."""

CALM_SECONDS = 100.0
"""Without faults at the end of a world: time in which everything has to recover."""


class Happening(NamedTuple):
    """Something that happens: what, when, and the number out of which its details are drawn."""

    at: float
    what: str
    number: int


@dataclass(frozen=True, kw_only=True)
class DriveScene:
    """A drive: what it is, and how it is set up."""

    profile: str
    lease: LeaseMode = "session"
    ttl: float = 5.0
    on_expiry: str = "stop"
    on_reappear: Literal["report", "stop"] = "report"


@dataclass(frozen=True, kw_only=True)
class LineScene:
    """A line, its drives, and the weather on it."""

    weather: Weather
    framing: Literal["rtu", "ascii"] = "rtu"
    baud: int = 9600
    drives: tuple[DriveScene, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A whole world. Times are seconds from its beginning."""

    seed: int
    seconds: float
    """Until the faults end; `CALM_SECONDS` more follow."""
    lines: tuple[LineScene, ...]
    rates: tuple[float, float, float] = (1.0, 4.0, 30.0)
    """Periods of fast, normal and slow points."""
    disk_delay: float = 0.003
    rare: Mapping[str, float] = field(default_factory=dict)
    """How often the core takes a rare path for no reason, when it comes by."""
    happenings: tuple[Happening, ...] = ()
    watched: int = 8
    """Points that an adapter watches of each drive."""
    notes: tuple[str, ...] = field(default=(), compare=False)

    @property
    def end(self) -> float:
        """When the world ends."""
        return self.seconds + CALM_SECONDS

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of faults and happenings in it."""
        weather = [name for name in FRAME_FAULTS if any(getattr(line.weather, name) for line in self.lines)]
        return (*weather, *dict.fromkeys(each.what for each in self.happenings))

    def without(self, kinds: Collection[str]) -> Scene:
        """The same world, but for these kinds."""
        gone = {name: 0.0 for name in FRAME_FAULTS if name in kinds}
        lines = tuple(replace(line, weather=replace(line.weather, **gone)) for line in self.lines)
        kept = tuple(each for each in self.happenings if each.what not in kinds)
        return replace(self, lines=lines, happenings=kept)


MUCH = {"hostile": {"hostile": 8.0, "replay": 2.0}, "crashes": {"crash": 0.12, "reboot": 0.03}}
"""What there may be much of, and how often it happens in a second then."""


def scene_of(seed: int, much: str = "") -> Scene:
    """The world of a seed, or one with much of something in it (`MUCH`)."""
    rng = random.Random(f"world {seed}")
    length = rng.uniform(60.0, 300.0)
    calm = rng.random() < 0.15
    lines = tuple(_line(rng, calm) for _ in range(rng.choice((1, 2, 3, 4))))
    fast = rng.choices((0.5, 2.0, 4.0, 8.0), (1, 3, 3, 3))[0]
    rates = fast, rng.choice((10.0, 20.0)), 30.0
    return Scene(
        seed=seed,
        seconds=length,
        lines=lines,
        rates=rates,
        disk_delay=rng.choice((0.001, 0.005, 0.05)),
        watched=rng.choice((2, 4, 8, 16)),
        rare={} if calm else dict(_rare(rng)),
        happenings=tuple(sorted(_happenings(rng, length, calm, MUCH.get(much, {})))),
    )


def _line(rng: random.Random, calm: bool) -> LineScene:
    framing: Literal["rtu", "ascii"] = "ascii" if rng.random() < 0.15 else "rtu"
    makes = ("shihlin-sl3",) if framing == "ascii" else ("teco-7200gs", "s2000", "shihlin-sl3")
    make = rng.choice((None, *makes))
    drives = tuple(_drive(rng, make or rng.choice(makes)) for _ in range(rng.choice((1, 1, 2, 3))))
    weather = Weather(kind=rng.choice(KINDS)) if calm else _weather(rng, framing)
    return LineScene(weather=weather, framing=framing, drives=drives)


def _drive(rng: random.Random, profile: str) -> DriveScene:
    return DriveScene(
        profile=profile,
        lease=rng.choice(("session", "session", "required", "off")),
        ttl=rng.choice((3.0, 6.0, 15.0)),
        on_expiry=rng.choice(("stop", "stop", "hold", "setpoint")),
        on_reappear=rng.choice(("report", "report", "stop")),
    )


def _weather(rng: random.Random, framing: str) -> Weather:
    """Each kind with its own rate, most of them absent."""

    def some(most: float) -> float:
        return most * 10 ** rng.uniform(-2.0, 0.0) if rng.random() < 0.4 else 0.0

    lost = some(0.03)
    return Weather(
        kind=rng.choice(KINDS),
        late=some(0.05),
        late_most=rng.choice((0.1, 0.5, 2.0, 5.0)),
        damage=some(0.05),
        lost_byte=lost,
        doubled_byte=0.0 if lost and framing == "ascii" else some(0.03),
        lost_frame=some(0.05),
        noise=some(0.05),
        wrong_unit=some(0.02),
        refused=some(0.02),
        strangers=some(1.0),
        rivals=some(0.2),
        twins=some(0.2),
        echo=rng.choice(("none", "none", "none", "declared", "noticed")),
        garble=rng.random() < 0.7,
        pieces=rng.choices(("whole", "split", "timer", "bytes"), (8, 7, 4, 1))[0],  # bytes are slow to play
    )


def _rare(rng: random.Random) -> Iterator[tuple[str, float]]:
    for path in PATHS:
        share = 0.2 * 10 ** rng.uniform(-2.0, 0.0)
        if rng.random() < 0.3:
            yield path, share


def _happenings(
    rng: random.Random, length: float, calm: bool, much: Mapping[str, float]
) -> Iterator[Happening]:
    for what, rate in (CLIENT_ACTS | TROUBLES).items():
        trouble = what in TROUBLES
        if trouble and (calm or rng.random() < 0.5) and what not in much:
            continue
        often = much.get(what) or rate * 10 ** rng.uniform(-0.7, 0.5)
        at = rng.expovariate(often)
        while at < length:
            yield Happening(at, what, rng.randrange(2**32))
            at += rng.expovariate(often)


def in_words(scene: Scene) -> Iterator[str]:
    """The world for people, a line of text each."""
    yield f"{scene.seconds:.1f} s and then {CALM_SECONDS:g} s without faults; rates {scene.rates}"
    for line in scene.lines:
        drives = ", ".join(f"{d.profile} ({d.lease}, {d.ttl:g} s, {d.on_expiry})" for d in line.drives)
        there = [f.name for f in fields(Weather) if getattr(line.weather, f.name) not in (0.0, f.default)]
        weather = ", ".join(f"{name} {getattr(line.weather, name)}" for name in there)
        yield f"{line.framing} at {line.baud}: {drives}; {weather}"
    for each in scene.happenings:
        yield f"{each.at:8.3f} {each.what}"
