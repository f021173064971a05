"""The runs of the gateway: which one this is, and how long it has lived through all of them. Pure.

The lived time is a clock that nobody can set: seconds of the monotonic clock while the gateway runs, and
between two runs as long as the machine was not restarted. Only over a restart of the machine has the wall
clock to be believed, and it never takes anything back. What has to be counted or kept over several runs goes
by it.
"""

from __future__ import annotations

import msgspec

from gateway.core.chain import Entry
from gateway.tag import Instant

NANO = 1e-9


class Boot(msgspec.Struct, frozen=True, kw_only=True):
    """A start of the gateway: an id of its own, and that of the machine's boot, within which the monotonic
    clock goes on. Both are random; "" where that is not known."""

    id: str = ""
    machine: str = ""


class Runs(msgspec.Struct, kw_only=True):
    """``mono``, ``wall`` and ``lived`` are those of the last entry."""

    count: int = 0
    boot: str = ""
    machine: str = ""
    mono: float = 0.0
    wall: int = 0
    lived: float = 0.0
    ended: bool = True
    """The last run came to its end in good order."""

    def fold(self, entry: Entry) -> None:
        """Take in one entry of the journal."""
        if entry["kind"] == "boot":
            self.count += 1
            self.boot, self.machine = entry["boot"], entry["machine"]
        self.ended = entry["kind"] == "end"
        self.mono, self.wall, self.lived = entry["mono"], entry["time"], entry["lived"]

    def lived_until(self, boot: Boot, now: Instant) -> float:
        """The lived time now, in a run after the last entry."""
        if not self.count:
            return 0.0
        if boot.machine and boot.machine == self.machine and now.mono >= self.mono:
            return self.lived + now.mono - self.mono
        return self.lived + max(0.0, (now.wall - self.wall) * NANO)
