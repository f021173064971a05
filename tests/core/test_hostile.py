"""Hostile commands (H1, H3, H22, T1, T2, E1): none is carried out wrongly, and a flaw would be found."""

from __future__ import annotations

from typing import Any

import pytest

import gateway.core.guard
import gateway.core.once
import gateway.northbound.mqtt.once
import gateway.northbound.mqtt.order
from tests.core.hostile import KINDS, attacked


def test_h1_h3_t2_e1_of_hostile_commands_none_is_executed_wrongly() -> None:
    wrong, kinds, answers = attacked(800, seed=1)
    assert wrong == []
    assert set(kinds) == set(KINDS)
    assert answers["confirmed"] > 100
    for cause in (
        "retained",
        "expired",
        "wrong_epoch",
        "malformed",
        "duplicate",
        "out_of_range",
        "no_rights",
    ):
        assert answers[cause] > 0, cause


@pytest.mark.parametrize(
    ("module", "name", "flaw"),
    [
        pytest.param(gateway.northbound.mqtt.order, "time_to_live", lambda *_: 5.0, id="freshness"),
        pytest.param(gateway.core.guard, "check_range", lambda *_: None, id="range"),
        pytest.param(gateway.northbound.mqtt.order.Order, "bridge_id", "", id="id"),
    ],
)
def test_a_flaw_planted_by_hand_is_found(
    module: Any, name: str, flaw: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, name, flaw)
    if name == "bridge_id":
        monkeypatch.setattr(gateway.northbound.mqtt.once.Once, "find", lambda *_: None)
        monkeypatch.setattr(gateway.northbound.mqtt.once.Once, "finish", lambda *_: [])
    assert attacked(300, seed=1)[0]
