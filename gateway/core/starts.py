"""Staggered starts: of the drives of a group no two start at once, to limit the inrush. Pure.

Every run command of such a drive is a start, also one that only changes the speed of a running motor: whether
it runs when the frame arrives nobody can know for sure. Starts queue up by group. The next one goes when the
one before it is proved (or has failed), and not before ``apart`` seconds after its last frame. Whoever's turn
would come after his time to live is refused at once and told when to ask again. A stop is no start and waits
for nothing. After a restart of the gateway a group counts as just started: nobody knows when the last was.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from gateway.core.drive import Drive
from gateway.core.guard import refuse, starts_motor
from gateway.core.procedure import Ask, Effect, Pause
from gateway.mapping.profile import Command
from gateway.mapping.site import StartGroup
from gateway.tag import Cause

T = TypeVar("T")

LOOK_SECONDS = 0.1
"""How often a waiting start looks whether those before it gave up."""


@dataclass(slots=True)
class Queue:
    """The starts of a group that are due: numbers of asks, and when the next may go (monotonic)."""

    group: StartGroup
    free_at: float
    waiting: list[int] = field(default_factory=list)


class Starts:
    """All groups. A drive that belongs to none starts whenever it likes."""

    def __init__(self, groups: Sequence[StartGroup]) -> None:
        self._queues = [Queue(group, 0.0) for group in groups]

    def begin(self, now: float) -> None:
        """The gateway starts."""
        for queue in self._queues:
            queue.free_at = now + queue.group.apart

    def concern(self, drive: Drive, command: Command) -> bool:
        """True for a command that sets a motor running, where its drive belongs to a group."""
        return self._queue(drive.name) is not None and starts_motor(command)

    def in_turn(self, ask: Ask, now: float, start: Generator[Effect, Any, T]) -> Generator[Effect, Any, T]:
        """Carry ``start`` out when its turn has come.

        Raises:
            Ended: if that is after its time to live.
        """
        queue = self._queue(ask.drive.name)
        if queue is None:
            return (yield from start)
        _check_turn(queue, ask, now)
        queue.waiting.append(ask.number)
        try:
            while (wait := _wait(queue, ask.number, now)) > 0:
                now = yield Pause(wait)
            return (yield from start)
        finally:
            queue.waiting.remove(ask.number)

    def frame_left(self, ask: int, at: float) -> None:
        """A frame of this ask left: if it is a start, the next one's time begins to run."""
        for queue in self._queues:
            if queue.waiting[:1] == [ask]:
                queue.free_at = at + queue.group.apart

    def _queue(self, drive: str) -> Queue | None:
        return next((queue for queue in self._queues if drive in queue.group.drives), None)


def _check_turn(queue: Queue, ask: Ask, now: float) -> None:
    turn = max(now, queue.free_at) + queue.group.apart * len(queue.waiting)
    if ask.deadline is not None and turn > ask.deadline:
        raise refuse(
            Cause.TOO_SOON,
            f"the drives of {queue.group.name} start {queue.group.apart:g} s apart; "
            f"the turn of {ask.drive.name} comes in {turn - now:.1f} s, ask again then",
        )


def _wait(queue: Queue, ask: int, now: float) -> float:
    """Seconds after which to look again; 0 or less: now."""
    return queue.free_at - now if queue.waiting[0] == ask else LOOK_SECONDS
