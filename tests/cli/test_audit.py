"""`gateway audit`: reads, filters and verifies a journal, with and without a running gateway (R1)."""

from __future__ import annotations

import asyncio
import json
import shutil
from pathlib import Path

import jsonschema
import pytest

from gateway.bridge.place import running
from gateway.core.direct import open_core
from gateway.core.disk import Folder
from gateway.core.ledger import Ledger
from gateway.tag import Origin, Role
from gateway.terminal.auditing import time_of
from gateway.terminal.errors import UsageError
from tests.cli.program import gateway
from tests.core.plant import load, simulated, write_site

ANNA = Origin(through="opcua", who="anna", role=Role.ENGINEER, session="s1", address="10.0.0.7:4711")
BERT = Origin(through="mqtt", who="bert", role=Role.OPERATOR, authenticated=False)
TAG = "fan-1.frequency_command"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a site and its journal: two writes of anna, one of them refused, and one of bert."""
    folder = tmp_path_factory.mktemp("made")
    site = load(write_site(folder))

    async def write() -> None:
        async with open_core(site) as bridge:
            await bridge.write(TAG, 12.5, ANNA)
            await bridge.write(TAG, 99.0, ANNA)
            await bridge.write(TAG, 20.0, BERT, id="b1")

    with simulated(site):
        asyncio.run(write())
    return folder


@pytest.fixture
def site_file(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    shutil.copytree(made / "data", tmp_path / "data")
    return write_site(tmp_path)


def newest(site_file: Path) -> Path:
    return sorted((site_file.parent / "data").glob("journal-*.jsonl"))[-1]


def test_r1_it_tells_who_asked_for_what_and_what_became_of_it(site_file: Path) -> None:
    ran = gateway("audit", site_file)
    assert ran.code == 0, ran.err
    lines = [line.split("  ", 1)[1] for line in ran.out.splitlines()]
    assert lines[0].startswith("run 1 begins (version ")
    assert lines[1] == (
        f"#1 {TAG} = 12.5 by anna (opcua, 10.0.0.7:4711): "
        "about to send frequency_command ? -> 12.5 (unit 5 0002H: 04E2H)"
    )
    assert lines[2] == f"#1 {TAG} = 12.5 by anna (opcua, 10.0.0.7:4711): confirmed, the drive shows 12.5"
    assert lines[3].startswith(f"#2 {TAG} = 99 by anna (opcua, 10.0.0.7:4711): refused: ")
    assert lines[4].startswith(f"#3 {TAG} = 20 by bert (mqtt, not authenticated): about to send ")
    assert lines[-1] == "the gateway ends"


@pytest.mark.parametrize(
    ("filters", "kinds"),
    [
        (["--who", "bert"], ["intent", "outcome"]),
        (["--who", "an*", "--outcome", "refused"], ["outcome"]),
        (["--ask", "1"], ["intent", "outcome"]),
        (["--kind", "boot"], ["boot"]),
        (["--kind", "snapshot"], ["snapshot"]),
        (["--drive", "fan-1", "--last", "1"], ["outcome"]),
        (["--drive", "fan-2"], []),
        (["--since", "1h", "--kind", "end"], ["end"]),
        (["--until", "1h"], []),
        (["--since", "2099-01-01"], []),
    ],
)
def test_filters(site_file: Path, filters: list[str], kinds: list[str]) -> None:
    ran = gateway("audit", site_file, "--json", *filters)
    assert ran.code == 0, ran.err
    assert [entry["kind"] for entry in ran.objects] == kinds


ENTRY = {
    "type": "object",
    "required": ["hash", "n", "kind", "time", "place"],
    "properties": {
        "hash": {"pattern": "^[0-9a-f]{64}$"},
        "n": {"type": "integer"},
        "time": {"pattern": r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$"},
        "place": {"pattern": r"^journal-\d{12}\.jsonl:\d+$"},
    },
}


def test_the_shape_for_programs(site_file: Path) -> None:
    entries = gateway("audit", site_file, "--json").objects
    for entry in entries:
        jsonschema.validate(entry, ENTRY)
    intent = next(entry for entry in entries if entry["kind"] == "intent" and entry["ask"] == 3)
    assert intent["old"] == {"frequency_command": 12.5}
    assert intent["new"] == {"frequency_command": 20.0}
    assert (intent["line"], intent["place"]) == ("north", "journal-000000000001.jsonl:6")
    assert (intent["unit"], intent["address"], intent["words"]) == (5, "0002H", ["07D0H"])
    assert (intent["id"], intent["by"]["authenticated"]) == ("b1", False)
    outcome = next(entry for entry in entries if entry["kind"] == "outcome" and entry["ask"] == 3)
    assert outcome["outcome"]["verdict"] == "confirmed"
    assert outcome["outcome"]["sent"].endswith("Z")


def test_r1_a_whole_journal_is_verified(site_file: Path) -> None:
    ran = gateway("audit", site_file, "--verify")
    assert ran.code == 0
    assert ran.out.startswith("whole: ")
    [checked] = gateway("audit", site_file, "--verify", "--json").objects
    assert (checked["whole"], checked["breaks"], checked["unended"]) == (True, [], [])
    held = gateway("audit", site_file, "--verify", "--holds", checked["hash"])
    assert (held.code, "is there" in held.out) == (0, True)
    assert gateway("audit", site_file, "--verify", "--holds", "0" * 64).code == 1


def changed(line: str) -> str:
    return line.replace('"who":"anna"', '"who":"otto"')


@pytest.mark.parametrize(
    ("spoil", "line", "problem"),
    [
        (lambda lines: [*lines[:2], changed(lines[2]), *lines[3:]], 3, "was changed"),
        (lambda lines: [*lines[:3], *lines[4:]], 4, "entries 4 to 4 are missing before entry 5"),
        (lambda lines: [*lines[:3], lines[4], lines[3], *lines[5:]], 4, "missing before"),
        (lambda lines: [*lines[:3], "rubbish", *lines[3:]], 4, "no entry of a journal"),
        (lambda lines: lines[1:], 1, "does not begin with a snapshot"),
    ],
)
def test_r1_the_place_of_a_break_is_told(site_file: Path, spoil: object, line: int, problem: str) -> None:
    path = newest(site_file)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(spoil(lines)) + "\n")  # type: ignore[operator]
    ran = gateway("audit", site_file, "--verify")
    assert ran.code == 1
    assert ran.out.startswith(f"{path.name}:{line}: ")
    assert problem in ran.out.splitlines()[0]
    [checked] = gateway("audit", site_file, "--verify", "--json").objects
    assert (checked["whole"], checked["breaks"][0]["line"]) == (False, line)


def test_r1_a_file_that_was_taken_out_of_the_middle_is_found(site_file: Path) -> None:
    ledger = Ledger(Folder(site_file.parent / "data"), rotate=100)
    ledger.open()
    for number in range(4):
        ledger.write([{"kind": "test", "time": number, "mono": 0.0, "lived": 0.0}])
    assert gateway("audit", site_file, "--verify").code == 0
    files = sorted((site_file.parent / "data").glob("journal-*.jsonl"))
    files[2].unlink()
    ran = gateway("audit", site_file, "--verify")
    assert ran.code == 1
    assert ran.out.startswith(f"{files[3].name}:1: entries ")


def test_half_a_line_at_the_end_is_no_break_and_told(site_file: Path) -> None:
    with newest(site_file).open("a") as file:
        file.write('{"hash":"00')
    ran = gateway("audit", site_file, "--verify")
    assert (ran.code, "half a line at the end" in ran.out) == (0, True)


async def test_beside_a_running_core(site_file: Path) -> None:
    site = load(site_file)
    with simulated(site):
        async with open_core(site) as bridge:
            await bridge.write(TAG, 30.0, ANNA)
            assert running(site.data)
            entries = gateway("audit", site_file, "--json", "--who", "anna", "--last", "1").objects
            assert entries[0]["outcome"]["value"] == 30.0
            assert gateway("audit", site_file, "--verify").code == 0


def test_a_run_that_crashed_is_told(site_file: Path) -> None:
    path = newest(site_file)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:-1]))
    assert gateway("read", site_file, TAG).code in (0, 1)
    [checked] = gateway("audit", site_file, "--verify", "--json").objects
    assert (checked["whole"], checked["unended"]) == (True, [1])


def test_without_a_journal_it_says_so(tmp_path: Path) -> None:
    ran = gateway("audit", write_site(tmp_path))
    assert (ran.code, "there is no journal" in ran.err) == (1, True)


@pytest.mark.parametrize(
    ("text", "time"),
    [
        ("30s", 970),
        ("1.5m", 910),
        ("1970-01-01T00:10", 600),
        ("1970-01-01T01:10+01:00", 600),
        ("1970-01-01", 0),
    ],
)
def test_times(text: str, time: int) -> None:
    assert time_of(text, 1000 * 10**9) == time * 10**9


@pytest.mark.parametrize("text", ["yesterday", "5", "-1h", "1w", ""])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(UsageError):
        time_of(text, 0)


def test_json_is_what_stands_in_the_file(site_file: Path) -> None:
    stored = [json.loads(line) for line in newest(site_file).read_text().splitlines()]
    told = gateway("audit", site_file, "--json").objects
    assert [entry["hash"] for entry in told] == [entry["hash"] for entry in stored[1:]]
