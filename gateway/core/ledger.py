"""The files of the journal: read back, carried on, rotated. Whatever fails on the way, a chain stays.

``journal-<n>.jsonl``, where n is the number of its first entry, a snapshot; entries go to the newest. What
was written when something failed is cut off before anything else is written, so that a line is whole or is
not there; nothing that was reported as written ever is. A file that somebody else changed is left as it
stands, and a new one is begun.
"""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import msgspec
import structlog

from gateway.core.chain import SNAPSHOT, Entry, Head, Line, lines_of, seal
from gateway.core.disk import Disk, File
from gateway.core.memory import Memory, remembered, snapshot_of

log = structlog.get_logger(__name__)

ROTATE_BYTES = 8 * 1024 * 1024
KEEP_FILES = 40


@dataclass(slots=True)
class Place:
    """Where the chain goes on: in this file, behind so many bytes, the last of which are ``last``."""

    name: str
    size: int
    last: bytes


@dataclass(slots=True)
class Found:
    """What was found in the files: the memory that they make, and what is wrong with them."""

    memory: Memory = field(default_factory=Memory)
    head: Head = field(default_factory=Head)
    place: Place | None = None
    """None: a new file has to be begun."""
    litter: list[str] = field(default_factory=list)
    """Files that were created and never came to hold anything."""
    broken: str = ""
    """Where the chain is broken, if it is."""
    cut: int = 0
    """Bytes behind the last entry: of one that was never finished. They go when the next one is written."""


class Ledger:
    """Writes entries, all of a batch or none.

    Args:
        rotate: bytes from which on a new file is begun.
        keep: files kept, the present one included.
    """

    def __init__(self, disk: Disk, rotate: int = ROTATE_BYTES, keep: int = KEEP_FILES) -> None:
        self._disk = disk
        self._rotate = rotate
        self._keep = keep
        self._found = Found()
        self._file: File | None = None

    def open(self) -> Found:
        """Read back what is there. The memory in it is the caller's own.

        Raises:
            OSError: if the files cannot be read.
        """
        self._found = find(self._disk)
        return replace(self._found, memory=self._found.memory.copy())

    def write(self, entries: Sequence[Entry]) -> None:
        """Have entries on the disk when this returns.

        Raises:
            OSError: if they are not; none of them counts as written then.
        """
        try:
            self._append(self._ready(), entries)
        except OSError:
            self.close()
            raise

    def close(self) -> None:
        """Let go of the file; the next write opens it again."""
        file, self._file = self._file, None
        if file is not None:
            with contextlib.suppress(OSError):
                file.close()

    def _append(self, file: File, entries: Sequence[Entry]) -> None:
        place, head = self._found.place, self._found.head
        assert place is not None
        lines = []
        for entry in entries:
            line, head = seal(entry, head)
            lines.append(line)
        data = b"".join(lines)
        file.append(data)
        file.sync()
        if not file.in_place() or file.size() != place.size + len(data):
            self._found.place = None
            raise OSError(errno.ESTALE, "somebody else removed or changed it")
        self._found.head = head
        self._found.place = Place(place.name, place.size + len(data), lines[-1])
        for entry in entries:
            if problem := self._found.memory.fold(entry):
                log.error("journal entry not remembered", problem=problem, entry=entry)

    def _ready(self) -> File:
        """The file to write to, with nothing behind its last whole entry."""
        while self._found.litter:
            self._disk.remove(self._found.litter[-1])
            self._found.litter.pop()
        self._file = self._file or self._again()
        if self._found.place is not None and self._found.place.size > self._rotate:
            self.close()
            self._found.place = None
        self._file = self._file or self._begin()
        return self._file

    def _again(self) -> File | None:
        """The present file, if it still ends as we left it, with what stands behind that cut off."""
        place = self._found.place
        if place is None:
            return None
        with contextlib.suppress(FileNotFoundError):
            file = self._disk.open(place.name)
            try:
                if file.read(place.size - len(place.last), len(place.last)) == place.last:
                    file.cut(place.size)
                    file.sync()  # or what is written next could get mixed with what was cut off
                    return file
            except OSError:
                file.close()
                raise
            file.close()
        self._found.place = None
        return None

    def _begin(self) -> File:
        """A new file that begins with a snapshot."""
        memory, before = self._found.memory, self._found.head
        stamp = {"time": memory.runs.wall, "after": before.hash}
        line, head = seal({**snapshot_of(memory), **stamp}, before)
        name = f"journal-{head.n:012d}.jsonl"
        file = self._disk.create(name)
        try:
            file.append(line)
            file.sync()  # older files go only when this one can stand for them
            self._disk.sync()
        except OSError:
            file.close()
            raise
        self._found.head = head
        self._found.place = Place(name, len(line), line)
        self._forget_old()
        return file

    def _forget_old(self) -> None:
        with contextlib.suppress(OSError):
            for name in self._disk.names()[: -self._keep]:
                self._disk.remove(name)


def find(disk: Disk) -> Found:
    """What the newest file holds, or as many as it takes to find a snapshot that can be read.

    Raises:
        OSError: if a file cannot be read.
    """
    found = Found()
    files: list[tuple[str, bytes]] = []
    for name in reversed(disk.names()):
        data = disk.read(name)
        first = next(lines_of(data), None)
        if not files and (first is None or (first.entry is None and first.end == len(data))):
            found.litter.append(name)
            continue
        files.append((name, data))
        if first is not None and first.entry is not None and first.entry["kind"] == SNAPSHOT:
            break
    for name, data in reversed(files):
        _take(found, name, data)
    return found


def _take(found: Found, name: str, data: bytes) -> None:
    """Take in the lines of a file. What stands behind its last entry was never finished."""
    last: Line | None = None
    rest: Line | None = None
    problems: list[str] = []
    for line in lines_of(data):
        if line.entry is None:
            rest = rest or line
            continue
        bad = [wrong for wrong in (rest, line) if wrong is not None and wrong.problem]
        problems += [f"{name}:{wrong.number}: {wrong.problem}" for wrong in bad]
        rest, last = None, line
        problems += _understood(found, name, line)
    _settle(found, name, data, last, rest, problems)


def _understood(found: Found, name: str, line: Line) -> Iterator[str]:
    """Fold the entry of a line into the memory; tells if that cannot be done."""
    assert line.entry is not None
    problem = ""
    if line.entry["kind"] != SNAPSHOT:
        problem = found.memory.fold(line.entry)
    else:
        try:
            found.memory = remembered(line.entry)
        except msgspec.ValidationError as error:
            problem = str(error)
    if problem:
        yield f"{name}:{line.number}: {problem}"


def _settle(
    found: Found, name: str, data: bytes, last: Line | None, rest: Line | None, problems: Sequence[str]
) -> None:
    """Where the chain goes on: in this file, or, where something is wrong with it, in a new one."""
    end = len(data) if rest is None else rest.start
    if last is not None:
        found.head = last.head
    if last is None or problems:
        found.place = None
        found.head = Head(max(found.head.n, _number(name)), found.head.hash)
        found.broken = problems[0] if problems else f"{name}: holds no entries"
        return
    found.place = Place(name, end, data[last.start : last.end])
    found.cut = len(data) - end


def _number(name: str) -> int:
    """The number of a file's first entry, 0 where its name tells none."""
    digits = name.removeprefix("journal-").removesuffix(".jsonl")
    return int(digits) if digits.isascii() and digits.isdecimal() else 0
