"""Where profiles are found: folders in the order in which they are searched."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gateway.mapping.finding import Finding

SUFFIX = ".yaml"
_PROFILE = re.compile(rb"^[\"']?profile[\"']?\s*:", re.MULTILINE)
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")


@dataclass(frozen=True, slots=True)
class File:
    """A file that was read: its name in findings, and its bytes."""

    name: str
    data: bytes


class Library:
    """The profiles in some folders; of two with one name the first counts. ``digest`` covers all that was
    taken out."""

    def __init__(self, folders: Sequence[Path], start: bytes = b"") -> None:
        self._folders = folders
        self._taken: set[Path] = set()
        self.digest = hashlib.sha256(start)

    def find(self, name: str) -> Path | None:
        """The file of a profile; None when no folder has it."""
        if not _NAME.fullmatch(name):
            return None
        files = (folder / f"{name}{SUFFIX}" for folder in self._folders)
        return next((file for file in files if file.is_file()), None)

    def names(self) -> list[str]:
        """All profiles that can be found."""
        files = (file for folder in self._folders for file in folder.glob(f"*{SUFFIX}"))
        return sorted({file.stem for file in files if is_profile(file.read_bytes())})

    def take(self, path: Path) -> File:
        """A file of the library. Raises `OSError` when it cannot be read."""
        data = path.read_bytes()
        if path not in self._taken:
            self.digest.update(data)
            self._taken.add(path)
        return File(str(path), data)


def is_profile(data: bytes) -> bool:
    """True for a file that says that it is a profile, whatever else is in it."""
    return _PROFILE.search(data) is not None


def unreadable(path: Path, error: OSError) -> Finding:
    """The finding about a file that cannot be read."""
    message = f"cannot be read: {error.strerror}"
    return Finding("error", str(path), 1, 1, message, "check the path and its rights")
