"""The tables of docs/northbound.md say what the program does."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from gateway.northbound.opcua.status import _DRIVE_ERROR, outcome_status, quality_status
from gateway.tag import Cause, Outcome, Quality, Verdict

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "northbound.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `(\w+)` \| `(Good|Bad\w+|Uncertain\w+)` \|", re.MULTILINE)
OF_OTHER_VERDICTS = {
    Cause.NO_ANSWER,
    Cause.LINE_DOWN,
    Cause.NOT_PROVED,
    Cause.SUPERSEDED,
    Cause.INTERNAL,
}
"""Causes of outcomes that are failed, unknown or superseded, never refused."""
OF_MQTT = {Cause.RETAINED, Cause.EXPIRED, Cause.WRONG_EPOCH, Cause.MALFORMED, Cause.DUPLICATE}


def table(head: str) -> dict[str, str]:
    """The rows of the table that has this as the head of its first column."""
    rows = TEXT.split(f"\n| {head} | StatusCode |", 1)[1].split("\n\n", 1)[0]
    return dict(ROW.findall(rows))


def test_qualities() -> None:
    assert table("quality") == {quality.value: quality_status(quality).name for quality in Quality}


def test_verdicts() -> None:
    final = [verdict for verdict in Verdict if verdict.final and verdict is not Verdict.REFUSED]
    assert table("outcome") == {
        verdict.value: outcome_status(Outcome(verdict=verdict)).name for verdict in final
    }


def test_causes() -> None:
    causes = set(Cause) - OF_MQTT - OF_OTHER_VERDICTS - {Cause.NONE, Cause.DRIVE_REFUSED}
    assert table("cause") == {
        cause.value: outcome_status(Outcome(verdict=Verdict.REFUSED, cause=cause)).name for cause in causes
    }


def refusals() -> set[Cause]:
    """The causes that the program gives to a refusal, wherever it writes one down."""
    found = set()
    for path in (ROOT / "gateway").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                text = ast.unparse(node)
                causes = {Cause[name] for name in re.findall(r"Cause\.([A-Z_]+)", text)}
                refuses = "Verdict.REFUSED" in text or re.match(r"refused?\(", text)
                found |= causes if refuses and len(causes) == 1 else set()
    return found


def test_no_refusal_has_another_cause() -> None:
    assert refusals() & OF_OTHER_VERDICTS == set()
    assert {Cause.OUT_OF_RANGE, Cause.PRECONDITION, Cause.NO_RIGHTS} < refusals()


@pytest.mark.parametrize("error", _DRIVE_ERROR)
def test_errors_of_drives(error: str) -> None:
    refused = Outcome(verdict=Verdict.REFUSED, cause=Cause.DRIVE_REFUSED, drive_error=error)
    assert table("error of the drive")[error] == outcome_status(refused).name
