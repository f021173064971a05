"""H4: whatever happens on the wire, nothing that is told of it is wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import pytest

from gateway.line.overhearing import Overhearing
from gateway.line.resync import Suspicion
from gateway.modbus.rtu import RtuSeeker
from tests.line.storm.storm import Scene, Storm, scene_of
from tests.line.storm.weather import Weather

SCENES = 50
PER_SCENE = 1000
PER_TEST = 5


@pytest.mark.parametrize("first", range(0, SCENES, PER_TEST))
def test_nothing_that_is_told_is_wrong(first: int) -> None:
    """Together 50,000 transactions; `python -m tests.line.storm` plays more."""
    good = 0
    for seed in range(first, first + PER_TEST):
        report = Storm(scene_of(seed)).run(PER_SCENE)
        assert report.wrong == [], f"replay with: python -m tests.line.storm --scene {seed}"
        good += report.good
    assert good > 0.4 * PER_TEST * PER_SCENE, "and much of it is good"


def test_an_echo_without_one_of_its_bytes_is_no_damaged_reply() -> None:
    """It is as long as one, and its request is answered late: a scene that was wrong once."""
    assert Storm(scene_of(20261127000038)).run(5000).wrong == []


def test_others_that_say_as_much_as_a_reply_is_long_are_no_damaged_reply() -> None:
    """A late reply and a stranger's request together: a scene that was wrong once."""
    assert Storm(scene_of(20261128000010)).run(1000).wrong == []


def test_a_storm_is_the_same_each_time() -> None:
    first, second = (Storm(scene_of(11)).run(500) for _ in range(2))
    assert (first.good, first.seconds, first.counts) == (second.good, second.seconds, second.counts)


@pytest.mark.parametrize("damage", [0.01, 0.05])
@pytest.mark.parametrize("loop_back", [False, True])
def test_damage_costs_little_more_than_what_it_destroys(damage: float, loop_back: bool) -> None:
    def rate(share: float) -> float:
        weather = Weather(damage=share)
        report = Storm(Scene(seed=7, weather=weather, length=5, blocks=6, loop_back=loop_back)).run(2000)
        return report.good / report.seconds

    assert rate(damage) >= (0.85 if damage < 0.02 else 0.6) * rate(0.0)


def blind(seeds: range, **weather: object) -> Counter[str]:
    """What is found wrong in scenes with this weather."""
    found: Counter[str] = Counter()
    for seed in seeds:
        scene = Scene(seed=seed, weather=Weather(**weather), wide=seed % 2 == 0, drives=2, writes=1.0)  # type: ignore[arg-type]
        report = Storm(scene).run(1500)
        found += Counter({name: n for name, n in report.counts.items() if name.startswith("WRONG")})
    return found


FLAWS: dict[str, tuple[type, str, object, dict[str, object], str]] = {
    "late answers are forgotten": (
        Suspicion,
        "missed",
        lambda *args, **more: None,
        {"kind": "queue", "late": 0.02, "late_most": 1.0},
        "WRONG misattributed",
    ),
    "a later answer is proof enough": (
        Suspicion,
        "_end",
        lambda self, each: 0.0 if each.at < self._proved else each.until,
        {"kind": "overlap", "late": 0.02, "late_most": 1.0},
        "WRONG misattributed",
    ),
    "what is in doubt is believed": (
        Suspicion,
        "weigh",
        lambda self, request, reply, at, now: now,
        {"kind": "queue", "late": 0.05, "late_most": 1.0, "refused": 0.05},
        "WRONG",
    ),
    "other masters are not heard": (
        Overhearing,
        "news",
        lambda self, data, now, least=0: iter(()),
        {"rivals": 2.0, "twins": 2.0},
        "WRONG misattributed",
    ),
    "an echo is a reply": (
        RtuSeeker,
        "_copies",
        1,
        {"echo": "declared", "lost_frame": 0.05},
        "WRONG write",
    ),
}


@pytest.mark.parametrize("flaw", FLAWS)
def test_the_storm_would_find_it(flaw: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A storm that finds nothing proves something only if it finds what is there."""
    owner, name, instead, weather, expected = FLAWS[flaw]
    assert blind(range(4), **weather) == Counter()
    if isinstance(instead, Callable):  # type: ignore[arg-type]
        monkeypatch.setattr(owner, name, instead)
    else:
        monkeypatch.setattr(
            owner, name, property(lambda self: instead, lambda self, value: None), raising=False
        )
    found = blind(range(4), **weather)
    assert any(name.startswith(expected) for name in found), found
