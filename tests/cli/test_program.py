"""The command line without a running gateway: help, mistakes, files."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from gateway import __version__
from tests.cli.program import gateway, small_site

RUNNING = ["demo", "run", "simulate", "read", "watch", "write", "command", "trace", "health", "doctor"]
COMMANDS = [*RUNNING, "check", "scan", "plan", "profiles", "explain", "schema", "users"]
HEAVY = ("asyncua", "paho", "pymodbus", "pydantic", "structlog", "yaml", "serial", "cryptography", "asyncio")


@pytest.fixture
def site(tmp_path: Path) -> Path:
    return small_site(tmp_path)


def test_version() -> None:
    assert gateway("--version").out.strip() == __version__


def test_help_names_every_command_and_loads_nothing_heavy() -> None:
    words = [sys.executable, "-X", "importtime", "-m", "gateway", "--help"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=True)
    assert all(f" {command} " in done.stdout for command in COMMANDS)
    loaded = {line.rpartition("|")[2].strip().partition(".")[0] for line in done.stderr.splitlines()}
    assert loaded.isdisjoint(HEAVY)


@pytest.mark.parametrize("command", [command for command in COMMANDS if command != "users"])
def test_every_command_teaches_by_example(command: str) -> None:
    assert f"gateway {command}" in gateway(command, "--help").out


@pytest.mark.parametrize("words", [["fly"], ["read"], ["write", "site.yaml"], ["schema", "motor"]])
def test_wrong_usage_is_2(words: list[str]) -> None:
    ran = gateway(*words)
    assert ran.code == 2
    assert "Traceback" not in ran.err


def test_a_missing_site_is_one_line() -> None:
    ran = gateway("read", "nowhere.yaml", "fan-1.running")
    assert ran.code == 1
    assert ran.err.splitlines() == [ran.err.strip()]
    assert "nowhere.yaml:1:1: cannot be read" in ran.err


def test_check_tells_all_mistakes_with_their_places(site: Path) -> None:
    site.write_text(site.read_text().replace("unit: 5", "unit: 500") + "colour: red\n")
    ran = gateway("check", site)
    assert ran.code == 1
    first, second = ran.out.splitlines()
    assert first.startswith(f"{site}:9:43: ")
    assert "unit addresses" in first
    assert second.startswith(f"{site}:11:1: unknown key `colour`")


def test_check_of_a_good_site(site: Path) -> None:
    ran = gateway("check", site)
    assert (ran.code, ran.err) == (0, "")
    assert "no errors" in ran.out
    assert gateway("check", site, "--json").out == ""


def test_the_demo_site_is_good() -> None:
    assert gateway("check", Path(__file__).parents[2] / "examples" / "demo.yaml").code == 0


def test_plan_reads_every_monitored_register_once(site: Path) -> None:
    ran = gateway("plan", site, "--json")
    assert ran.code == 0
    (line,) = ran.objects
    spans = [range(block["address"], block["address"] + block["count"]) for block in line["blocks"]]
    read = [address for span in spans for address in span]
    assert len(read) == len(set(read))
    assert {0x0020, 0x0024, 0x0031} <= set(read)
    assert 0 < line["load"] < 1


def test_an_overloaded_line_is_a_finding(site: Path) -> None:
    site.write_text(site.read_text() + "rates: {fast: 20ms, normal: 50ms}\n")
    ran = gateway("plan", site)
    assert ran.code == 1
    assert "stretched" in ran.out
    assert "fits: " in ran.out


def test_what_if(site: Path) -> None:
    (as_it_is,) = gateway("plan", site, "--json").objects
    (slower,) = gateway(
        "plan", site, "--json", "--what-if", "rates.fast=500ms", "--what-if", "baud=2400"
    ).objects
    assert (as_it_is["baud"], slower["baud"]) == (9600, 2400)
    assert {block["wanted"] for block in slower["blocks"]} == {0.5, 1.0, 30.0}
    (quicker,) = gateway("plan", site, "--json", "--what-if", "reply=5ms").objects
    assert quicker["blocks"][0]["cost"] < as_it_is["blocks"][0]["cost"]


@pytest.mark.parametrize(
    ("word", "says"),
    [
        ("speed=9", "'speed' cannot be changed on paper; baud, reply and rates.<class> can"),
        ("rates.fats=1s", "there is no rate class 'fats' (did you mean fast?)"),
        ("rates.fast=5ms", "nothing is read more often than every 10 ms"),
        ("rates.fast=0s", "'0s' is no duration like 500ms or 2s"),
        ("baud=fast", "'fast' is no line speed"),
        ("baud", "NAME=VALUE is expected, not 'baud'"),
    ],
)
def test_what_cannot_be_planned_is_2(site: Path, word: str, says: str) -> None:
    ran = gateway("plan", site, "--what-if", word)
    assert (ran.code, ran.err) == (2, f"error: {says}\n")


def test_profiles_as_list_as_table_as_data() -> None:
    assert "teco-7200gs" in gateway("profiles").out
    assert "output_frequency" in gateway("profiles", "teco-7200gs").out
    (profile,) = gateway("profiles", "teco-7200gs", "--json").objects
    point = next(point for point in profile["points"] if point["name"] == "output_frequency")
    assert (point["registers"], point["scale"], point["unit"], point["bits"]) == (["0024H"], 0.01, "Hz", None)
    assert point["source"]
    running = next(point for point in profile["points"] if point["name"] == "running")
    assert (running["registers"], running["bits"], running["value_type"]) == (["0020H"], [0, 0], "boolean")
    assert {"run_forward", "stop"} <= {command["name"] for command in profile["commands"]}


def test_an_unknown_profile_is_2() -> None:
    ran = gateway("profiles", "teco-7200gt")
    assert (ran.code, ran.err) == (
        2,
        "error: there is no profile 'teco-7200gt' (did you mean teco-7200gs?)\n",
    )


@pytest.mark.parametrize("which", ["profile", "site"])
def test_schemas(which: str) -> None:
    import json

    schema = json.loads(gateway("schema", which).out)
    assert schema["type"] == "object"


def test_a_simulated_line_needs_a_running_gateway(site: Path) -> None:
    ran = gateway("read", site, "fan-1.running")
    assert ran.code == 1
    assert "no gateway is running" in ran.err


def test_trace_without_a_gateway(site: Path) -> None:
    assert gateway("trace", site, "nrth").err == "error: there is no line 'nrth' (did you mean north?)\n"
    assert gateway("trace", site, "north").code == 1


KEPT = """# line north: rtu 9600 8N2 on /dev/ttyUSB0
2026-11-24T12:00:00.123456Z  north  >> 05 03 00 24 00 01 C5 85  read, time-out
"""


def test_a_kept_trace_goes_to_pcapng_and_back(site: Path) -> None:
    kept, packed = site.parent / "kept.txt", site.parent / "kept.pcapng"
    kept.write_text(KEPT)
    assert gateway("trace", site, "--from", kept, "--pcapng", packed).code == 0
    assert gateway("trace", site, "--from", packed).out == KEPT
    assert gateway("trace", site, "north", "--from", packed, "--json").objects == [
        {
            "time": "2026-11-24T12:00:00.123456Z",
            "line": "north",
            "sent": True,
            "data": "05 03 00 24 00 01 C5 85",
            "note": "read, time-out",
        }
    ]


def test_a_file_that_is_no_trace(site: Path) -> None:
    ran = gateway("trace", site, "--from", site)
    assert (ran.code, ran.out) == (1, "")
    assert ran.err.startswith(f"error: {site} is no trace: line 2 is no frame")
    assert gateway("trace", site, "--from", site.parent / "none").err.endswith("No such file or directory\n")


def test_trace_options_that_do_not_go_together(site: Path) -> None:
    assert gateway("trace", site, "--json", "--pcapng", "x").code == 2
    assert gateway("trace", site, "--from", "x", "--follow").code == 2


def test_users_come_and_go(site: Path) -> None:
    site.write_text(site.read_text() + 'opcua: {endpoint: "opc.tcp://127.0.0.1:4840"}\n')
    assert gateway("users", "add", site, "anna", "--role", "operator", stdin="secret word\n").code == 0
    assert gateway("users", "list", site, "--json").objects == [{"name": "anna", "role": "operator"}]
    assert gateway("users", "remove", site, "anna").code == 0
    assert gateway("users", "remove", site, "anna").code == 1
    assert gateway("users", "list", site).out == ""


def test_an_empty_password_is_refused(site: Path) -> None:
    site.write_text(site.read_text() + 'opcua: {endpoint: "opc.tcp://127.0.0.1:4840"}\n')
    ran = gateway("users", "add", site, "anna", stdin="\n")
    assert ran.code == 1
    assert ran.err.startswith("error: a password")


def test_run_refuses_an_unknown_line(site: Path) -> None:
    ran = gateway("run", site, "--line", "south=/dev/null")
    assert (ran.code, ran.err) == (2, "error: there is no line 'south' (did you mean north?)\n")
