"""The invariants, each looked at by an observer from outside the core."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.prove.observers.base import Observer
from tests.prove.observers.control import Bits, Holder, Unasked
from tests.prove.observers.liveness import Bounded, Recovers
from tests.prove.observers.outcomes import Answered, Entitled, Proved, ToldOnce
from tests.prove.observers.records import Kept, OnceSent, OnRecord
from tests.prove.observers.stops import Expires, Repeats
from tests.prove.observers.values import Promise, Truth
from tests.prove.observers.wires import Gap, StopFirst

if TYPE_CHECKING:
    from tests.prove.box import Box

ALL: tuple[type[Observer], ...] = (
    Gap,
    StopFirst,
    Repeats,
    Truth,
    Promise,
    OnRecord,
    OnceSent,
    Kept,
    ToldOnce,
    Answered,
    Proved,
    Entitled,
    Holder,
    Expires,
    Unasked,
    Bits,
    Recovers,
    Bounded,
)


def everybody(box: Box) -> list[Observer]:
    """All observers of a world."""
    return [kind(box) for kind in ALL]


__all__ = ["ALL", "Observer", "everybody"]
