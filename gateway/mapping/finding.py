"""Findings: what is wrong in a mapping file, where, and what to do about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from gateway.mapping.lost import Lost, displaces, hurts, spelled_like
from gateway.mapping.node import Node, Path

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One complaint about one place of one file. Lines and columns count from 1."""

    severity: Severity
    file: str
    line: int
    column: int
    message: str
    remedy: str
    also: tuple[int, ...] = ()
    """Other lines of the file that the same mistake makes wrong."""

    def __str__(self) -> str:
        prefix = "warning: " if self.severity == "warning" else ""
        also = f"; also in line {', '.join(map(str, self.also))}" if self.also else ""
        return f"{self.file}:{self.line}:{self.column}: {prefix}{self.message} ({self.remedy}{also})"


class Report:
    """Collects the findings of one file; places are named by their path from the root."""

    def __init__(self, file: str, root: Node) -> None:
        self.file = file
        self.root = root
        self.findings: list[Finding] = []
        self.lost = Lost(root)
        """What was left out, and therefore is not complained about."""
        self._wrong: set[Path] = set()
        self._unknown: set[str] = set()
        self._missing: dict[str, int] = {}
        """Message about a name that nobody declares to the finding that told it first."""

    def error(self, path: Path, message: str, remedy: str, *, key: bool = False) -> None:
        """Add an error at the value of ``path`` (at its key with ``key``)."""
        self._add("error", path, message, remedy, key)

    def warn(self, path: Path, message: str, remedy: str, *, key: bool = False) -> None:
        """Add a warning."""
        self._add("warning", path, message, remedy, key)

    def unknown_name(self, path: Path, name: str, message: str, remedy: str, *, key: bool = False) -> None:
        """Add an error about a name that nobody declares, unless a part that was left out may do so."""
        if self.lost.name(name):
            return
        self._unknown.add(name)
        first = self._missing.get(message)
        if first is None:
            before = len(self.findings)
            self.error(path, message, remedy, key=key)
            if len(self.findings) > before:
                self._missing[message] = before
        else:
            self._also(first, path, key)

    def wrong_key(self, key: str) -> bool:
        """True when there is an error at any key of that name."""
        return any(place[-1:] == (key,) for place in self._wrong)

    def missing(self, name: str) -> bool:
        """True when somebody needs a name that nobody declares, and that was told."""
        return name in self._unknown

    def meant(self, name: str) -> bool:
        """True when a name that nobody declares was probably to be this one."""
        return any(spelled_like(unknown, name) for unknown in self._unknown)

    def _also(self, first: int, path: Path, key: bool) -> None:
        """Name another place where the same name is missing: it is one mistake, be it here or there."""
        self._wrong.add(path)
        file, (line, column) = self.root.place(path, key=key)
        found = self.findings[first]
        if (file or self.file) != found.file or line == found.line:
            return
        lines = sorted({*found.also, found.line, line})
        if line < found.line:
            found = replace(found, line=line, column=column)
        self.findings[first] = replace(found, also=tuple(each for each in lines if each != found.line))

    def wrong(self, path: Path) -> bool:
        """True when there is an error at ``path`` or below, or something was left out there: what follows
        from it is not complained about."""
        return self.lost.inside(path) or any(place[: len(path)] == path for place in self._wrong)

    def doubtful(self, path: Path) -> bool:
        """True when an error changes what the entry at ``path`` means."""
        return self.lost.hurts(path) or any(hurts(place, path) for place in self._wrong)

    def displaced(self, path: Path) -> bool:
        """True when an error changes where the entry at ``path`` is."""
        return self.lost.displaces(path) or any(displaces(place, path) for place in self._wrong)

    @property
    def failed(self) -> bool:
        """True when at least one finding is an error."""
        return has_errors(self.findings)

    def _add(self, severity: Severity, path: Path, message: str, remedy: str, key: bool) -> None:
        if self.lost.covers(path):
            return
        if severity == "error":
            self._wrong.add(path)
        file, (line, column) = self.root.place(path, key=key)
        finding = Finding(severity, file or self.file, line, column, message, remedy)
        if finding not in self.findings:
            self.findings.append(finding)


def some(names: Sequence[str], most: int = 3) -> str:
    """The first few of some names, for a message: `` `a`, `b` and 4 more``."""
    shown = [f"`{name}`" for name in names[: most if len(names) != most + 1 else most + 1]]
    if len(shown) < len(names):
        return f"{', '.join(shown)} and {len(names) - len(shown)} more"
    return " and ".join([*([", ".join(shown[:-1])] if shown[:-1] else []), *shown[-1:]])


def has_errors(findings: list[Finding]) -> bool:
    """True when at least one finding is an error."""
    return any(finding.severity == "error" for finding in findings)


def in_order(findings: list[Finding]) -> list[Finding]:
    """Findings by place; files stay in the order in which they were first seen."""
    files = list(dict.fromkeys(finding.file for finding in findings))
    return sorted(findings, key=lambda f: (files.index(f.file), f.line, f.column))
