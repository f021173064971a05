"""What the gateway remembers over a restart: a fold over its journal. Pure.

Nothing else is durable. Whoever needs something remembered gives its entries a kind, writes a part like those
below, whose ``fold`` takes in each entry of the journal and keeps what matters, and adds it to `Memory`. The
core folds what it records, the journal's thread what it wrote; at the next start the core gets the result
(`gateway.core.events.Started`). A file of the journal begins with a snapshot of the memory, so that only the
newest one has to be read.

Parts are plain data: they must come back from JSON as they were. A field that an older snapshot does not
have gets its default, so give each one.
"""

from __future__ import annotations

from typing import Any

import msgspec
from msgspec import field

from gateway.core.agreed import Agreed
from gateway.core.attempts import Attempts
from gateway.core.chain import SNAPSHOT, Entry
from gateway.core.gaps import Gaps
from gateway.core.runs import Runs
from gateway.core.standing import Standing
from gateway.core.worn import Wear


class Memory(msgspec.Struct, kw_only=True):
    """Everything remembered, part by part."""

    runs: Runs = field(default_factory=Runs)
    attempts: Attempts = field(default_factory=Attempts)
    wear: Wear = field(default_factory=Wear)
    gaps: Gaps = field(default_factory=Gaps)
    agreed: Agreed = field(default_factory=Agreed)
    standing: Standing = field(default_factory=Standing)

    def fold(self, entry: Entry) -> str:
        """Take in one entry. A part that does not understand it passes it over; that is told in words."""
        problem = ""
        for name in self.__struct_fields__:
            try:
                getattr(self, name).fold(entry)
            except (LookupError, TypeError, ValueError, AttributeError, msgspec.MsgspecError) as error:
                problem = f"{name} does not understand it: {error!r}"
        return problem

    def copy(self) -> Memory:
        """Another one that tells the same, as it would come back from the journal."""
        return msgspec.json.decode(msgspec.json.encode(self), type=Memory)


def snapshot_of(memory: Memory) -> dict[str, Any]:
    """The entry that holds a whole memory, to be sealed at once."""
    return {"kind": SNAPSHOT, "memory": memory}


def remembered(snapshot: Entry) -> Memory:
    """The memory in a snapshot that was read.

    Raises:
        msgspec.ValidationError: if there is none.
    """
    return msgspec.convert(snapshot.get("memory"), Memory, str_keys=True)
