"""What the journal does to its folder, and nothing else. Shell.

Everything may raise OSError. Tests put a disk in its place that fails at any byte.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Protocol

PATTERN = "journal-*.jsonl"


class File(Protocol):
    """A file that is open for appending."""

    def size(self) -> int:
        """Bytes in it."""
        ...

    def read(self, start: int, count: int) -> bytes:
        """So many bytes of it."""
        ...

    def cut(self, size: int) -> None:
        """Make it end after so many bytes."""
        ...

    def append(self, data: bytes) -> None:
        """Write at its end. When that fails, some of it may stand there."""
        ...

    def sync(self) -> None:
        """Have everything in it on the disk when this returns."""
        ...

    def in_place(self) -> bool:
        """False when it was removed, or another one has its name."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class Disk(Protocol):
    """The folder of the journal."""

    def names(self) -> list[str]:
        """The files of the journal, oldest first."""
        ...

    def read(self, name: str) -> bytes:
        """The whole content of a file."""
        ...

    def open(self, name: str) -> File:
        """Open a file that is there."""
        ...

    def create(self, name: str) -> File:
        """Make an empty file, in place of one that may be there."""
        ...

    def remove(self, name: str) -> None:
        """Remove a file."""
        ...

    def sync(self) -> None:
        """Have the list of files on the disk when this returns."""
        ...


class Folder:
    """A `Disk` that is one."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def names(self) -> list[str]:
        return sorted(path.name for path in self._path.glob(PATTERN))

    def read(self, name: str) -> bytes:
        return (self._path / name).read_bytes()

    def open(self, name: str) -> File:
        return _Open(self._path / name, os.O_RDWR | os.O_APPEND)

    def create(self, name: str) -> File:
        return _Open(self._path / name, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_TRUNC)

    def remove(self, name: str) -> None:
        (self._path / name).unlink(missing_ok=True)

    def sync(self) -> None:
        folder = os.open(self._path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


class _Open:
    """A `File` in a folder."""

    def __init__(self, path: Path, flags: int) -> None:
        self._path = path
        self._fd = os.open(path, flags | os.O_CLOEXEC, 0o640)

    def size(self) -> int:
        return os.fstat(self._fd).st_size

    def read(self, start: int, count: int) -> bytes:
        return os.pread(self._fd, count, start)

    def cut(self, size: int) -> None:
        os.ftruncate(self._fd, size)

    def append(self, data: bytes) -> None:
        left = memoryview(data)
        while left:
            left = left[os.write(self._fd, left) :]

    def sync(self) -> None:
        os.fdatasync(self._fd)

    def in_place(self) -> bool:
        try:
            return os.path.samestat(self._path.stat(), os.fstat(self._fd))
        except FileNotFoundError:
            return False

    def close(self) -> None:
        os.close(self._fd)
