"""The journal read by somebody else than the gateway: its entries, and whether its chain is whole. Pure.

Works while a core writes: what it is just writing shows as half a line at the end, which is no break.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from gateway.core.chain import HALF, Head, Line, lines_of
from gateway.core.disk import Disk


@dataclass(frozen=True, slots=True)
class Passage:
    """A line and the file that it stands in."""

    file: str
    line: Line


@dataclass(frozen=True, slots=True)
class Break:
    """A place where the chain is not whole; ``n`` is the entry that stands there, None if there is none."""

    file: str
    line: int
    n: int | None
    problem: str


@dataclass(slots=True)
class Checked:
    """What a look at every line showed."""

    files: int = 0
    entries: int = 0
    first: Head | None = None
    """The first line that is there; one with another number than 1 tells that older files are gone."""
    last: Head = field(default_factory=Head)
    breaks: list[Break] = field(default_factory=list)
    half: str = ""
    """The file at whose end half a line stands."""
    unended: list[int] = field(default_factory=list)
    """Runs that did not end in good order: what they did last may be missing."""
    holds: bool = False
    """The hash that was asked for is that of a line."""


def passages(disk: Disk) -> Iterator[Passage]:
    """Every line of every file, oldest first, held against the line before it.

    Raises:
        OSError: if a file cannot be read.
    """
    before: Head | None = None
    for name in disk.names():
        try:
            data = disk.read(name)
        except FileNotFoundError:  # the gateway has just let go of its oldest file
            continue
        for line in lines_of(data, before):
            yield Passage(name, line)
            before = line.head if line.entry is not None else before


def check(disk: Disk, hash: str = "") -> Checked:
    """Look at every line; ``hash`` is one to be found among them.

    Raises:
        OSError: if a file cannot be read.
    """
    found = Checked()
    names: dict[str, None] = {}
    half: Passage | None = None
    for passage in passages(disk):
        names[passage.file] = None
        if half is not None:
            found.breaks.append(_break(half))
        half = passage if passage.line.problem == HALF else None
        if half is None:
            _take(found, passage, hash)
    found.files = len(names)
    found.half = half.file if half is not None else ""
    return found


def _take(found: Checked, passage: Passage, hash: str) -> None:
    line = passage.line
    if line.problem:
        found.breaks.append(_break(passage))
    if line.entry is None:
        return
    found.entries += 1
    found.first = found.first or line.head
    found.last = line.head
    found.holds = found.holds or line.head.hash == hash
    if line.entry["kind"] == "boot" and line.entry.get("ended") is False:
        found.unended.append(int(line.entry["run"]) - 1)


def _break(passage: Passage) -> Break:
    line = passage.line
    n = line.head.n if line.entry is not None else None
    return Break(passage.file, line.number, n, line.problem)
