"""A proof: as many worlds and storms as time allows on all processors, and the faults planted by hand."""

from __future__ import annotations

import logging
import multiprocessing
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import count

from tests.line.storm.storm import Storm
from tests.line.storm.storm import scene_of as storm_of
from tests.prove.box import Box, Report
from tests.prove.patience import patience
from tests.prove.plants import PLANTS, Found, search
from tests.prove.scene import scene_of

LARGE = {"transactions": 1_000_000, "hostile": 100_000, "crashes": 1_000}
"""Counts that a long proof reaches: transactions on a sick line, commands that may not pass, and deaths of
the core. `CYCLE` is so mixed that an hour of processor time is more than enough for them."""
CYCLE = ("", "storm", "crashes", "", "storm", "hostile", "")
"""What is played in turn: worlds, worlds with much of something (`scene.MUCH`), and storms."""
PER_STORM = 5_000
REPORTED = 60.0
"""Seconds between two states of the report on disk: a proof that is cut short has one too."""
Task = tuple[str, str, int]
"""Kind (``world``, ``storm``, ``plant``), which of them, and the seed."""


@dataclass
class Result:
    """What came of one task."""

    task: Task
    cpu: float = 0.0
    report: Report | None = None
    transactions: int = 0
    storm_counts: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    found: Found | None = None


def play(task: Task) -> Result:
    """One world, one storm, or the search for one fault planted by hand."""
    logging.disable()
    began, result = time.process_time(), Result(task)
    try:
        _play(task, result)
    except Exception:  # the proof goes on, and tells of it
        result.wrong.append(f"{task} fell over: {traceback.format_exc(limit=-3)}")
    result.cpu = time.process_time() - began
    return result


def _play(task: Task, result: Result) -> None:
    kind, which, seed = task
    if kind == "plant":
        result.found = search(PLANTS[which])
    elif kind == "storm":
        storm = Storm(storm_of(seed)).run(PER_STORM)
        result.transactions, result.storm_counts = storm.transactions, storm.counts
        result.wrong += [
            f"`python -m tests.line.storm --transactions {PER_STORM} --scene {seed}`: {text}"
            for text in storm.wrong[:3]
        ]
    else:
        with patience():
            result.report = report = Box(scene_of(seed, which)).run()
        much = f" --much {which}" if which else ""
        result.wrong += [f"`python -m tests.prove --seed {seed}{much}`: {v}" for v in report.wrong[:3]]


@dataclass
class Tally:
    """Everything together."""

    first: int
    wall: float = 0.0
    cpu: float = 0.0
    world_cpu: float = 0.0
    worlds: Counter[str] = field(default_factory=Counter)
    storms: int = 0
    line_seconds: float = 0.0
    steps: int = 0
    requests: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    looked: Counter[str] = field(default_factory=Counter)
    transactions: int = 0
    storm_counts: Counter[str] = field(default_factory=Counter)
    plants: dict[str, tuple[Found | None, float]] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)

    def add(self, result: Result) -> None:
        """Take one in."""
        kind, which, _ = result.task
        self.cpu += result.cpu
        self.wrong += result.wrong
        self.storms += kind == "storm"
        self.transactions += result.transactions
        self.storm_counts += result.storm_counts
        if kind == "plant":
            self.plants[which] = result.found, result.cpu
        report = result.report
        if report is None:
            return
        self.world_cpu += result.cpu
        self.worlds[which or "plain"] += 1
        self.line_seconds += report.line_seconds
        self.steps += report.steps
        self.requests += report.requests
        self.counts += report.counts
        self.looked += report.looked

    @property
    def hostile(self) -> int:
        """Commands that may not pass."""
        return sum(number for name, number in self.counts.items() if name.startswith("hostile: "))

    @property
    def crashes(self) -> int:
        """Deaths of the core."""
        return self.counts["crashes"] + self.counts["reboots"]

    @property
    def missed(self) -> list[str]:
        """Faults planted by hand that no world found."""
        return [name for name, (found, _) in self.plants.items() if found is None]


def tasks(first: int, plants: bool) -> Iterator[Task]:
    """Faults planted by hand, and worlds of all kinds and storms in turn, without end."""
    waiting = list(PLANTS) if plants else []
    for seed, which in zip(count(first), _cycle(), strict=False):
        if waiting:
            yield "plant", waiting.pop(0), 0
        yield ("storm", "", seed) if which == "storm" else ("world", which, seed)


def _cycle() -> Iterator[str]:
    while True:
        yield from CYCLE


def prove(
    minutes: float,
    first: int,
    workers: int,
    written: Callable[[Tally], None] = lambda tally: None,
    plants: bool = True,
) -> Tally:
    """Play for so many minutes. ``written`` takes the tally down from time to time, and at the end."""
    tally, began = Tally(first), time.monotonic()
    end, next_written = began + 60 * minutes, began + REPORTED
    ready = multiprocessing.get_context("spawn").Semaphore(2 * workers)

    def while_there_is_time() -> Iterator[Task]:
        for task in tasks(first, plants):
            ready.acquire()  # the pool takes all it can get: give it a few ahead of what is done
            if time.monotonic() >= end:
                return
            yield task

    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        for result in pool.imap_unordered(play, while_there_is_time()):
            ready.release()
            tally.add(result)
            tally.wall = time.monotonic() - began
            for text in result.wrong:
                sys.stderr.write(f"{text}\n")
            if time.monotonic() >= next_written:
                next_written += REPORTED
                written(tally)
    written(tally)
    return tally
