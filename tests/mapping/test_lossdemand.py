"""H9: what a drive does when the line dies, held against what the site demands."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from gateway.mapping.condition import Term
from gateway.mapping.device import CommLoss
from gateway.mapping.lossdemand import Shown, described, judge
from gateway.mapping.site import LossDemand

ACTIONS = {"ramp": 0, "coast": 1, "keep_running": 3}
STOPS = Term("action", ((Fraction(0), Fraction(1)),), "action: [ramp, coast]")
WATCHES = Term("watch", ((Fraction(1), Fraction(1)),), "watch: on", setting=True)
LOSS = CommLoss(2.0, "action", (WATCHES,), (STOPS,))


def told(loss: CommLoss, demand: LossDemand, **shown: float | str) -> tuple[bool | None, str]:
    def look(name: str) -> Shown | None:
        if name not in shown:
            return None
        value = shown[name]
        return Shown(Fraction(ACTIONS[value] if isinstance(value, str) else str(value)), str(value))

    return judge(loss, demand, look)


STOP, RUN, ANY = LossDemand("stop"), LossDemand("keep_running"), LossDemand("any")


@pytest.mark.parametrize(
    ("loss", "demand", "shown", "met"),
    [
        (LOSS, STOP, {"watch": 1, "action": "coast"}, True),
        (LOSS, STOP, {"watch": 1, "action": "keep_running"}, False),
        (LOSS, STOP, {"watch": 0, "action": "coast"}, False),
        (LOSS, STOP, {"watch": 1}, None),
        (LOSS, STOP, {"action": "keep_running"}, False),
        (LOSS, RUN, {"watch": 1, "action": "coast"}, False),
        (LOSS, RUN, {"watch": 1, "action": "keep_running"}, True),
        (LOSS, RUN, {"watch": 0}, True),
        (LOSS, RUN, {"watch": 1}, None),
        (LOSS, ANY, {}, True),
        (CommLoss(), STOP, {}, False),
        (CommLoss(), RUN, {}, False),
        (CommLoss(), ANY, {}, True),
        (CommLoss(2.0, "action"), STOP, {"action": "coast"}, False),
        (CommLoss(blind=True), STOP, {}, False),
        (CommLoss(blind=True), RUN, {}, True),
    ],
)
def test_what_is_not_known_is_never_taken_for_met(
    loss: CommLoss, demand: LossDemand, shown: dict[str, float | str], met: bool | None
) -> None:
    judgement = told(loss, demand, **shown)
    assert judgement[0] is met
    assert bool(judgement[1]) is (met is not True)


def test_the_reason_names_parameter_value_and_what_it_should_be() -> None:
    _, reason = told(LOSS, STOP, watch=1, action="keep_running")
    assert reason == "it must stop when the line dies: action is keep_running, and must be ramp or coast"
    _, reason = told(LOSS, RUN, watch=1, action="coast")
    assert reason == "it must keep running when the line dies, but action is coast"


@pytest.mark.parametrize(
    ("loss", "within", "shown", "met"),
    [
        (LOSS, 2.0, {}, True),
        (LOSS, 1.9, {}, False),
        (CommLoss(None, "action", (), (STOPS,)), 5.0, {}, False),
        (CommLoss(None, "action", (), (STOPS,), "after"), 5.0, {"after": 4.5}, True),
        (CommLoss(None, "action", (), (STOPS,), "after"), 5.0, {"after": 5.5}, False),
        (CommLoss(None, "action", (), (STOPS,), "after"), 5.0, {}, None),
    ],
)
def test_it_must_stop_in_time(
    loss: CommLoss, within: float, shown: dict[str, float | str], met: bool | None
) -> None:
    assert told(loss, LossDemand("stop", within), watch=1, action="coast", **shown)[0] is met


@pytest.mark.parametrize(
    ("loss", "settings", "words"),
    [
        (LOSS, {"watch": 1, "action": 1}, "stops after 2 s: action is 1"),
        (replace(LOSS, after=None, after_from="delay"), {"watch": 1, "action": 1}, "stops: action is 1"),
        (
            replace(LOSS, after=None, after_from="delay"),
            {"watch": 1, "action": 1, "delay": 3},
            "stops after 3 s: action is 1",
        ),
        (LOSS, {"watch": 0, "action": 1}, "keeps running: action is 1"),
        (LOSS, {"watch": 0}, "keeps running"),
        (LOSS, {"action": 1}, None),
        (CommLoss(), {}, "not known"),
        (CommLoss(blind=True), {}, "keeps running: its settings tell it not to watch the line"),
    ],
)
def test_what_happens_then_is_told_in_words(
    loss: CommLoss, settings: dict[str, int], words: str | None
) -> None:
    def look(name: str) -> Shown | None:
        return Shown(Fraction(settings[name]), str(settings[name])) if name in settings else None

    assert described(loss, look) == words
