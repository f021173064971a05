"""The invariants, each looked at by an observer from outside the core."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.prove.observers.base import Observer
from tests.prove.observers.control import Bits, Holder, Unasked
from tests.prove.observers.liveness import Bounded, Recovers
from tests.prove.observers.outcomes import Entitled, Proved, ToldOnce
from tests.prove.observers.records import Kept, OnceSent, OnRecord
from tests.prove.observers.values import Promise, Truth
from tests.prove.observers.wires import Gap, StopFirst

if TYPE_CHECKING:
    from tests.prove.box import Box

ALL: tuple[type[Observer], ...] = (
    Gap,
    StopFirst,
    Truth,
    Promise,
    OnRecord,
    OnceSent,
    Kept,
    ToldOnce,
    Proved,
    Entitled,
    Holder,
    Unasked,
    Bits,
    Recovers,
    Bounded,
)


def everybody(box: Box) -> list[Observer]:
    """All observers of a world."""
    return [kind(box) for kind in ALL]


__all__ = ["ALL", "Observer", "everybody"]
