"""Broken files, each with exactly what the loader says about it.

The expected findings stand at the end of each file as ``# expect: line:column: message (remedy)``; those
about a parent, which is named by ``like``, begin with its file.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from gateway.mapping.finding import has_errors
from gateway.mapping.load import load_profile, load_site

BAD = Path(__file__).parent / "bad"
PREFIX = "# expect: "


def files(kind: str) -> list[Path]:
    return sorted((BAD / kind).glob("*.yaml"))


def expected(path: Path) -> list[str]:
    lines = path.read_text(encoding="utf-8").splitlines()
    found = [line.removeprefix(PREFIX) for line in lines if line.startswith(PREFIX)]
    return [f"{path}:{line}" if line[0].isdecimal() else f"{path.parent}/{line}" for line in found]


@pytest.mark.parametrize("path", files("profile"), ids=lambda path: path.stem)
def test_profile(path: Path) -> None:
    profile, findings = load_profile(path)
    assert [str(finding) for finding in findings] == expected(path)
    assert findings
    assert (profile is None) == has_errors(findings)


@pytest.mark.parametrize("path", files("site"), ids=lambda path: path.stem)
def test_site(path: Path) -> None:
    site, findings = load_site(path)
    assert [str(finding) for finding in findings] == expected(path)
    assert findings
    assert (site is None) == has_errors(findings)


def test_there_are_many() -> None:
    assert len(files("profile")) + len(files("site")) > 100


def test_no_finding_repeats_a_password() -> None:
    _, findings = load_site(BAD / "site" / "password.yaml")
    assert len(findings) == 2
    assert not any("hunter2" in str(finding) for finding in findings)
