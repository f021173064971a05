"""``gateway scan`` as a program."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from gateway.mapping.load import load_site
from gateway.simulator import SimulatedLine
from gateway.terminal import scanner
from tests.cli.program import GATEWAY, gateway
from tests.scan.lines import line_of

pytestmark = pytest.mark.xdist_group("scan")


@pytest.fixture(scope="module")
def north(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A line with two drives of different makes."""
    drives = [("teco-7200gs", 2), ("shihlin-sl3", 3)]
    with SimulatedLine(line_of("9600 8N2", drives), tmp_path_factory.mktemp("lines")) as line:
        yield line.path


NARROW = ("--baud", "9600", "--framing", "rtu", "--timeout", "1")


def test_what_is_found_becomes_a_site(north: Path, tmp_path: Path) -> None:
    ran = gateway("scan", north, "--units", "1..3", *NARROW)
    assert ran.code == 0
    assert "\nunit 2 at 9600 8?" in "\n" + ran.out
    assert "  teco-7200gs: perhaps TECO 7200GS with SI-M card; " in ran.out
    assert "    + refuses 17 registers at once (03H illegal_count)\n" in ran.out
    assert f"{north}: 2 settings, units 1..3, at most " in ran.err
    site = tmp_path / "site.yaml"
    site.write_text("site: plant7\ngateway: gw1\n" + ran.out[ran.out.index("lines:\n") :])
    loaded, findings = load_site(site)
    assert loaded is not None, findings
    assert [(drive.unit, drive.profile.name) for drive in loaded.drives] == [
        (2, "teco-7200gs"),
        (3, "shihlin-sl3"),
    ]
    assert (loaded.lines[0].baud, loaded.lines[0].framing) == (9600, "rtu")


def test_json(north: Path) -> None:
    ran = gateway("scan", north, "--units", "2", *NARROW, "--json")
    found, end = ran.objects
    assert (found["unit"], found["framing"], found["baud"], found["format"]) == (2, "rtu", 9600, None)
    best = found["suggestions"][0]
    assert (best["profile"], best["likely"], best["fits"]) == ("teco-7200gs", True, best["observations"])
    assert {"fits": True, "text": "station_address shows 2"} in best["reasons"]
    assert (end["found"], end["port"], len(end["untried"])) == (1, str(north), 1)
    assert "profile: teco-7200gs, unit: 2" in end["site"]


def test_only_these_models(north: Path) -> None:
    ran = gateway("scan", north, "--units", "2", *NARROW, "--profiles", "s2000", "--json")
    assert [s["profile"] for s in ran.objects[0]["suggestions"]] == ["s2000"]
    assert ran.objects[0]["suggestions"][0]["likely"] is False


def test_a_port_is_named_by_what_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device, names = tmp_path / "ttyUSB0", tmp_path / "by-id"
    device.touch()
    names.mkdir()
    monkeypatch.setattr(scanner, "BY_ID", names)
    assert scanner._lasting_name(str(device)) == str(device)
    (names / "usb-FTDI_A1").symlink_to(device)
    assert scanner._lasting_name(str(device)) == str(names / "usb-FTDI_A1")
    assert scanner._lasting_name("tcp://host:4001") == "tcp://host:4001"


def test_nobody_answers(north: Path) -> None:
    ran = gateway("scan", north, "--units", "9", "--baud", "9600", "--framing", "rtu", "--timeout", "0.05")
    assert (ran.code, ran.out) == (1, "nobody answered\n")


def test_a_port_that_somebody_has_is_left_alone(tmp_path: Path) -> None:
    from gateway.line.port import open_serial

    config = line_of("9600 8N2", [("teco-7200gs", 2)])
    with SimulatedLine(config, tmp_path) as line:
        from dataclasses import replace

        held = open_serial(replace(config, port=str(line.path)))
        ran = gateway("scan", line.path, "--units", "2", *NARROW)
        held.close()
        assert line.log == []
    assert ran.code == 1
    assert ran.err.endswith("is in use (by a running gateway? it must be stopped first)\n")


def test_ctrl_c_ends_it_and_shows_what_was_found(north: Path) -> None:
    words = [*GATEWAY, "scan", str(north), "--units", "2..247", "--timeout", "0.5", "--json"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as scan:
        assert scan.stdout is not None
        assert '"unit":2' in scan.stdout.readline()
        scan.send_signal(signal.SIGINT)
        rest = scan.stdout.read().splitlines()
    assert scan.returncode == 130
    assert '"found":' in rest[-1] and "Traceback" not in "".join(rest)


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("x", "--units", "0..3"), "'0..3': units are 1..247"),
        (("x", "--units", "a"), "'a' is no unit address, nor a range like 1..31"),
        (("x", "--format", "9N1"), "'9N1' is no format like 8N2"),
        (("x", "--framing", "tcp"), "'tcp' is neither rtu nor ascii"),
        (("x", "--profiles", "teco"), "there is no profile 'teco'"),
        (("simulated:",), "a simulated line has no port of its own"),
        (("tcp://h:1", "--baud", "9600"), "speed and format of a network port are set at its far end"),
        (("modbus://h:1", "--framing", "rtu"), "modbus:// has a framing of its own"),
    ],
)
def test_words_that_cannot_be_meant(words: tuple[str, ...], error: str) -> None:
    ran = gateway("scan", *words)
    assert ran.code == 2
    assert ran.err.startswith(f"error: {error}")


def test_no_such_port(tmp_path: Path) -> None:
    ran = gateway("scan", tmp_path / "none", "--units", "1")
    assert ran.code == 1
    assert "No such file or directory" in ran.err


def test_of_a_port_that_cannot_be_opened_nothing_else_is_told() -> None:
    ran = gateway("scan", "/dev/nothing-there")
    assert (ran.code, ran.out) == (1, "")
    assert ran.err.endswith("/dev/nothing-there: No such file or directory\n")
