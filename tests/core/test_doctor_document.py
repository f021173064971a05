"""docs/doctor.md tells everything that the doctor tells."""

from pathlib import Path

import pytest

from gateway.core.ailments import SEVERITY
from gateway.core.doctors import TOLD_OTHERWISE
from gateway.line.doctor.finding import Illness
from gateway.mapping.own import DEALINGS, OF_A_LINE

TEXT = (Path(__file__).parents[2] / "docs" / "doctor.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("illness", Illness)
def test_every_diagnosis_is_explained(illness: Illness) -> None:
    star = "" if illness in TOLD_OTHERWISE else " *"
    assert f"| `{illness.value}`{star} | {SEVERITY[illness]} |" in TEXT


@pytest.mark.parametrize(
    "tag", [*(f"_north.{name}" for name in OF_A_LINE), *(f"fan-1.{n}" for n in DEALINGS)]
)
def test_every_figure_is_explained(tag: str) -> None:
    assert f"`{tag}`" in TEXT
