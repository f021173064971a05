"""What an observer is: one invariant, told of everything that can be seen from outside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gateway.bridge.messages import Call, Response
from tests.prove.seen import Frame

if TYPE_CHECKING:
    from tests.prove.box import Box


class Observer:
    """One invariant. Subclasses override what they want to be told of."""

    name = ""
    hazard = ""
    """Its id in `docs/safety.md`."""

    def __init__(self, box: Box) -> None:
        self.box = box
        self.seen = box.seen
        self.looked = 0
        """How often the invariant was put to the test."""

    @property
    def now(self) -> float:
        """The present moment."""
        return self.box.clock.now

    def fail(self, text: str) -> None:
        """The invariant does not hold."""
        self.box.fail(self.name, text)

    def began(self) -> None:
        """The core is about to start."""

    def died(self) -> None:
        """The core is gone."""

    def ended(self) -> None:
        """The world ends, after its time without faults."""

    def stepped(self) -> None:
        """The core took a step, and its actions were carried out."""

    def sent(self, frame: Frame) -> None:
        """A request of ours begins on a wire."""

    def heard(self, line: str, data: bytes) -> None:
        """Bytes are about to reach the core."""

    def did(
        self, line: str, unit: int, frame: Frame | None, before: dict[int, int], after: dict[int, int]
    ) -> None:
        """A drive took registers over, from our frame or from a foreigner's (None)."""

    def told(self, session: int, message: Response) -> None:
        """A client is told something."""

    def asked(self, session: int, call: Call) -> None:
        """A client is about to ask."""

    def joined(self, session: int) -> None:
        """A client is about to join."""

    def left(self, session: int) -> None:
        """A client is about to leave."""

    def recorded(self, number: int, entry: dict[str, Any]) -> None:
        """The core gave an entry to its journal."""

    def flushed(self, number: int) -> None:
        """The core is about to hear that an entry is on the disk."""

    def opened(self, line: str) -> None:
        """A port is open."""

    def closed(self, line: str) -> None:
        """A port is gone."""
