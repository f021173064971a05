"""Small mapping files for the tests, and the file that comes with the gateway."""

from __future__ import annotations

from pathlib import Path
from textwrap import indent

from gateway.mapping.finding import Finding
from gateway.mapping.load import builtin_mappings, load_profile, profile_of
from gateway.mapping.profile import Profile

ROOT = Path(__file__).resolve().parents[2]
TECO = builtin_mappings() / "teco-7200gs.yaml"
PLANT = ROOT / "examples" / "plant7.yaml"

HEAD = """\
profile: small
title: Small drive
maker: Nobody
models: [S]
version: 1
documents: {m: manual, s: {title: sister, similar: true}}
serial: {baud: [9600], rtu: [8N1]}
modbus: {functions: [03H, 06H, 10H]}
"""


def small(points: str, more: str = "") -> str:
    """A profile with these points in one group ``g``."""
    return f"{HEAD}{more}groups:\n  g:\n    points:\n{indent(points, '      ')}\n"


def load_text(text: str) -> tuple[Profile | None, list[Finding]]:
    """The profile of a text, whose name must be ``small``."""
    return profile_of(text.encode(), "small.yaml", "small")


def good(text: str) -> Profile:
    """The profile of a text without errors."""
    profile, findings = load_text(text)
    assert profile is not None, [str(finding) for finding in findings]
    return profile


def teco() -> Profile:
    """The 7200GS, which must load without any finding."""
    profile, findings = load_profile(TECO)
    assert findings == []
    assert profile is not None
    return profile
