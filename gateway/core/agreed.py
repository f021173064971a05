"""Who may command each drive, as the journal remembers it: its lease, and whether it is in maintenance. Pure.

The kinds of entries are ``lease`` (the whole of a drive's lease after a change) and ``maintenance``.
"""

from __future__ import annotations

import msgspec
from msgspec import field

from gateway.core.chain import Entry
from gateway.tag import Origin


class Kept(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A lease. ``phase`` is one of `gateway.core.lease.Phase`; ``due`` the action that its end began and
    nothing has confirmed yet, ``by`` who did what the entry tells."""

    phase: str = "free"
    holder: Origin | None = None
    by: Origin | None = None
    moving: bool = False
    void: str = ""
    due: str = ""


class Worked(msgspec.Struct, frozen=True, kw_only=True):
    """Whether a drive is in maintenance, and who said so and why."""

    on: bool = False
    words: str = ""


class Agreed(msgspec.Struct, kw_only=True):
    """Of all drives, by name."""

    leases: dict[str, Kept] = field(default_factory=dict)
    maintenance: dict[str, Worked] = field(default_factory=dict)

    def fold(self, entry: Entry) -> None:
        """Take in one entry of the journal."""
        match entry["kind"]:
            case "lease":
                self.leases[entry["drive"]] = msgspec.convert(entry, Kept)
            case "maintenance":
                self.maintenance[entry["drive"]] = msgspec.convert(entry, Worked)
