"""Findings: what is wrong in a mapping file, where, and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

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

    def __str__(self) -> str:
        prefix = "warning: " if self.severity == "warning" else ""
        return f"{self.file}:{self.line}:{self.column}: {prefix}{self.message} ({self.remedy})"


class Report:
    """Collects the findings of one file; places are named by their path from the root."""

    def __init__(self, file: str, root: Node) -> None:
        self.file = file
        self.root = root
        self.findings: list[Finding] = []
        self.partial = False
        """True when entries were left out because of their form: then a name that nobody declares may
        be one of those, and is not complained about."""

    def error(self, path: Path, message: str, remedy: str, *, key: bool = False) -> None:
        """Add an error at the value of ``path`` (at its key with ``key``)."""
        self._add("error", path, message, remedy, key)

    def warn(self, path: Path, message: str, remedy: str, *, key: bool = False) -> None:
        """Add a warning."""
        self._add("warning", path, message, remedy, key)

    def unknown_name(self, path: Path, message: str, remedy: str, *, key: bool = False) -> None:
        """Add an error about a name that nobody declares, unless it may stand in a part left out."""
        if not self.partial:
            self.error(path, message, remedy, key=key)

    @property
    def failed(self) -> bool:
        """True when at least one finding is an error."""
        return has_errors(self.findings)

    def _add(self, severity: Severity, path: Path, message: str, remedy: str, key: bool) -> None:
        file, (line, column) = self.root.place(path, key=key)
        finding = Finding(severity, file or self.file, line, column, message, remedy)
        if finding not in self.findings:
            self.findings.append(finding)


def has_errors(findings: list[Finding]) -> bool:
    """True when at least one finding is an error."""
    return any(finding.severity == "error" for finding in findings)


def in_order(findings: list[Finding]) -> list[Finding]:
    """Findings by place; files stay in the order in which they were first seen."""
    files = list(dict.fromkeys(finding.file for finding in findings))
    return sorted(findings, key=lambda f: (files.index(f.file), f.line, f.column))
