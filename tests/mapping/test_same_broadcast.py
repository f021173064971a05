"""H18: nothing is sent to all drives of a line unless all of them understand the same by it."""

from __future__ import annotations

from pathlib import Path

import pytest

from gateway.mapping.load import builtin_mappings, load_site

SITE = """
site: plant7
gateway: gw1
lines:
  north:
    port: "simulated:"
    serial: 9600 8N1
    broadcast: engineer
    drives:
      pump-1: {profile: s2000, unit: 1, settings: {e1_04: 60}, comm_loss: any}
      pump-2: {profile: other, unit: 2, settings: {e1_04: 50}, comm_loss: any}
"""
REFUSED = "`pump-2` (other) means something else by what is sent to all"


def messages(folder: Path, old: str, new: str) -> list[str]:
    """What is said of a line where one of two drives has another profile than the other."""
    text = (builtin_mappings() / "s2000.yaml").read_text(encoding="utf-8")
    head, mark, broadcast = text.partition("\nbroadcast:")
    assert old in broadcast
    changed = (head + mark + broadcast.replace(old, new)).replace("profile: s2000", "profile: other", 1)
    (folder / "other.yaml").write_text(changed, encoding="utf-8")
    (folder / "site.yaml").write_text(SITE, encoding="utf-8")
    return [finding.message for finding in load_site(folder / "site.yaml")[1]]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("unit: 1/300 %", "unit: 1/100 %"),
        ("range: 0..100\n", "range: 0..50\n"),
        ("at: 0002H", "at: 0003H"),
        ("pulse: 200ms", "pulse: 100ms"),
        ("run_all: true, reverse_all: false, ", "run_all: true, reverse_all: true, "),
        ("within: 60s", "within: 30s"),
        ("image: true", "image: false"),
    ],
)
def test_drives_that_mean_different_things_are_not_commanded_together(
    tmp_path: Path, old: str, new: str
) -> None:
    assert REFUSED in messages(tmp_path, old, new)


def test_other_words_for_the_same_are_no_difference(tmp_path: Path) -> None:
    assert messages(tmp_path, "help: Run all drives of the line forward", "help: Forward") == []
