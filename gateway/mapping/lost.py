"""What is left out of a file because it is wrong, so that everything else can be judged in the same pass.

Whoever looks something up asks here before complaining: a name that nobody declares may be declared in a
part that was left out, and a value may fail only because of what is wrong elsewhere.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from fnmatch import fnmatchcase

from gateway.mapping.node import Node, Path

NAME = "name"
"""Stands for the key of an entry itself, where only how it is spelled is wrong."""
HARMLESS = ("help", "source", "doubt", "rate", NAME)
"""Keys without which an entry means the same."""
PLACING = (
    *("at", "bit", "bits", "type", "repeat", "stride", "shift", "select"),
    *("kind", "access", "when", "cases", "always", "image"),
)
"""Keys that tell which bits an entry takes, and whether it reads or writes them."""
_BELOW = ("points", "bits")
"""Keys whose entries stand for themselves: what is wrong in one of them does not hurt the table above."""
_SILENT = ("help", "doubt", "title")
"""Keys whose text is for people and names nothing."""
_WORD = re.compile(r"[A-Za-z][\w-]*(?:<n>[\w-]*)?")
_NUMBER = "<n>"
_ALIKE = 0.6
"""So alike is a misspelled key to the one that is meant."""


class Lost:
    """The parts that were left out, the names that they may declare, and the names that they may use."""

    def __init__(self, root: Node) -> None:
        self._root = root
        self.paths: set[Path] = set()
        self.everything = False
        """True when nobody can tell which names were left out."""
        self._names: set[str] = set()
        self._repeated: list[re.Pattern[str]] = []
        self._uses: set[str] = set()
        self._unclear: set[Path] = set()
        self._gather(root, ())

    def __bool__(self) -> bool:
        return bool(self.paths or self._unclear) or self.everything

    def add(self, path: Path) -> None:
        """Leave out what stands at ``path``, with every name in it."""
        self.paths.add(path)
        node = self._root.at(path)
        self.declare(str(path[-1]) if path else "")
        for word in _words(node) if node is not None else ():
            self.declare(word)
            self._uses.add(word)

    def doubt(self, path: Path) -> None:
        """Look no further at an entry that lost something: its name is declared, and it may use others."""
        self.declare(str(path[-1]))
        node = self._root.at(path)
        self._uses.update(_words(node) if node is not None else ())

    def declare(self, name: str) -> None:
        """Take a name for known from here on; ``<n>`` in it stands for any number."""
        if _NUMBER in name:
            self._repeated.append(re.compile(r"\d+".join(map(re.escape, name.split(_NUMBER)))))
        self._names.add(name)

    def absorb(self, other: Lost) -> None:
        """Take the names of another file's lost parts for known."""
        self._names |= other._names
        self._repeated += other._repeated
        self.everything = self.everything or other.everything

    def name(self, name: str) -> bool:
        """True when a part that was left out may declare this name."""
        known = name in self._names or any(pattern.fullmatch(name) for pattern in self._repeated)
        return self.everything or known

    def fitting(self, pattern: str) -> bool:
        """True when a name that was left out may fit a glob pattern."""
        return self.everything or any(fnmatchcase(name, pattern) for name in self._names)

    def keys_of(self, section: str) -> Iterator[str]:
        """The keys of a section of the file that were left out, alone or with all of it."""
        for path in self.paths:
            if path[0] == section and len(path) > 1:
                yield str(path[1])
            elif len(path) == 1 and spelled_like(str(path[0]), section):
                node = self._root.at(path)
                yield from node.keys if node is not None else ()

    def use(self, name: str) -> bool:
        """True when a part that was left out may use this name."""
        return self.everything or name in self._uses

    def covers(self, path: Path) -> bool:
        """True when ``path`` is, or lies in, a part that was left out."""
        return any(path[:length] in self.paths for length in range(len(path) + 1))

    def inside(self, path: Path) -> bool:
        """True when something was left out at ``path`` or below."""
        lost = self.paths | self._unclear
        return self.everything or any(place[: len(path)] == path for place in lost)

    def hurts(self, path: Path) -> bool:
        """True when an entry, or a table above it, lost a key that changes what the entry means."""
        return any(hurts(lost, level) for level in _levels(path) for lost in self.paths)

    def displaces(self, path: Path) -> bool:
        """True when an entry, or a table above it, lost a key that changes where the entry is."""
        return any(displaces(lost, level) for level in _levels(path) for lost in self.paths)

    def _gather(self, node: Node, path: Path) -> None:
        """Note what the reader has left out already."""
        if node.blind:
            self.everything = True
            self.add(path)
        for refused in node.refused:
            self._unclear.add(path)
            for word in _words(refused):
                self.declare(word)
        if isinstance(node.value, dict):
            for key in node.keys.keys() - node.value.keys():
                self.add((*path, key))
            for key, child in node.value.items():
                self._gather(child, (*path, key))
        elif isinstance(node.value, list):
            if node.refused:
                self.add(path)
            for index, child in enumerate(node.value):
                self._gather(child, (*path, index))


def spelled_like(word: str, other: str) -> bool:
    """True when one is probably a misspelling of the other."""
    return difflib.SequenceMatcher(None, word, other).ratio() >= _ALIKE


def hurts(wrong: Path, path: Path) -> bool:
    """True when something wrong at one place changes what the table at ``path`` itself means."""
    key = _own_key(wrong, path)
    return key is not None and key not in HARMLESS


def displaces(wrong: Path, path: Path) -> bool:
    """True when something wrong at one place changes where the entry at ``path`` itself is."""
    return _own_key(wrong, path) in ("", *PLACING)


def _own_key(wrong: Path, path: Path) -> str | None:
    """The key of a table that something wrong belongs to: empty if it is the table itself, None if it stands
    elsewhere or in an entry below."""
    rest = wrong[len(path) :]
    if wrong[: len(path)] != path or (len(rest) > 1 and rest[0] in _BELOW):
        return None
    return str(rest[0]) if rest else ""


def _levels(path: Path) -> Iterator[Path]:
    """The tables whose keys hold for an entry: group, register, field."""
    yield from (path[:index] for index, part in enumerate(path) if part in _BELOW)
    yield path


def _words(node: Node) -> Iterator[str]:
    """Every word of a part of the file that may be a name."""
    if isinstance(node.value, str):
        yield from _WORD.findall(node.value)
    elif isinstance(node.value, list):
        for child in node.value:
            yield from _words(child)
    else:
        for key in node.keys:
            yield from _WORD.findall(key)
        for key, child in node.value.items():
            yield from _words(child) if key not in _SILENT else ()
