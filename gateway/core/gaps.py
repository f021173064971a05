"""Gaps between named registers across which a drive does not let itself be read. Pure.

A profile may allow blocks to pass over addresses that it does not name (`bridge`), because that is cheaper
than another request. Where a drive answers such a block with "illegal address", the block is cut at its gaps
at once, so that everything is read. Which gap it was is found out by reading across each of them alone, after
the registers on both sides were read by themselves: only a gap that is refused then is told, and remembered
over a restart. Blocks without a gap are none of our business: what they hold is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import msgspec

from gateway.bridge.api import RefusedGap
from gateway.core.chain import Entry
from gateway.core.drive import Drive
from gateway.line.interface import Answered, BlockFailed, BlockRead, Read, Refused, Result, UnitFacts
from gateway.mapping.profile import Profile
from gateway.tag import Event, Instant

KIND = "gap"
"""Of entries in the journal."""
ILLEGAL_ADDRESS = 0x02
"""Exception code of the standard (application protocol V1.1b3, section 7)."""
ILLEGAL_ADDRESS_NAME = "illegal_address"
"""What profiles call it, whatever number their drives give it."""
TRIALS = 3
"""So often it is tried to read across a gap when no answer comes."""
TRIAL_SECONDS = 5.0

Gap = tuple[int, int]
"""First and last address that no point of the profile has."""


class Gaps(msgspec.Struct, kw_only=True):
    """The gaps that drives refused, by drive: part of the memory."""

    refused: dict[str, list[RefusedGap]] = msgspec.field(default_factory=dict)

    def fold(self, entry: Entry) -> None:
        """Take in one entry of the journal."""
        if entry["kind"] == KIND:
            gap = msgspec.convert(entry["gap"], RefusedGap)
            known = self.refused.setdefault(gap.drive, [])
            known[:] = [one for one in known if (one.first, one.last) != (gap.first, gap.last)]
            known.append(gap)

    def of(self, drive: Drive) -> list[RefusedGap]:
        """Those of a drive that its profile still lets be passed over: it may have learned better since, and
        the drive may be another one."""
        open_gaps = {gap for gap in gaps_between(drive.facts.readable) if not in_holes(drive.facts, gap)}
        return [
            gap
            for gap in self.refused.get(drive.name, [])
            if (gap.profile, gap.unit) == (drive.profile.name, drive.unit)
            and (gap.first, gap.last) in open_gaps
        ]


@dataclass(slots=True)
class _Suspect:
    """A gap in a block that was refused, and the read across it alone. ``before`` and ``behind``: what stands
    there was read since. ``trials`` are those that are left."""

    trial: Read
    trials: int
    before: bool = False
    behind: bool = False
    job: int | None = None


class GapWatch:
    """Finds them out.

    Args:
        forbid: lets a line no longer read across these gaps of a drive.
        ask: asks a line for a read, at the latest after so many seconds; the job's number.
        record: puts an entry into the journal.
        tell: passes an event on to the clients.
    """

    def __init__(
        self,
        drives: Sequence[Drive],
        forbid: Callable[[Drive, tuple[Gap, ...]], None],
        ask: Callable[[str, Read, float], int],
        record: Callable[[Mapping[str, Any]], int],
        tell: Callable[[Event], None],
    ) -> None:
        self._drives = drives
        self._forbid = forbid
        self._ask = ask
        self._record = record
        self._tell = tell
        self._refused: dict[str, dict[Gap, RefusedGap]] = {}
        self._suspects: dict[str, dict[Gap, _Suspect]] = {}
        self._cleared: dict[str, set[Gap]] = {}
        self._jobs: dict[int, tuple[Drive, Gap]] = {}

    def restore(self, memory: Gaps) -> None:
        """Take up what was found before the restart."""
        for drive in self._drives:
            if known := memory.of(drive):
                self._refused[drive.name] = {(gap.first, gap.last): gap for gap in known}
                self._keep_apart(drive)

    def refused(self) -> tuple[RefusedGap, ...]:
        """All gaps that were refused, drive by drive."""
        return tuple(gap for drive in self._drives for gap in self._refused.get(drive.name, {}).values())

    def failed(self, drive: Drive, block: BlockFailed) -> bool:
        """A planned read failed; True if that may be due to a gap, and its parts are read from now on."""
        if not isinstance(block.result, Refused) or block.result.code not in address_codes(drive.profile):
            return False
        apart = {*self._refused.get(drive.name, ()), *self._suspects.get(drive.name, ())}
        gaps = [gap for gap in gaps_in(drive.facts, block.address, block.count) if gap not in apart]
        for gap in gaps:
            once_fine = gap in self._cleared.get(drive.name, ())
            trial = _across(drive.facts, gap, block)
            self._suspects.setdefault(drive.name, {})[gap] = _Suspect(trial, 0 if once_fine else TRIALS)
        if gaps:
            self._keep_apart(drive)
        return bool(gaps)

    def read(self, drive: Drive, block: BlockRead, now: Instant) -> None:
        """Registers of a drive were read."""
        last = block.address + len(block.words) - 1
        for gap, suspect in self._suspects.get(drive.name, {}).items():
            suspect.before |= block.address <= gap[0] - 1 <= last
            suspect.behind |= block.address <= gap[1] + 1 <= last
            if suspect.before and suspect.behind and suspect.job is None and suspect.trials:
                suspect.trials -= 1
                suspect.job = self._ask(drive.line, suspect.trial, now.mono + TRIAL_SECONDS)
                self._jobs[suspect.job] = drive, gap

    def owns(self, job: int) -> bool:
        """True for a read across a gap."""
        return job in self._jobs

    def job_done(self, job: int, result: Result, now: Instant) -> None:
        """What became of a read across a gap."""
        drive, gap = self._jobs.pop(job)
        suspects = self._suspects[drive.name]
        match result:
            case Answered():
                del suspects[gap]
                self._cleared.setdefault(drive.name, set()).add(gap)
                self._keep_apart(drive)
            case Refused(code) if code in address_codes(drive.profile):
                del suspects[gap]
                self._found(drive, gap, code, now)
            case Refused():
                suspects[gap].trials = 0
            case _:
                suspects[gap].job = None

    def _found(self, drive: Drive, gap: Gap, code: int, now: Instant) -> None:
        found = RefusedGap(
            drive=drive.name,
            profile=drive.profile.name,
            unit=drive.unit,
            first=gap[0],
            last=gap[1],
            code=code,
            time=now.wall,
        )
        self._refused.setdefault(drive.name, {})[gap] = found
        self._record({"kind": KIND, "gap": found})
        self._tell(Event(time=now.wall, drive=drive.name, name="gap_refused", text=found.text))

    def _keep_apart(self, drive: Drive) -> None:
        gaps = {*self._refused.get(drive.name, ()), *self._suspects.get(drive.name, ())}
        self._forbid(drive, tuple(sorted(gaps)))


def address_codes(profile: Profile) -> Collection[int]:
    """The exception codes by which a drive says that it has no such register."""
    named = {code for code, error in profile.errors.items() if error.name == ILLEGAL_ADDRESS_NAME}
    return named if ILLEGAL_ADDRESS in profile.errors else named | {ILLEGAL_ADDRESS}


def gaps_between(readable: Sequence[Gap]) -> Iterator[Gap]:
    """The addresses between ranges of named registers."""
    for (_, high), (low, _) in pairwise(readable):
        yield high + 1, low - 1


def in_holes(facts: UnitFacts, gap: Gap) -> bool:
    """True for a gap that holds what is never read: no read passes over it."""
    return any(low <= gap[1] and gap[0] <= high for low, high in facts.holes)


def gaps_in(facts: UnitFacts, address: int, count: int) -> list[Gap]:
    """The gaps that a read passes over."""
    last = address + count - 1
    return [gap for gap in gaps_between(facts.readable) if address < gap[0] and gap[1] < last]


def _across(facts: UnitFacts, gap: Gap, block: BlockFailed) -> Read:
    """As much of a refused read as lies between the gaps next to this one: it cuts no value in two."""
    gaps = gaps_in(facts, block.address, block.count)
    place = gaps.index(gap)
    first = gaps[place - 1][1] + 1 if place else block.address
    end = gaps[place + 1][0] if place + 1 < len(gaps) else block.address + block.count
    return Read(block.unit, first, end - first, block.table)
