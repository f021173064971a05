"""A disk that fails at any byte, and loses at a crash what was not synced."""

from __future__ import annotations

import errno
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(slots=True)
class Content:
    """A file: what stands in it, and what would after a crash at the worst moment."""

    now: bytearray = field(default_factory=bytearray)
    safe: bytes = b""


Fail = Callable[[str], bool]
"""Whether this operation fails: ``append``, ``sync``, ``cut`` ..."""


class FaultyDisk:
    """A `gateway.core.disk.Disk` in memory.

    ``room`` is how many bytes it still takes (None: any number), ``fails`` decides about every operation.
    """

    def __init__(self) -> None:
        self.files: dict[str, Content] = {}
        self.safe: dict[str, Content] = {}
        self.room: int | None = None
        self.fails: Fail = lambda operation: False

    def attempt(self, operation: str) -> None:
        if self.fails(operation):
            raise OSError(errno.EIO, f"{operation} failed")

    def names(self) -> list[str]:
        self.attempt("names")
        return sorted(self.files)

    def read(self, name: str) -> bytes:
        self.attempt("read")
        return bytes(self.files[name].now)

    def open(self, name: str) -> FaultyFile:
        self.attempt("open")
        if name not in self.files:
            raise FileNotFoundError(errno.ENOENT, name)
        return FaultyFile(self, name, self.files[name])

    def create(self, name: str) -> FaultyFile:
        self.attempt("create")
        content = self.files.setdefault(name, Content())
        self._free(len(content.now))
        content.now.clear()
        return FaultyFile(self, name, content)

    def remove(self, name: str) -> None:
        self.attempt("remove")
        content = self.files.pop(name, None)
        if content is not None:
            self._free(len(content.now))

    def sync(self) -> None:
        self.attempt("sync folder")
        self.safe = dict(self.files)

    def crash(self, kept: Callable[[int], int], zeros: bool, listed: Callable[[str], bool]) -> FaultyDisk:
        """What is there after the power failed: of everything that was not synced, as much as ``kept`` says,
        and files whose coming or going was not synced if ``listed`` says so. With ``zeros`` the end of what
        was kept is zeros, as some file systems leave it."""
        after = FaultyDisk()
        names = set(self.files) | set(self.safe)
        for name in sorted(names):
            if (name in self.files) != (name in self.safe) and not listed(name):
                continue
            content = self.files.get(name) or self.safe[name]
            survived = _survived(content, kept, zeros)
            after.files[name] = after.safe[name] = Content(bytearray(survived), survived)
        return after

    def _free(self, count: int) -> None:
        if self.room is not None:
            self.room += count


def _survived(content: Content, kept: Callable[[int], int], zeros: bool) -> bytes:
    now, safe = bytes(content.now), content.safe
    if not now.startswith(safe):
        return safe if kept(1) else now
    added = now[len(safe) :]
    survived = added[: kept(len(added))]
    if zeros and survived:
        half = len(survived) // 2
        survived = survived[:half] + bytes(len(survived) - half)
    return safe + survived


class FaultyFile:
    """A file on it."""

    def __init__(self, disk: FaultyDisk, name: str, content: Content) -> None:
        self._disk = disk
        self._name = name
        self._content = content

    def size(self) -> int:
        self._disk.attempt("size")
        return len(self._content.now)

    def read(self, start: int, count: int) -> bytes:
        self._disk.attempt("read part")
        return bytes(self._content.now[start : start + count])

    def cut(self, size: int) -> None:
        self._disk.attempt("cut")
        self._disk._free(len(self._content.now) - size)
        del self._content.now[size:]

    def append(self, data: bytes) -> None:
        room = self._disk.room
        taken = data if room is None else data[:room]
        if self._disk.fails("append"):
            taken = taken[: len(taken) // 2]
        self._content.now += taken
        if room is not None:
            self._disk.room = room - len(taken)
        if len(taken) < len(data):
            raise OSError(errno.ENOSPC, "No space left on device")

    def sync(self) -> None:
        self._disk.attempt("sync")
        self._content.safe = bytes(self._content.now)

    def in_place(self) -> bool:
        self._disk.attempt("stat")
        return self._disk.files.get(self._name) is self._content

    def close(self) -> None:
        self._disk.attempt("close")
