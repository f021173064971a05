"""The last sample of every tag, and what becomes of samples that grow old. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from gateway.tag import Quality, Sample

STALE_PERIODS = 2
"""Promised periods after which a value is uncertain (safety.md H17)."""

DEAD_PERIODS = 5
"""Promised periods after which a value is bad (safety.md H17)."""


@dataclass(slots=True)
class Held:
    """A sample, and when its value was read (monotonic seconds)."""

    sample: Sample
    at: float


class Store:
    """The latest sample per tag."""

    def __init__(self) -> None:
        self._held: dict[str, Held] = {}

    def put(self, sample: Sample, at: float) -> None:
        """Keep a sample whose value was read at ``at``."""
        self._held[sample.tag] = Held(sample, at)

    def knows_later(self, tag: str, at: float) -> bool:
        """True when a tag has a value that was read after ``at``."""
        held = self._held.get(tag)
        return held is not None and held.at > at and held.sample.quality in (Quality.GOOD, Quality.STALE)

    def get(self, tag: str) -> Held | None:
        """What is known of a tag."""
        return self._held.get(tag)

    def drop(self, tag: str) -> None:
        """Forget what is known of a tag."""
        self._held.pop(tag, None)

    def sample(self, tag: str, wall: int) -> Sample:
        """The sample of a tag; one that says so when nothing was read yet."""
        held = self._held.get(tag)
        return held.sample if held else Sample(tag, None, Quality.WAITING, wall, 0.0, None, "no value yet")

    def aged(self, tag: str, period: float, mono: float, wall: int) -> Sample | None:
        """The sample that a tag has to become because of its age, None when it stays as it is.

        ``period`` is the promised one in seconds. A stale sample keeps its value and its time; a dead
        one has none.
        """
        held = self._held.get(tag)
        if held is None or held.sample.quality not in (Quality.GOOD, Quality.STALE):
            return None
        age = mono - held.at
        if age > DEAD_PERIODS * period:
            reason = f"not read for {age:.1f} s, promised every {period:g} s"
            return self._become(held, Sample(tag, None, Quality.NO_COMMUNICATION, wall, period, None, reason))
        if age > STALE_PERIODS * period and held.sample.quality is Quality.GOOD:
            old = held.sample
            reason = f"{age:.1f} s old, promised every {period:g} s"
            stale = Sample(tag, old.value, Quality.STALE, old.time, period, old.text, reason)
            return self._become(held, stale)
        return None

    def _become(self, held: Held, sample: Sample) -> Sample:
        held.sample = sample
        return sample
