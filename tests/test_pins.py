"""Dependencies are pinned with hashes, and the pins name no place to load them from."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = ("runtime.txt", "dev.txt")


def requirements(name: str) -> dict[str, str]:
    """Package name to its whole entry, hashes included."""
    text = (ROOT / "requirements" / name).read_text(encoding="utf-8").replace("\\\n", "")
    return {re.split("[=<>~]", line)[0]: line for line in text.splitlines() if line.strip()}


def plain_name(requirement: str) -> str:
    return re.split(r"[^a-z0-9-]", requirement.lower().replace("_", "-"))[0]


@pytest.mark.parametrize("name", FILES)
def test_every_requirement_is_exact_and_has_a_hash(name: str) -> None:
    for package, entry in requirements(name).items():
        assert re.match(rf"{re.escape(package)}==[0-9][^ ]* .*--hash=sha256:[0-9a-f]{{64}}", entry), entry[
            :80
        ]


@pytest.mark.parametrize("name", FILES)
def test_no_place_is_named(name: str) -> None:
    text = (ROOT / "requirements" / name).read_text(encoding="utf-8")
    assert not re.search(r"://|index|find-links|^-|@ ", text, re.MULTILINE)


def test_pins_cover_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    runtime, dev = requirements("runtime.txt"), requirements("dev.txt")
    assert {plain_name(word) for word in project["dependencies"]} <= runtime.keys()
    assert {plain_name(word) for word in project["optional-dependencies"]["dev"]} <= dev.keys()
    assert {dev[package] for package in runtime} == set(runtime.values())
