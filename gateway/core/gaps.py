"""What a drive does not let be read: gaps between named registers, and registers that it has not. Pure.

A profile may allow blocks to pass over addresses that it does not name (`bridge`), because that is cheaper
than another request. Where a drive answers such a block with "illegal address", the block is cut at its gaps
at once, so that everything is read. Which gap it was is found out by reading across each of them alone, after
the registers on both sides were read by themselves: only a gap that is refused then is told, and remembered
over a restart.

A block without such a gap that is refused holds a named register that this drive has not: another firmware, a
card that is not there. It is read apart, once; the points of what is refused then are told, remembered and
read no more, so that their neighbours are. Once a minute they are asked for again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import msgspec

from gateway.bridge.api import RefusedGap
from gateway.core.chain import Entry
from gateway.core.drive import Drive
from gateway.core.refusals import address_codes as address_codes  # noqa: PLC0414
from gateway.core.refusals import apart, refusal
from gateway.line.interface import Answered, BlockFailed, BlockRead, Read, Refused, Result, UnitFacts
from gateway.tag import Event, Instant, Quality, Sample, split_tag

KIND = "gap"
"""Of entries in the journal."""
TRIALS = 3
"""So often it is tried to read across a gap when no answer comes."""
TRIAL_SECONDS = 5.0
AGAIN_SECONDS = 60.0
"""A register that the drive had not is asked for again after so long."""

AWAY = (Quality.NO_COMMUNICATION, Quality.LINE_DOWN, Quality.WAITING)
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
            if not entry.get("over"):
                known.append(gap)

    def of(self, drive: Drive) -> list[RefusedGap]:
        """Those of a drive that its profile still lets be passed over: it may have learned better since, and
        the drive may be another one."""
        open_gaps = {gap for gap in gaps_between(drive.facts.readable) if not in_holes(drive.facts, gap)}
        return [
            gap
            for gap in self.refused.get(drive.name, [])
            if (gap.profile, gap.unit) == (drive.profile.name, drive.unit)
            and ((gap.first, gap.last) in open_gaps if not gap.points else _stand_there(drive, gap))
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
        read: reads tags once, apart where that must be.
        leave_out: lets these points of a drive not be read any more, and all others; why, by point.
        record: puts an entry into the journal.
        tell: passes an event on to the clients.
    """

    def __init__(
        self,
        drives: Sequence[Drive],
        forbid: Callable[[Drive, tuple[Gap, ...]], None],
        ask: Callable[[str, Read, float], int],
        read: Callable[[Sequence[str], float, Callable[[tuple[Sample, ...]], None], Instant], None],
        leave_out: Callable[[Drive, Mapping[str, str]], None],
        record: Callable[[Mapping[str, Any]], int],
        tell: Callable[[Event], None],
    ) -> None:
        self._drives = drives
        self._forbid = forbid
        self._ask = ask
        self._read = read
        self._leave_out = leave_out
        self._record = record
        self._tell = tell
        self._refused: dict[str, dict[Gap, RefusedGap]] = {}
        self._suspects: dict[str, dict[Gap, _Suspect]] = {}
        self._cleared: dict[str, set[Gap]] = {}
        self._jobs: dict[int, tuple[Drive, Gap]] = {}
        self._missing: dict[str, dict[Gap, RefusedGap]] = {}
        self._searched: dict[str, set[tuple[int, int]]] = {}
        """Blocks that were read apart, all parts of which were answered."""
        self._searching: set[str] = set()
        self._again: dict[str, float] = {}

    def restore(self, memory: Gaps) -> None:
        """Take up what was found before the restart."""
        for drive in self._drives:
            if known := memory.of(drive):
                self._refused[drive.name] = {(g.first, g.last): g for g in known if not g.points}
                self._missing[drive.name] = {(g.first, g.last): g for g in known if g.points}
                self._keep_apart(drive)

    def refused(self) -> tuple[RefusedGap, ...]:
        """All gaps that were refused, drive by drive."""
        return tuple(
            gap
            for drive in self._drives
            for known in (self._refused, self._missing)
            for gap in known.get(drive.name, {}).values()
        )

    def returned(self, drive: Drive) -> None:
        """A drive answers, for the first time or again."""
        if drive.name in self._missing:
            self._keep_apart(drive)

    def failed(self, drive: Drive, block: BlockFailed, now: Instant) -> bool:
        """A planned read failed; True if that may be due to a gap or to a single register, and its parts are
        read from now on."""
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
        return bool(gaps) or self._search(drive, block, block.result.code, now)

    def _search(self, drive: Drive, block: BlockFailed, code: int, now: Instant) -> bool:
        """Read a block apart whose registers all have a name, unless that was done in vain."""
        span = block.address, block.count
        points = drive.points_in(*span)
        if span in self._searched.get(drive.name, ()) or not points:
            return False
        if drive.name not in self._searching:
            self._searching.add(drive.name)
            tags = [drive.tag(point.name) for point in points]
            self._read(tags, 0.0, partial(self._read_apart, drive, span, code), now)
        return True

    def _read_apart(self, drive: Drive, span: tuple[int, int], code: int, samples: Sequence[Sample]) -> None:
        """What became of the parts of a block."""
        self._searching.discard(drive.name)
        refused = _refused_in(drive, samples)
        for first, last, points in refused:
            self._found(drive, (first, last), code, samples[0].time, points)
        if refused:
            self._again[drive.name] = -math.inf
            self._keep_apart(drive)
        elif any(sample.quality is Quality.GOOD for sample in samples):
            self._searched.setdefault(drive.name, set()).add(span)

    def _ask_again(self, drive: Drive, now: Instant) -> None:
        """See now and then whether the drive has a register by now."""
        due = self._again.get(drive.name, -math.inf)
        if due == -math.inf:
            self._again[drive.name] = now.mono + AGAIN_SECONDS
        elif now.mono >= due:
            self._again[drive.name] = now.mono + AGAIN_SECONDS
            tags = [drive.tag(name) for gap in self._missing[drive.name].values() for name in gap.points]
            self._read(tags, 0.0, partial(self._asked_again, drive), now)

    def _asked_again(self, drive: Drive, samples: Sequence[Sample]) -> None:
        answered = {split_tag(s.tag)[1] for s in samples if s.quality not in (Quality.REFUSED, *AWAY)}
        missing = self._missing[drive.name]
        there = [gap for gap in missing.values() if not answered.isdisjoint(gap.points)]
        for gap in there:
            del missing[gap.first, gap.last]
            self._record({"kind": KIND, "gap": gap, "over": True})
        if there:
            self._keep_apart(drive)

    def read(self, drive: Drive, block: BlockRead, now: Instant) -> None:
        """Registers of a drive were read."""
        if self._missing.get(drive.name):
            self._ask_again(drive, now)
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
                self._found(drive, gap, code, now.wall)
            case Refused():
                suspects[gap].trials = 0
            case _:
                suspects[gap].job = None

    def _found(self, drive: Drive, gap: Gap, code: int, time: int, points: tuple[str, ...] = ()) -> None:
        found = RefusedGap(
            drive=drive.name,
            profile=drive.profile.name,
            unit=drive.unit,
            first=gap[0],
            last=gap[1],
            code=code,
            time=time,
            points=points,
        )
        (self._missing if points else self._refused).setdefault(drive.name, {})[gap] = found
        self._record({"kind": KIND, "gap": found})
        name = "register_refused" if points else "gap_refused"
        self._tell(Event(time=time, drive=drive.name, name=name, text=found.text))

    def _keep_apart(self, drive: Drive) -> None:
        gaps = {*self._refused.get(drive.name, ()), *self._suspects.get(drive.name, ())}
        self._forbid(drive, tuple(sorted(gaps)))
        missing = self._missing.get(drive.name)
        if missing is not None:  # nothing may be wanted where no read may pass
            reasons = {name: refusal(drive, gap.code) for gap in missing.values() for name in gap.points}
            self._leave_out(drive, reasons)
            self._forbid(drive, tuple(sorted({*gaps, *missing})))


def _refused_in(drive: Drive, samples: Sequence[Sample]) -> list[tuple[int, int, tuple[str, ...]]]:
    """The registers that a drive says it has not, and their points."""
    said = {refusal(drive, code) for code in address_codes(drive.profile)}
    names = [split_tag(s.tag)[1] for s in samples if s.quality is Quality.REFUSED and s.reason in said]
    pieces = apart(drive.profile.points[name] for name in names)
    return [
        (piece[0].address, max(p.address + p.words for p in piece) - 1, tuple(p.name for p in piece))
        for piece in pieces
    ]


def _stand_there(drive: Drive, gap: RefusedGap) -> bool:
    """Whether the registers that a drive had not are still those of the same points."""
    points = [drive.profile.points.get(name) for name in gap.points]
    return all(p is not None and gap.first <= p.address <= gap.last for p in points)


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
