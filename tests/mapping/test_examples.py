"""The example sites that come with the gateway."""

from __future__ import annotations

from pathlib import Path

import pytest

from gateway.mapping.finding import has_errors
from gateway.mapping.load import load_site
from tests.mapping.texts import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("*.yaml"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_it_loads_and_the_site_file_itself_has_no_finding(path: Path) -> None:
    site, findings = load_site(path)
    assert site is not None
    assert not has_errors(findings)
    assert [str(found) for found in findings if found.file == str(path)] == []


def test_three_makes_are_called_as_the_site_says() -> None:
    site, _ = load_site(ROOT / "examples" / "three-makes.yaml")
    assert site is not None
    fan, mixer, pump = site.drives
    assert [drive.profile.name for drive in site.drives] == ["teco-7200gs", "s2000", "shihlin-sl3"]
    assert [line.framing for line in site.lines] == ["rtu", "rtu", "ascii"]
    assert fan.names is not None and mixer.names is not None and pump.names is not None
    assert fan.names.points["running"].node == "north.fan-1.running"
    assert (mixer.names.topic, mixer.names.points["frequency_command"].topic) == (
        "plant7/hall-2/mixer",
        "speed",
    )
    assert mixer.names.points["frequency_command"].node == "MIXER.SPEED"
    assert pump.names.topic == "plant7/pump-1"
