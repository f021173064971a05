"""``gateway explain`` without a running gateway."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.cli.program import gateway, small_site


@pytest.fixture
def site(tmp_path: Path) -> Path:
    return small_site(tmp_path)


def explained(site: Path, tag: str) -> dict[str, Any]:
    (found,) = gateway("explain", site, tag, "--json").objects
    return found


def test_a_measurement(site: Path) -> None:
    found = explained(site, "fan-1.output_frequency")
    assert (found["document"], found["section"]) == ("SI-M interface card, communication manual", "9.2")
    assert (found["registers"], found["bits"], found["unit"], found["exact"]) == (
        ["0024H"],
        None,
        "Hz",
        "1/100",
    )
    assert (found["line"], found["unit_address"], found["profile"]) == ("north", 5, "teco-7200gs")
    assert (found["node"], found["browse"]) == ("ns=2;s=fan-1.output_frequency", "output_frequency")
    assert (found["topic"], found["command_topic"]) == ("plant7/fan-1/state/output_frequency", None)
    assert found["block"]["first"] <= "0024H" <= found["block"]["last"]
    assert found["period"] == 0.2 and found["age"] > 0.2
    assert (found["running"], found["wanted"]) == (False, [])


def test_a_parameter_in_doubt(site: Path) -> None:
    found = explained(site, "fan-1.comm_loss_action")
    assert (found["registers"], found["notation"], found["bits"]) == (["0107H"], "Sn-08", [2, 3])
    assert found["doubt"]
    assert found["only_when"] == ["running: false"]
    assert found["command_topic"] == "plant7/fan-1/cmd/comm_loss_action"
    text = gateway("explain", site, "fan-1.comm_loss_action").out
    for word in ("9.3 (sim)", "Sn-08 0107H.2-3", "doubt", "3=keep_running", "nobody", "ns=2;s="):
        assert word in text


def test_a_command(site: Path) -> None:
    found = explained(site, "fan-1.run_forward")
    assert found["args"] == {"frequency": "frequency_command"}
    assert found["steps"][0]["write"] == {
        "run": True,
        "reverse": False,
        "frequency_command": "<frequency>",
    }
    assert found["steps"][0]["registers"] == ["0001H", "0002H"]
    assert (found["topic"], found["command_topic"]) == (None, "plant7/fan-1/cmd/run_forward")
    assert found["block"] is None


def test_what_is_said_of_a_similar_model(tmp_path: Path) -> None:
    site = tmp_path / "site.yaml"
    drive = "{profile: s2000, unit: 1, settings: {e1_04: 60}}"
    site.write_text(
        "site: plant7\ngateway: gw1\nlines:\n  north:\n    port: simulated\n    serial: 9600 8N1\n"
        f"    drives:\n      fan-1: {drive}\n"
    )
    found = explained(site, "fan-1.speed_agree")
    assert (found["similar_model"], found["source"]) == (True, "a1000 U1-12")
    assert "similar model, unverified" in gateway("explain", site, "fan-1.speed_agree").out


def test_an_unknown_tag_is_2(site: Path) -> None:
    ran = gateway("explain", site, "fan-1.output_freqency")
    assert (ran.code, ran.out) == (2, "")
    assert (
        ran.err == "error: there is no tag 'fan-1.output_freqency' (did you mean fan-1.output_frequency?)\n"
    )
