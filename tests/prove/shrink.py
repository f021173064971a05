"""From a world that fails to the shortest one that still does."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from tests.prove.box import Box, Report
from tests.prove.scene import Happening, Scene, in_words

RUNS = 150
"""Worlds that are played at most to find a shorter one."""

Fails = Callable[[Scene], bool]


LATER = 5.0
"""Seconds after the first failure up to which a shorter world may fail; no more of the others is played."""


def fails_alike(report: Report) -> Fails:
    """Whether a scene fails as this one did: at the same invariant, and not much later."""
    names = {violation.invariant for violation in report.wrong}
    until = report.wrong[0].at + LATER

    def fails(scene: Scene) -> bool:
        return any(violation.invariant in names for violation in Box(scene).run(until).wrong)

    return fails


def shrunk(scene: Scene, report: Report, runs: int = RUNS) -> Scene:
    """The shortest scene found that fails like this one; the same each time."""
    budget = iter(range(runs))
    fails = fails_alike(report)

    def still(candidate: Scene) -> bool:
        return next(budget, None) is not None and fails(candidate)

    at = report.wrong[0].at
    if at < scene.seconds:
        shorter = _until(scene, at + 0.001)
        scene = shorter if still(shorter) else scene
    for kind in scene.kinds:
        without = scene.without([kind])
        scene = without if still(without) else scene
    return _fewer(scene, still)


def told(scene: Scene, report: Report, short: Scene, much: str = "") -> Iterator[str]:
    """A failure for people: how to play it again, what fails, and the shortest world that fails alike."""
    again, more = Box(scene).run(), f" --much {much}" if much else ""
    same = "the same" if again.trace == report.trace else f"ANOTHER ONE: {again.trace}"
    yield f"seed {scene.seed} fails; play it again with: python -m tests.prove --seed {scene.seed}{more}"
    yield f"trace {report.trace}; played again: {same}"
    yield from map(str, report.wrong[:3])
    end = Box(short).run()
    yield ""
    yield f"shrunk to {end.seconds:.3f} s and {len(short.happenings)} happenings, trace {end.trace}:"
    yield from in_words(short)
    yield from map(str, end.wrong[:3])


def _until(scene: Scene, end: float) -> Scene:
    kept = tuple(each for each in scene.happenings if each.at <= end)
    return replace(scene, seconds=end, happenings=kept)


def _fewer(scene: Scene, still: Fails) -> Scene:
    """Leave happenings out, in ever smaller lots, as long as it goes on failing."""
    size = max(1, len(scene.happenings) // 2)
    while size:
        for part in list(_parts(scene.happenings, size)):
            gone = set(part)
            fewer = replace(scene, happenings=tuple(h for h in scene.happenings if h not in gone))
            if len(fewer.happenings) < len(scene.happenings) and still(fewer):
                scene = fewer
        size //= 2
    return scene


def _parts(happenings: Sequence[Happening], size: int) -> Iterator[Sequence[Happening]]:
    return (happenings[at : at + size] for at in range(0, len(happenings), size))
