"""Faults planted into the core by hand: the simulation must find each.

python -m tests.prove --plants
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Any

from gateway.core import sending, writing
from gateway.core.drive import Drive
from gateway.core.leases import Leases
from gateway.core.ledger import Ledger
from gateway.core.once import Once
from gateway.core.permits import Permits
from gateway.core.store import Store
from gateway.line.resync import Suspicion
from gateway.line.schedule import Schedule
from gateway.tag import Outcome, Verdict
from tests.core.faultydisk import FaultyFile
from tests.prove.box import Box
from tests.prove.scene import scene_of

FIRST_SEED = 1
MOST_WORLDS = 40


@dataclass(frozen=True)
class Plant:
    """A fault: what stands in the place of what. ``found`` begins the names of invariants that find it."""

    owner: Any
    name: str
    instead: Any
    found: tuple[str, ...]


@dataclass(frozen=True)
class Found:
    """How a planted fault was found."""

    seed: int
    line_seconds: float
    invariant: str
    text: str


def _confirmed(*args: Any) -> Generator[Any, Any, Outcome]:
    return Outcome(verdict=Verdict.CONFIRMED)
    yield  # it is a generator


def _other_lease(plain: Callable[..., Any]) -> Callable[..., Any]:
    """The lease of another drive is asked."""

    def mixed(self: Leases, drive: Drive, *args: Any) -> Any:
        names = list(self._drives)
        other = names[(names.index(drive.name) + 1) % len(names)]
        return plain(self, self._drives[other], *args)

    return mixed


def _forgetful(self: Once, attempts: Any) -> None:
    """Ids of earlier runs are forgotten."""


def _early(self: Leases, drive: Drive) -> float:
    return self._now.mono + drive.config.control.ttl / 4


def _not_synced(plain: Callable[..., Any]) -> Callable[..., Any]:
    def append(self: Ledger, file: FaultyFile, entries: Any) -> None:
        safe = file._content.safe
        plain(self, file, entries)
        file._content.safe = safe

    return append


PLANTS: dict[str, Plant] = {
    "late answers are forgotten": Plant(
        Suspicion, "missed", lambda *args, **more: None, ("no wrong", "confirmed")
    ),
    "the read-back is dropped": Plant(writing, "read_back", _confirmed, ("confirmed",)),
    "two leases are mixed up": Plant(Leases, "check", _other_lease(Leases.check), ("one client",)),
    "leases and rights are not looked at again": Plant(
        Permits, "still", lambda self, ask: None, ("one client", "nothing goes out")
    ),
    "a lease ends early": Plant(Leases, "_end_from_now", _early, ("one client",)),
    "frames do not wait for their record": Plant(sending, "RECORD_PATIENCE", None, ("no write that",)),
    "the journal is not synced": Plant(Ledger, "_append", _not_synced(Ledger._append), ("what was flushed",)),
    "ids are forgotten over a restart": Plant(Once, "restore", _forgetful, ("no write is sent twice",)),
    "old values stay good": Plant(Store, "aged", lambda *args: None, ("no old value",)),
    "the rest of a word is not read first": Plant(Drive, "words_to_read", lambda self, raws: [], ("no bit",)),
    "a stop waits its turn": Plant(Schedule, "_next_stop", lambda *args: None, ("a stop goes first",)),
    "nothing expires": Plant(Schedule, "expired", lambda self, now: [], ("nothing goes out",)),
}


@contextlib.contextmanager
def planted(plant: Plant) -> Iterator[None]:
    """With the fault in the core."""
    plain = getattr(plant.owner, plant.name)
    setattr(plant.owner, plant.name, plant.instead)
    try:
        yield
    finally:
        setattr(plant.owner, plant.name, plain)


def search(plant: Plant, first: int = FIRST_SEED, most: int = MOST_WORLDS) -> Found | None:
    """Play worlds until one finds the fault."""
    line_seconds = 0.0
    with planted(plant):
        for seed in range(first, first + most):
            report = Box(scene_of(seed)).run()
            line_seconds += report.line_seconds
            for violation in report.wrong:
                if violation.invariant.startswith(plant.found):
                    return Found(seed, line_seconds, violation.invariant, violation.text)
    return None


def main() -> int:
    """All of them; what was found, and after how much time."""
    missed = 0
    for name, plant in PLANTS.items():
        found = search(plant)
        missed += found is None
        told = (
            f"{found.line_seconds:.0f} line-seconds (seed {found.seed}): {found.text}" if found else "MISSED"
        )
        sys.stdout.write(f"{name}: {told}\n")
        sys.stdout.flush()
    return 1 if missed else 0
