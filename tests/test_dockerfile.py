"""The Dockerfile keeps its promises, as far as reading it can tell; CI runs its install steps as well."""

from __future__ import annotations

import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
KNOWN = {
    "FROM",
    "WORKDIR",
    "COPY",
    "RUN",
    "USER",
    "ENV",
    "EXPOSE",
    "STOPSIGNAL",
    "HEALTHCHECK",
    "ENTRYPOINT",
    "CMD",
}


def instructions() -> list[tuple[str, str]]:
    text = re.sub(r"\\\n", " ", (ROOT / "Dockerfile").read_text(encoding="utf-8"))
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return [(word, rest) for word, _, rest in (line.partition(" ") for line in lines)]


def last_stage() -> dict[str, str]:
    steps = instructions()
    start = max(index for index, (word, _) in enumerate(steps) if word == "FROM")
    return dict(steps[start:])


def test_only_known_instructions() -> None:
    assert {word for word, _ in instructions()} <= KNOWN


def test_stages_are_pinned_to_a_python() -> None:
    stages = [rest for word, rest in instructions() if word == "FROM"]
    assert len(stages) == 2
    assert all(stage.startswith("python:3.11-slim") for stage in stages)


def test_runs_without_rights() -> None:
    assert last_stage()["USER"] not in ("root", "0")


def test_stops_and_tells_its_health() -> None:
    stage = last_stage()
    assert stage["STOPSIGNAL"] == "SIGTERM"
    assert "gateway" in stage["HEALTHCHECK"]


def test_no_shell_stands_between_signals_and_the_gateway() -> None:
    stage = last_stage()
    assert [*json.loads(stage["ENTRYPOINT"]), *json.loads(stage["CMD"])] == [
        "gateway",
        "run",
        "/site/site.yaml",
    ]


def test_installs_only_what_the_hashes_allow() -> None:
    installs = [rest for word, rest in instructions() if word == "RUN" and "pip install" in rest]
    assert installs
    assert all("--require-hashes" in line or "--no-index" in line for line in installs)


def test_nothing_of_the_build_but_the_environment_is_kept() -> None:
    assert last_stage()["COPY"] == "--from=build /opt/gateway /opt/gateway"
