"""The report of a proof."""

from __future__ import annotations

import platform
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from tests.prove.observers import ALL
from tests.prove.proof import LARGE, Tally
from tests.prove.scene import CALM_SECONDS, FRAME_FAULTS, TROUBLES

BY_HAND = "## Faults found"
"""From the line that begins so the report is written by hand, and stays."""


def write(path: Path, tally: Tally) -> None:
    """Write the report in front of what was written by hand."""
    before = path.read_text() if path.exists() else ""
    at = before.find(BY_HAND)
    by_hand = before[at:] if at >= 0 else f"{BY_HAND}\n"
    path.write_text("\n".join([*_lines(tally), "", by_hand.rstrip(), ""]))


def _lines(tally: Tally) -> Iterator[str]:
    yield "# What simulation proved"
    yield ""
    yield "Written by `make prove` (`python -m tests.prove`), but for the faults found, which people tell of."
    yield "A *world* is the whole core with lines, drives, clients, disk and crashes in virtual time, a"
    yield "*storm* one line alone in the worst weather (`tests/line/storm`). Both are made from a seed."
    yield ""
    yield from _figures(tally)
    yield from _invariants(tally)
    yield "## Violations in this run"
    yield ""
    yield from (f"- {text}" for text in tally.wrong or ["none"])
    yield ""
    yield from _fired(tally)
    yield from _plants(tally)


def _figures(tally: Tally) -> Iterator[str]:
    speed = tally.line_seconds / tally.world_cpu if tally.world_cpu else 0.0
    kinds = ", ".join(f"{number} {kind}" for kind, number in sorted(tally.worlds.items()))
    last = tally.first + tally.worlds.total() + tally.storms - 1
    yield from _table(
        ("what", "how much"),
        (
            ("seeds", f"{tally.first} to {last}, nearly all of them (the last few may lack)"),
            ("worlds", f"{tally.worlds.total()} ({kinds})"),
            ("storms", tally.storms),
            ("time", f"{tally.wall / 60:.1f} minutes; {tally.cpu / 60:.1f} minutes of processor time"),
            ("Python", f"{platform.python_version()} on {platform.system()}"),
            (
                "simulated in worlds",
                f"{tally.line_seconds:,.0f} line-seconds, {speed:.0f} in a second of processor time",
            ),
            ("steps of the core", f"{tally.steps:,}"),
            ("requests on wires in worlds", f"{tally.requests:,}"),
            ("transactions on sick lines, in storms", _of(tally.transactions, "transactions")),
            ("commands that may not pass", _of(tally.hostile, "hostile")),
            ("deaths of the core", _of(tally.crashes, "crashes")),
            ("violations", len(tally.wrong)),
        ),
    )


def _of(number: int, what: str) -> str:
    aim = LARGE[what]
    return f"{number:,}" if number >= aim else f"{number:,} (a longer run reaches {aim:,})"


def _invariants(tally: Tally) -> Iterator[str]:
    yield "## Invariants"
    yield ""
    yield f"Each world ends with {CALM_SECONDS:g} s without faults, in which everything has to recover."
    yield ""
    looked = {f"{kind.name} ({kind.hazard})": 0 for kind in ALL} | dict(tally.looked)
    yield from _table(("invariant (hazard)", "looked at"), ((n, f"{k:,}") for n, k in sorted(looked.items())))


def _fired(tally: Tally) -> Iterator[str]:
    yield "## What was fired"
    yield ""
    counts = Counter(dict.fromkeys((*FRAME_FAULTS, *TROUBLES), 0)) | tally.counts
    missing = {name: 0 for name in (*FRAME_FAULTS, *TROUBLES) if name not in counts}
    yield from _table(
        ("in worlds", "times"), ((n, f"{k:,}") for n, k in sorted({**missing, **counts}.items()))
    )
    yield from _table(("in storms", "times"), ((n, f"{k:,}") for n, k in sorted(tally.storm_counts.items())))


def _plants(tally: Tally) -> Iterator[str]:
    yield "## Faults planted by hand"
    yield ""
    yield "Each is planted into the core alone, and worlds are played until one finds it (`--plants`)."
    yield ""
    rows = (
        (
            name,
            f"{found.line_seconds:,.0f} line-seconds, {cpu:.0f} s" if found else "NOT FOUND",
            f"seed {found.world}: {found.invariant}" if found else f"searched for {cpu:.0f} s",
        )
        for name, (found, cpu) in sorted(tally.plants.items())
    )
    yield from _table(("fault", "found after", "by"), rows)


def _table(head: tuple[str, ...], rows: Iterable[tuple[object, ...]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield "|" + "---|" * len(head)
    yield from (f"| {' | '.join(map(str, row))} |" for row in rows)
    yield ""
