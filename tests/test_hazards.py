"""The rows of docs/safety.md: each has a test that bears its id; and those that have no better place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from gateway.cli import app
from gateway.mapping.load import load_site
from gateway.tag import Cause, Verdict
from tests.core.world import World

ROOT = Path(__file__).parents[1]
ROWS = re.findall(r"^\| ([A-Z]\d+(?:, [A-Z]\d+)*) \|", (ROOT / "docs/safety.md").read_text(), re.MULTILINE)
IDS = [id for row in ROWS for id in row.split(", ")]
ELSEWHERE = ("S1", "D4", "E3")
"""Rows about transport, whose tests are those of the adapters."""


def test_no_row_stands_twice() -> None:
    assert len(set(IDS)) == len(IDS) > 25


@pytest.mark.parametrize("id", [id for id in IDS if id not in ELSEWHERE])
def test_each_row_has_a_test_that_bears_its_id(id: str) -> None:
    bears = re.compile(rf"def test_(?:[a-z]\d+_)*{id.lower()}_")
    assert any(bears.search(file.read_text()) for file in sorted((ROOT / "tests").rglob("test_*.py")))


def test_t4_the_configuration_in_force_is_on_record_and_in_the_catalogue() -> None:
    world = World()
    [boot] = [entry for entry in world.journal if entry["kind"] == "boot"]
    assert boot["configuration"] == world.core.catalogue.digest == world.site.digest


def test_t4_t5_a_site_with_one_mistake_is_not_loaded_at_all(tmp_path: Path) -> None:
    file = tmp_path / "site.yaml"
    file.write_text(
        "site: plant7\ngateway: gw1\nlines: {}\nlines: {}\nwrites: {enabled: !!python/name:os ''}\n"
    )
    site, findings = load_site(file)
    assert site is None
    assert len(findings) >= 2


def test_i1_a_password_in_the_site_file_is_refused_and_not_repeated(tmp_path: Path) -> None:
    file = tmp_path / "site.yaml"
    file.write_text((ROOT / "tests/mapping/bad/site/password.yaml").read_text())
    site, findings = load_site(file)
    assert site is None
    assert len(findings) == 2
    assert not any("hunter2" in str(finding) for finding in findings)


def test_h15_run_and_speed_go_in_one_frame() -> None:
    world = World()
    world.run(1.0)
    assert world.command("run_forward", frequency=60.0).verdict is Verdict.CONFIRMED
    assert world.sent() == ["05 10 00 01 00 02 04 00 01 17 70 78 87"]


def test_h19_direction_is_a_tag_of_its_own_and_a_sign_is_refused() -> None:
    world = World()
    world.run(1.0)
    assert world.command("run_forward", frequency=-10.0).cause is Cause.OUT_OF_RANGE
    assert world.command("run_reverse", frequency=10.0).verdict is Verdict.CONFIRMED
    shown = {sample.tag: sample.value for sample in world.read("fan-1.running_reverse", "fan-1.reverse")}
    assert shown == {"fan-1.running_reverse": True, "fan-1.reverse": True}
    assert world.read("fan-1.frequency_command")[0].value == 10.0


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"]])
def test_h23_it_says_that_it_is_no_safety_device(words: list[str]) -> None:
    assert "Not a safety device" in CliRunner().invoke(app, words).output
    for document in ("README.md", "docs/safety.md"):
        assert "not a safety device" in (ROOT / document).read_text()
