"""What one run of a plant shows: use of the lines, silences, latencies."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from statistics import quantiles
from typing import Any

from benchmarks.limit.cpu import Cpu
from benchmarks.limit.ideal import Block, best_blocks, shares, use_of
from benchmarks.limit.plant import REGISTERS, Plant
from benchmarks.limit.product import Running


@dataclass(slots=True)
class Use:
    """Use of all lines of a plant together.

    ``ratio``: ideal line time of what was fetched of the drives that answer, by the time it took.
    ``transactions`` and ``registers`` per second, beside what is ideal. ``idle`` and ``late``: see
    `benchmarks.wire.tally.Tally`, in milliseconds. ``evenness``: of the ideal reads, how often the rarest was
    made beside the most frequent. ``cpu``: of each program, in per cent of a processor.
    """

    seconds: float
    ratio: float
    worst_line: float
    transactions: float
    ideal_transactions: float
    registers: float
    ideal_registers: float
    requests: int
    violations: int
    damaged: int
    unanswered: int
    refused: int
    evenness: float
    idle: dict[str, float]
    late: dict[str, float]
    notifications: float
    messages: float
    cpu: dict[str, float] = field(default_factory=dict)


def measure_use(running: Running, seconds: float) -> Use:
    """Count for so long what is on the wire of a gateway that runs."""
    cpu, before, began = Cpu(running.process), _news(running), time.monotonic()
    running.wire.count()
    time.sleep(seconds)
    tallies = running.wire.tally()
    took, after = time.monotonic() - began, _news(running)
    used = use_from(running.plant, tallies)
    used.notifications, used.messages = (round((b - a) / took, 1) for a, b in zip(before, after, strict=True))
    used.cpu = cpu.per_cent()
    return used


def use_from(plant: Plant, tallies: dict[str, dict[str, Any]]) -> Use:
    """The use that tallies of a plant's lines show."""
    wire = plant.wire(plant.names[0])
    worth, blocks = shares(REGISTERS, wire), best_blocks(REGISTERS, wire)
    cycle = sum(block.cost(wire) for block in blocks)
    spans = {name: tally["last"] - tally["first"] for name, tally in tallies.items()}
    ratios = [use_of(tallies[name]["reads"], worth, spans[name]) for name in tallies]
    lines, seconds = len(tallies), sum(spans.values()) / len(tallies)
    reads: Counter[str] = Counter()
    for tally in tallies.values():
        reads.update(tally["reads"])
    answered = [
        times for line in tallies.values() for key, times in line["reads"].items() if _is_one(blocks, key)
    ]
    return Use(
        seconds=round(seconds, 2),
        ratio=sum(ratios) / lines,
        worst_line=min(ratios),
        transactions=round(sum(reads.values()) / seconds, 2),
        ideal_transactions=round(lines * len(blocks) / cycle, 2),
        registers=round(sum(n * int(key.rsplit(",", 1)[1]) for key, n in reads.items()) / seconds, 2),
        ideal_registers=round(lines * len(REGISTERS) / cycle, 2),
        **{what: sum(tally[what] for tally in tallies.values()) for what in COUNTED},
        evenness=round(min(answered) / max(answered), 3) if answered else 0.0,
        idle=distribution([value for tally in tallies.values() for value in tally["idle"]]),
        late=distribution([value for tally in tallies.values() for value in tally["late"]]),
        notifications=0.0,
        messages=0.0,
    )


def _is_one(blocks: list[Block], key: str) -> bool:
    _, address, count = map(int, key.split(","))
    return Block(address, count) in blocks


COUNTED = ("requests", "violations", "damaged", "unanswered", "refused")


def distribution(seconds: list[float]) -> dict[str, float]:
    """Mean and quantiles in milliseconds."""
    if len(seconds) < 2:
        return {}
    at = quantiles(seconds, n=100, method="inclusive")
    named = {
        "mean": sum(seconds) / len(seconds),
        "p50": at[49],
        "p90": at[89],
        "p99": at[98],
        "max": max(seconds),
    }
    return {name: round(1000 * value, 3) for name, value in named.items()}


def _news(running: Running) -> tuple[int, int]:
    return running.opcua.ask(count=True)["notifications"], running.mqtt.ask(count=True)["messages"]


def log_of(folder: Path) -> str:
    """The end of the gateway's log, for when something went wrong."""
    return (folder / "gateway.log").read_text(encoding="utf-8")[-2000:]
