"""A proof: as many worlds as time allows on all processors, and the report of what was found."""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

from tests.line.storm.storm import Storm
from tests.line.storm.storm import scene_of as storm_of
from tests.prove.box import Box, Report
from tests.prove.plants import PLANTS, Found, search
from tests.prove.scene import CALM_SECONDS, scene_of

LEAST = {"transactions": 1_000_000, "hostile": 100_000, "crashes": 1_000}
"""Faulty transactions on a sick line, commands that may not pass, and deaths of the core in any case."""
PER_STORM = 5_000
Task = tuple[str, int]


@dataclass
class Result:
    """What came of one task."""

    task: Task
    cpu: float
    report: Report | None = None
    transactions: int = 0
    storm_counts: Counter[str] = field(default_factory=Counter)
    storm_wrong: list[str] = field(default_factory=list)


def play(task: Task) -> Result:
    """One world, or one storm."""
    kind, seed = task
    began = time.process_time()
    if kind == "storm":
        storm = Storm(storm_of(seed)).run(PER_STORM)
        cpu = time.process_time() - began
        return Result(task, cpu, None, storm.transactions, storm.counts, storm.wrong[:3])
    report = Box(scene_of(seed, kind)).run()
    return Result(task, time.process_time() - began, report)


@dataclass
class Tally:
    """Everything together."""

    cpu: float = 0.0
    world_cpu: float = 0.0
    worlds: Counter[str] = field(default_factory=Counter)
    line_seconds: float = 0.0
    steps: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    looked: Counter[str] = field(default_factory=Counter)
    transactions: int = 0
    storm_counts: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    def add(self, result: Result) -> None:
        """Take one in."""
        kind, seed = result.task
        self.cpu += result.cpu
        self.transactions += result.transactions
        self.storm_counts += result.storm_counts
        self.wrong += [f"storm {text}" for text in result.storm_wrong]
        report = result.report
        if report is None:
            return
        self.world_cpu += result.cpu
        self.worlds[kind or "plain"] += 1
        self.line_seconds += report.line_seconds
        self.steps += report.steps
        self.counts += report.counts
        self.looked += report.looked
        much = f" --much {kind}" if kind else ""
        self.wrong += [f"`python -m tests.prove --seed {seed}{much}`: {v}" for v in report.wrong]

    @property
    def hostile(self) -> int:
        """Commands that may not pass."""
        return sum(number for name, number in self.counts.items() if name.startswith("hostile: "))

    @property
    def crashes(self) -> int:
        """Deaths of the core."""
        return self.counts["crashes"] + self.counts["reboots"]


def tasks(first: int) -> Iterator[Task]:
    """Worlds of all kinds and storms, in turn, without end."""
    for seed in count(first):
        yield from (("", seed), ("storm", seed), ("crashes", seed), ("", seed + 500_000))
        if seed % 4 == 0:
            yield "hostile", seed
            yield from (("storm", seed * 10 + n) for n in range(1_000_000, 1_000_003))


def prove(minutes: float, first: int, workers: int) -> Tally:
    """Play for so long, and until the large counts are reached."""
    tally, began = Tally(), time.monotonic()
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        for result in pool.imap_unordered(play, _until(tally, tasks(first), began + 60 * minutes)):
            tally.add(result)
            for text in tally.wrong[-1:] if result.report is not None and result.report.wrong else ():
                sys.stderr.write(f"{text}\n")
    return tally


def _until(tally: Tally, endless: Iterator[Task], end: float) -> Iterator[Task]:
    """Tasks while there is time, or the counts are not reached; a few ahead of what is done."""
    given = 0
    while time.monotonic() < end or (
        tally.transactions < LEAST["transactions"]
        or tally.hostile < LEAST["hostile"]
        or tally.crashes < LEAST["crashes"]
    ):
        while given - sum(tally.worlds.values()) - tally.transactions // PER_STORM > 16:
            time.sleep(0.01)  # the pool takes all it can get; the tally is filled by another thread
        given += 1
        yield next(endless)


def found_plants() -> dict[str, tuple[Found | None, float]]:
    """What became of every fault planted by hand, and after how many seconds of processor time."""
    found = {}
    for name, plant in PLANTS.items():
        began = time.process_time()
        found[name] = search(plant), time.process_time() - began
    return found


def write(path: Path, tally: Tally, first: int, plants: dict[str, tuple[Found | None, float]]) -> None:
    """The report, in front of what was written by hand (from the line that begins ``## Faults found``)."""
    before = path.read_text() if path.exists() else ""
    at = before.find("## Faults found")
    by_hand = before[at:] if at >= 0 else "## Faults found\n"
    path.write_text("\n".join([*_lines(tally, first, plants), "", by_hand.rstrip(), ""]))


def _lines(tally: Tally, first: int, plants: dict[str, tuple[Found | None, float]]) -> Iterator[str]:
    speed = tally.line_seconds / tally.world_cpu if tally.world_cpu else 0.0
    yield "# What simulation proved"
    yield ""
    yield "Written by `make prove` (`python -m tests.prove`), but for the last part. What is played and"
    yield "looked at is told in `tests/prove`."
    yield ""
    yield "| | |"
    yield "|---|---|"
    yield f"| seeds | from {first} |"
    kinds = ", ".join(f"{number} {kind}" for kind, number in sorted(tally.worlds.items()))
    yield f"| worlds | {tally.worlds.total()} ({kinds}) |"
    yield f"| processor time | {tally.cpu / 60:.1f} minutes |"
    yield f"| simulated | {tally.line_seconds:.0f} line-seconds, {speed:.0f} in a second of processor time |"
    yield f"| steps of the core | {tally.steps} |"
    yield f"| transactions on sick lines (`tests.line.storm`) | {tally.transactions} |"
    yield f"| commands that may not pass | {tally.hostile} |"
    yield f"| deaths of the core | {tally.crashes} |"
    yield f"| violations | {len(tally.wrong)} |"
    yield ""
    yield "## Invariants"
    yield ""
    yield f"Each world ends with {CALM_SECONDS:g} s without faults, in which everything has to recover."
    yield ""
    yield "| invariant (hazard) | looked at |"
    yield "|---|---|"
    yield from (f"| {name} | {number} |" for name, number in sorted(tally.looked.items()))
    yield ""
    yield "## Violations in this run"
    yield ""
    yield from (f"- {text}" for text in tally.wrong or ["none"])
    yield ""
    yield "## What was fired"
    yield ""
    yield "| in worlds | times |"
    yield "|---|---|"
    yield from (f"| {name} | {number} |" for name, number in sorted(tally.counts.items()))
    yield ""
    yield "| in storms | times |"
    yield "|---|---|"
    yield from (f"| {name} | {number} |" for name, number in sorted(tally.storm_counts.items()))
    yield ""
    yield "## Faults planted by hand"
    yield ""
    yield "| fault | found after | by |"
    yield "|---|---|---|"
    for name, (found, cpu) in plants.items():
        told = (
            f"{found.line_seconds:.0f} line-seconds, {cpu:.1f} s | {found.invariant}" if found else "NOT | "
        )
        yield f"| {name} | {told} |"
