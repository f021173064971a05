"""Outside names of a site, as ``gateway explain`` shows them."""

from __future__ import annotations

from pathlib import Path

from tests.cli.program import gateway

SITE = Path(__file__).resolve().parents[2] / "examples" / "three-makes.yaml"


def test_a_point_with_a_name_of_its_own() -> None:
    (found,) = gateway("explain", SITE, "mixer-1.frequency_command", "--json").objects
    assert (found["node"], found["browse"]) == ("ns=2;s=MIXER.SPEED", "frequency_command")
    assert found["topic"] == "plant7/hall-2/mixer/state/speed"
    assert found["command_topic"] == "plant7/hall-2/mixer/cmd/speed"


def test_a_command_under_the_templates() -> None:
    (found,) = gateway("explain", SITE, "fan-1.stop", "--json").objects
    assert (found["node"], found["command_topic"]) == ("ns=2;s=north.fan-1.stop", "plant7/fan-1/cmd/stop")
