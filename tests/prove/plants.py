"""Faults planted into the core by hand: the simulation must find each.

python -m tests.prove --plants [--only NAME]

What stands in the place of what is in `tests.prove.planted`.
"""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import count

from tests.prove.box import Box
from tests.prove.patience import HangsError, patience
from tests.prove.planted import PLANTS, Plant
from tests.prove.scene import scene_of

FIRST_SEED = 1
MOST_SECONDS = 150.0
"""Processor time for which one fault is searched at most."""
KINDS = ("hostile", "", "crashes", "")
"""Of worlds that are searched, in turn."""


@dataclass(frozen=True)
class Found:
    """How a planted fault was found."""

    seed: int
    much: str
    line_seconds: float
    invariant: str
    text: str

    @property
    def world(self) -> str:
        """Which world found it."""
        return f"{self.seed}{' --much ' + self.much if self.much else ''}"


@contextlib.contextmanager
def planted(plant: Plant) -> Iterator[None]:
    """With the fault in the core."""
    plain = [(owner, name, getattr(owner, name)) for owner, name, _ in plant]
    for owner, name, instead in plant:
        setattr(owner, name, instead)
    try:
        yield
    finally:
        for owner, name, before in plain:
            setattr(owner, name, before)


def search(plant: Plant, first: int = FIRST_SEED, most: float = MOST_SECONDS) -> Found | None:
    """Play worlds until one finds the fault, for so much processor time."""
    line_seconds, end = 0.0, time.process_time() + most
    with planted(plant):
        for seed in count(first):
            much = KINDS[seed % len(KINDS)]
            try:
                with patience():
                    report = Box(scene_of(seed, much)).run()
            except HangsError as error:
                return Found(seed, much, line_seconds, "the core comes to rest", str(error))
            line_seconds += report.line_seconds
            for violation in report.wrong:
                return Found(seed, much, line_seconds, violation.invariant, violation.text)
            if time.process_time() > end:
                break
    return None


def main(only: Collection[str] = ()) -> int:
    """All of them; what was found, and after how much time."""
    missed = 0
    for name in only or PLANTS:
        began = time.process_time()
        found = search(PLANTS[name])
        missed += found is None
        took = f"{time.process_time() - began:5.1f} s"
        told = (
            f"{took}, seed {found.world}: {found.invariant}: {found.text}" if found else f"{took}, NOT FOUND"
        )
        sys.stdout.write(f"{name}: {told}\n")
        sys.stdout.flush()
    return 1 if missed else 0


__all__ = ["PLANTS", "Found", "main", "planted", "search"]
