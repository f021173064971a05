"""Commands against a running gateway: the supervisor, the core and a simulated drive, all real."""

from __future__ import annotations

import re
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from gateway.bridge.place import running, socket_path
from tests.cli.program import GATEWAY, gateway, small_site

pytestmark = pytest.mark.xdist_group("running")

SETTLE = 90.0


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The site file of a gateway that runs and whose drive answers."""
    folder = tmp_path_factory.mktemp("running")
    path = small_site(folder)
    with (
        (folder / "log").open("wb") as log,
        subprocess.Popen([*GATEWAY, "run", str(path)], stderr=log) as process,
    ):
        try:
            wait_until_up(path)
            yield path
        finally:
            process.send_signal(signal.SIGINT)
            asked = time.monotonic()
            code = process.wait(10)
    assert code == 0
    assert time.monotonic() - asked < 2.5
    assert not running(folder / "data")
    assert not socket_path(folder / "data").exists()


def wait_until_up(path: Path) -> None:
    """Return when the drive answers."""
    limit = time.monotonic() + SETTLE
    while "drive fan-1: up" not in gateway("health", path).out:
        assert time.monotonic() < limit, "the gateway has not come up"


def test_read(site: Path) -> None:
    ran = gateway("read", site, "fan-1.output_frequency", "--json")
    assert ran.code == 0
    (sample,) = ran.objects
    assert (sample["tag"], sample["unit"], sample["quality"]) == ("fan-1.output_frequency", "Hz", "good")


def test_read_of_a_tag_that_is_not_there(site: Path) -> None:
    ran = gateway("read", site, "fan-1.speed")
    assert ran.code == 2
    assert ran.err.startswith("error: no readable tag matches 'fan-1.speed'")


def test_a_command_is_confirmed_and_shows_on_the_wire(site: Path) -> None:
    ran = gateway("command", site, "fan-1", "run_forward", "frequency=60", "--json")
    assert (ran.code, ran.objects[0]["verdict"]) == (0, "confirmed")
    frames = gateway("trace", site, "north", "--json").objects
    sent = [frame["data"] for frame in frames if frame["sent"]]
    request = "05 10 00 01 00 02 04 00 01 17 70 78 87"
    assert request in sent
    answers = [frame["data"] for frame in frames[[f["data"] for f in frames].index(request) :]]
    assert answers[1] == "05 10 00 01 00 02 11 8C"
    stopped = gateway("command", site, "fan-1", "stop", "--json")
    assert stopped.objects[0]["verdict"] == "confirmed"


def test_the_trace_as_text_and_for_wireshark(site: Path, tmp_path: Path) -> None:
    text, packed = tmp_path / "trace.txt", tmp_path / "trace.pcapng"
    text.write_text(gateway("trace", site).out)
    head, first = text.read_text().splitlines()[:2]
    assert head == "# line north: rtu 9600 8N2 on simulated:"
    assert re.fullmatch(r"\S+\.\d{6}Z  north  >> 05 03( [0-9A-F]{2}){6}  \w+", first)
    assert gateway("trace", site, "--pcapng", packed).code == 0
    again = gateway("trace", site, "--from", packed).out.splitlines()
    assert again[:2] == [head, first] and len(again) >= len(text.read_text().splitlines())
    assert gateway("trace", site, "--last", "0").out == f"{head}\n"


def test_a_trace_can_be_followed(site: Path) -> None:
    with subprocess.Popen(
        [*GATEWAY, "trace", str(site), "--last", "0", "--follow"], stdout=subprocess.PIPE, text=True
    ) as following:
        assert following.stdout is not None
        assert following.stdout.readline().startswith("# line north")
        gateway("read", site, "fan-1.output_frequency")
        assert "  north  >> 05 03 " in following.stdout.readline()
        following.send_signal(signal.SIGINT)
    assert following.returncode == 130


def test_a_write_is_confirmed_by_reading_back(site: Path) -> None:
    ran = gateway("write", site, "fan-1.frequency_command=30", "--json")
    assert ran.code == 0
    assert (ran.objects[0]["verdict"], ran.objects[0]["value"]) == ("confirmed", 30.0)


def test_a_write_beyond_the_range_is_refused(site: Path) -> None:
    ran = gateway("write", site, "fan-1.frequency_command=1000")
    assert ran.code == 1
    assert ran.out.startswith("refused  fan-1.frequency_command=1000: ")


def test_watch_tells_changes(site: Path) -> None:
    ran = gateway("watch", site, "fan-1.output_frequency", "--for", "1", "--json")
    assert ran.code == 0
    assert [sample for sample in ran.objects if sample["quality"] == "good"]


def test_a_second_gateway_is_refused(site: Path) -> None:
    ran = gateway("run", site)
    assert ran.code == 1
    assert "already running" in ran.err


def test_health_for_programs(site: Path) -> None:
    (health,) = gateway("health", site, "--json").objects
    assert health["lines"][0]["up"] is True
    assert health["drives"] == {"fan-1": True}


def test_the_doctor_finds_nothing_and_shows_figures(site: Path) -> None:
    ran = gateway("doctor", site, "--json")
    assert ran.code == 0
    (visit,) = ran.objects
    assert (visit["line"], visit["healthy"], visit["diagnoses"]) == ("north", True, [])
    assert visit["figures"]["gap_violations"] == 0
    assert visit["drives"]["fan-1"]["answered"] > 0
    words = gateway("doctor", site).out
    assert words.startswith("line north (rtu 9600 8N2, ")
    assert "  healthy" in words


def test_a_tag_of_the_gateways_own_is_read_and_explained(site: Path) -> None:
    (condition,) = gateway("read", site, "_north.condition", "--json").objects
    assert (condition["value"], condition["quality"]) == ("healthy", "good")
    (found,) = gateway("explain", site, "_north.condition", "--json").objects
    assert (found["kind"], found["node"]) == ("diagnostic", "ns=2;s=_north.condition")


def test_explain_tells_who_wants_a_tag(site: Path) -> None:
    (found,) = gateway("explain", site, "fan-1.running", "--json").objects
    assert found["running"] is True
    assert [who["who"] for who in found["wanted"]] == ["core"]
    assert 0 < found["wanted"][0]["period"] <= 1
    assert found["block"]["first"] == found["block"]["last"] == "0020H"
    assert 0 < found["period"] <= 1 and found["age"] > 0
    assert "core every" in gateway("explain", site, "fan-1.running").out
    (idle,) = gateway("explain", site, "fan-1.jog_frequency", "--json").objects
    assert (idle["wanted"], idle["block"]) == ([], None)
