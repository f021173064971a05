"""The tables of docs/northbound.md say what the program does."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gateway.northbound.opcua.status import _DRIVE_ERROR, outcome_status, quality_status
from gateway.tag import Cause, Outcome, Quality, Verdict

TEXT = (Path(__file__).parents[2] / "docs" / "northbound.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `(\w+)` \| `(Good|Bad\w+|Uncertain\w+)` \|", re.MULTILINE)
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
    causes = set(Cause) - OF_MQTT - {Cause.NONE, Cause.DRIVE_REFUSED}
    assert table("cause") == {
        cause.value: outcome_status(Outcome(verdict=Verdict.REFUSED, cause=cause)).name for cause in causes
    }


@pytest.mark.parametrize("error", _DRIVE_ERROR)
def test_errors_of_drives(error: str) -> None:
    refused = Outcome(verdict=Verdict.REFUSED, cause=Cause.DRIVE_REFUSED, drive_error=error)
    assert table("error of the drive")[error] == outcome_status(refused).name
