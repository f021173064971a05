"""R1, R2, H3: as many frames on the wire as intents on record, whatever fails, and a flaw would be found."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest

import gateway.core.sending
from gateway.core.once import Once
from gateway.core.procedure import Intend
from gateway.core.runner import Runner
from tests.core.counted import counted


def test_r1_r2_h3_frames_and_intents_are_equal() -> None:
    wrong, account = counted(400, seed=1)
    assert wrong == []
    assert account["kills"] > 0
    assert account["entries that the disk refused"] > 0
    assert account["confirmed"] > 100
    without = account["intents without a frame, at kills"]
    stops = account["frames of stops without an intent, at kills"]
    assert account["intents on record"] - without == account["frames on the wire"] - stops


def sent_before_it_is_on_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = gateway.core.sending.put

    def hasty(*given: Any) -> Generator[Any, Any, Any]:
        steps = plain(*given)
        effect = next(steps)
        while True:
            if isinstance(effect, Intend):
                effect = Intend(effect.facts, None, effect.keep)
            try:
                effect = steps.send((yield effect))
            except StopIteration as stop:
                return stop.value

    monkeypatch.setattr(gateway.core.sending, "put", hasty)


def repeated_after_a_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Once, "restore", lambda *_: None)


def silent_about_what_did_not_go(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Runner, "_unsent", lambda *_: None)


@pytest.mark.parametrize(
    "flaw", [sent_before_it_is_on_the_disk, repeated_after_a_restart, silent_about_what_did_not_go]
)
def test_a_flaw_planted_by_hand_is_found(flaw: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    flaw(monkeypatch)
    assert any(counted(400, seed=seed)[0] for seed in (1, 3)), "the second one finds what needs a full line"
