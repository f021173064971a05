"""The last outcome of each drive as a tag: what an operator asks first. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from gateway.core.drive import Drive
from gateway.core.own import OwnTags
from gateway.core.trail import Facts, Trail
from gateway.mapping.own import OF_A_DRIVE
from gateway.tag import Instant, own_name, split_tag, tag_of

TAG = "_last_outcome"

MOST = 400
"""Characters of it."""


class LastOutcomes:
    """Follows what goes on record. What an adapter turned away counts too; a command to all drives of a line
    is one to each of them."""

    def __init__(self, drives: Sequence[Drive], own: OwnTags, trail: Trail) -> None:
        self._told: dict[str, str] = {}
        self._asks: dict[str, tuple[int, str]] = {}
        """By drive, the number of what it was asked last, and that in words."""
        self._names: dict[str, list[str]] = {drive.name: [drive.name] for drive in drives}
        for drive in drives:
            self._names.setdefault(own_name(drive.line), []).append(drive.name)
            own.register(drive.name, {TAG: OF_A_DRIVE[TAG]}, {TAG: partial(self._tell, drive.name)})
        self._own = own
        trail.follow(self._look)

    def _tell(self, drive: str, now: float) -> str | None:
        return self._told.get(drive)

    def _look(self, entry: Facts, now: Instant) -> None:
        match entry["kind"]:
            case "outcome" | "turned away":
                name = split_tag(entry["what"])[0]
                for drive in self._names.get(name, ()):
                    self._asks[drive] = entry.get("ask", 0), _asked(entry)
                    self._note(drive, entry["outcome"], now)
            case "late outcome":
                for drive, (ask, _) in self._asks.items():
                    if ask == entry["ask"]:
                        self._note(drive, entry["outcome"], now)

    def _note(self, drive: str, outcome: Mapping[str, Any], now: Instant) -> None:
        why = outcome.get("reason") or outcome.get("cause")
        words = f"{outcome['verdict']}: {self._asks[drive][1]}" + (f": {why}" if why else "")
        self._told[drive] = words if len(words) <= MOST else words[: MOST - 3] + "..."
        self._own.changed([tag_of(drive, TAG)], now)


def _asked(entry: Facts) -> str:
    """``run_forward frequency=30.0 by anna through mqtt``."""
    name, wanted, by = split_tag(entry["what"])[1], entry.get("wanted"), entry["by"]
    if isinstance(wanted, Mapping):
        asked = " ".join([name, *(f"{key}={value}" for key, value in wanted.items())])
    else:
        asked = f"{name}={wanted}"
    return f"{asked} by {by['who']} through {by['through']}"
