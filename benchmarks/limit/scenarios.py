"""What is measured: plants, what happens on them, and what is to be reached."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from benchmarks.limit.measure import measure_use
from benchmarks.limit.peers import measure_peer
from benchmarks.limit.plant import Plant
from benchmarks.limit.product import Running, running
from benchmarks.limit.writes import measure_flood, measure_latency, measure_share, measure_stream

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Scenario:
    """A plant, the seconds that it gets to settle, and what is then measured."""

    name: str
    plant: Callable[[], Plant]
    settle: float
    measure: Callable[[Running, float], Row]

    def run(self, seconds: float) -> Row:
        """Measure once."""
        with running(self.plant()) as gateway:
            time.sleep(self.settle)
            return {"scenario": self.name, **self.measure(gateway, seconds)}


def use(least: float) -> Callable[[Running, float], Row]:
    """Measure the use of the lines, of which at least this share is to be reached."""

    def measure(gateway: Running, seconds: float) -> Row:
        found = asdict(measure_use(gateway, seconds))
        return {**found, "wanted": least, "reached": found["ratio"] >= least and not found["violations"]}

    return measure


@dataclass(frozen=True, slots=True)
class Peer:
    """Somebody else on the same plant."""

    name: str
    peer: str
    plant: Callable[[], Plant]
    settle: float = 3.0

    def run(self, seconds: float) -> Row:
        """Measure once."""
        return {"scenario": self.name, **measure_peer(self.peer, self.plant(), self.settle, seconds)}


def sixteen_lines() -> Plant:
    """As many as one core has to carry."""
    return Plant(lines=16, drives=8, baud=115200, form="8N1")


SCENARIOS: tuple[Scenario | Peer, ...] = (
    Peer("peer: bare loop, one drive", "bare", lambda: Plant(drives=1)),
    Peer("peer: bare loop, eight drives", "bare", lambda: Plant(drives=8)),
    Peer("peer: bare loop, sixteen lines", "bare", sixteen_lines),
    Peer("peer: pymodbus, eight drives", "pymodbus", lambda: Plant(drives=8)),
    Peer("peer: pymodbus, one of 8 silent", "pymodbus", lambda: Plant(drives=8, silent=1), 12.0),
    Scenario("one drive", lambda: Plant(drives=1), 5, use(0.99)),
    Scenario("eight drives", lambda: Plant(drives=8), 8, use(0.99)),
    Scenario(
        "sixteen lines of eight, 115200 8N1",
        sixteen_lines,
        15,
        use(0.97),
    ),
    Scenario("one of eight silent", lambda: Plant(drives=8, silent=1), 20, use(0.97)),
    Scenario("three of eight silent", lambda: Plant(drives=8, silent=3), 30, use(0.97)),
    Scenario("ten of 32 silent", lambda: Plant(drives=32, silent=10), 60, use(0.97)),
    Scenario("write latency", lambda: Plant(drives=8), 8, measure_latency),
    Scenario("stop behind 1000 writes", lambda: Plant(drives=8), 8, measure_flood),
    Scenario("setpoint stream", lambda: Plant(drives=8), 8, measure_stream),
    Scenario("reads beside writes", lambda: Plant(drives=8), 8, measure_share),
)
