"""By what a drive model can be told from others, by reading alone. Pure.

Which registers it has and which it refuses, how many it gives at once, whether it knows loop-back: what its
profile says of these is put to the drive.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from gateway.mapping.profile import Kind, Point, Profile
from gateway.modbus.pdu import READ_LIMIT
from gateway.scan.ask import LOOP, LOOP_BACK, Ask, is_plain, runs

BLOCKS = 4
"""Blocks of registers that are tried for each profile."""
MONITORED = (Kind.STATUS, Kind.MEASUREMENT, Kind.FAULT)


@dataclass(frozen=True, slots=True)
class Check:
    """Something to ask, and whether a drive of this model answers it (else it refuses); ``what`` in words."""

    ask: Ask
    answered: bool
    what: str


def checks_of(profile: Profile) -> list[Check]:
    """What can be asked to tell this model from others; the profile is `as_delivered`."""
    plain = [point for point in profile.points.values() if is_plain(point)]
    found = [Check(LOOP, LOOP_BACK in profile.modbus.functions, str(LOOP)), *_blocks(profile, plain)]
    return [*found, *_too_many(profile, plain), *_holes(profile, plain)]


def _blocks(profile: Profile, plain: list[Point]) -> list[Check]:
    """The blocks with the most that is monitored: whole, each in one read."""

    def worth(block: list[Point]) -> tuple[int, int]:
        return -sum(point.kind in MONITORED for point in block), block[0].address

    blocks = [block for run in runs(plain) for block in _cut(run, profile.modbus.read_max)]
    asks = [_ask(block) for block in sorted(blocks, key=worth)[:BLOCKS]]
    return [Check(ask, True, str(ask)) for ask in asks]


def _cut(run: list[Point], most: int) -> Iterator[list[Point]]:
    """Blocks of at most so many registers; no value is cut in two."""
    block: list[Point] = []
    for point in run:
        if block and point.address + point.words - block[0].address > most:
            yield block
            block = []
        block.append(point)
    yield block


def _ask(block: list[Point]) -> Ask:
    end = max(point.address + point.words for point in block)
    return Ask(block[0].address, end - block[0].address)


def _too_many(profile: Profile, plain: list[Point]) -> Iterator[Check]:
    """One register more than the drive gives at once, all of which it has."""
    more = profile.modbus.read_max + 1
    for run in runs(plain):
        ask = _ask(run)
        if more <= READ_LIMIT and (ask.count >= more or profile.modbus.bridge):
            yield Check(Ask(ask.address, more), False, f"{more} registers at once")
            return


def _holes(profile: Profile, plain: list[Point]) -> Iterator[Check]:
    """A register that belongs to nothing is refused; where reads may pass over such, one that does."""
    taken = {a for p in profile.points.values() for a in range(p.address, p.address + p.words)}
    spans = [_ask(run) for run in runs(plain)]
    for span, following in pairwise(spans):
        end = span.address + span.count
        across = Ask(end - 1, following.address - end + 2)
        if end in taken or end in profile.words:
            continue
        if not profile.modbus.bridge:
            yield Check(Ask(end), False, f"{Ask(end)}, which its map has not")
            return
        if across.count <= profile.modbus.read_max:
            yield Check(across, True, f"{across}, across what its map has not")
            return
