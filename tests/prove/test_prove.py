"""Worlds in a box: 20,000 line-seconds of them, and faults planted by hand that they find."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from collections.abc import Iterator

import pytest

from tests.prove.box import Box
from tests.prove.plants import PLANTS, planted, search
from tests.prove.scene import scene_of
from tests.prove.shrink import shrunk, told

WORLDS = 30
PER_TEST = 2
LINE_SECONDS = 20_000
"""Of all worlds together, as `test_worlds_are_many` holds."""


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    logging.disable(logging.WARNING)
    yield
    logging.disable(logging.NOTSET)


@pytest.mark.parametrize("first", range(0, WORLDS, PER_TEST))
def test_every_invariant_holds_in_every_world(first: int) -> None:
    for seed in range(first, first + PER_TEST):
        report = Box(scene_of(seed)).run()
        wrong = "\n".join(map(str, report.wrong[:3]))
        assert not report.wrong, f"replay with: python -m tests.prove --seed {seed}\n{wrong}"


def test_worlds_are_many() -> None:
    scenes = map(scene_of, range(WORLDS))
    assert sum(scene.end * len(scene.lines) for scene in scenes) >= LINE_SECONDS


TRACE = (
    "import logging; logging.disable(); from tests.prove.box import Box; "
    "from tests.prove.scene import scene_of; print(Box(scene_of(4)).run().trace)"
)


def test_a_world_is_the_same_each_time_in_any_process() -> None:
    traces = {
        subprocess.run(
            [sys.executable, "-c", TRACE],
            env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(traces) == 1


QUICK = (
    "the read-back is dropped",
    "old values stay good",
    "the silence is cut short",
    "a stop waits its turn",
    "an outcome is told twice",
)


@pytest.mark.parametrize("name", QUICK)
def test_a_fault_planted_by_hand_is_found(name: str) -> None:
    """`python -m tests.prove --plants` searches for all of them."""
    assert search(PLANTS[name]) is not None


def test_a_world_that_fails_tells_how_to_play_it_again_and_the_shortest_that_fails_alike() -> None:
    with planted(PLANTS["an outcome is told twice"]):
        scene = scene_of(1)
        report = Box(scene).run()
        short = shrunk(scene, report, runs=40)
        again, text = Box(short).run(), "\n".join(told(scene, report, short))
    assert [v.invariant for v in again.wrong] == [v.invariant for v in report.wrong]
    assert len(short.happenings) < len(scene.happenings)
    assert "python -m tests.prove --seed 1" in text
    assert f"trace {report.trace}; played again: the same" in text
    assert f"trace {again.trace}" in text
