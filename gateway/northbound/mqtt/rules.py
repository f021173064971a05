"""What is published, how often, and which readings are worth telling.

A rule gives a tag its period, its deadband and its longest silence. A `Filter` applies the rule to the
readings of one tag as they come in.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gateway.bridge.api import DIAGNOSTIC, Catalogue, PointInfo
from gateway.tag import Quality, Sample, Value, ValueType, means, tag_of

NOT_BY_DEFAULT = ("parameter", DIAGNOSTIC)
"""The kinds of points that are published only where a rule names them (safety.md I2)."""

EARLY = 0.25
"""Share of its period by which a reading may come early and still count as due: reading times jitter."""


@dataclass(frozen=True, slots=True)
class Rule:
    """How one tag is published.

    ``rate`` is the least time between two readings that are told, in seconds. ``deadband``: numbers are
    told again only when they differ by more than this from the value told last, in the point's unit.
    ``max_silence``: the next reading after so many seconds is told even if nothing changed.
    """

    rate: float
    deadband: float = 0.0
    max_silence: float | None = None


def rules_for(publish: Sequence[Mapping[str, Any]] | None, catalogue: Catalogue) -> dict[str, Rule]:
    """The rule of each published tag. The first entry of ``publish`` that matches a tag counts; without
    ``publish``, everything but parameters and diagnostics at the rate of its class."""
    rules = {}
    for tag, point in _readable(catalogue):
        rule = _default(point, catalogue) if publish is None else _first_match(publish, tag)
        if rule is not None:
            rules[tag] = rule
    return rules


def _readable(catalogue: Catalogue) -> Iterator[tuple[str, PointInfo]]:
    for owner in catalogue.owners:
        for point in owner.points:
            if point.readable:
                yield tag_of(owner.name, point.name), point


def _default(point: PointInfo, catalogue: Catalogue) -> Rule | None:
    return None if point.kind in NOT_BY_DEFAULT else Rule(catalogue.rates[point.rate])


def _first_match(publish: Sequence[Mapping[str, Any]], tag: str) -> Rule | None:
    for entry in publish:
        if any(means(pattern, tag) for pattern in entry["points"]):
            return Rule(entry["rate"], entry.get("deadband") or 0.0, entry.get("max_silence"))
    return None


@dataclass(slots=True)
class Filter:
    """Decides for one tag which readings go to ``data`` and which change ``state``.

    All times are seconds of the monotonic clock.
    """

    rule: Rule
    analog: bool
    """The value is a number that means an amount, so that a deadband makes sense."""
    prompt: bool
    """A change is told at once instead of at its time: bits, enumerations, and what can be written."""
    _due: float = float("-inf")
    _told: tuple[Quality, Value] | None = None
    _told_at: float = 0.0

    @classmethod
    def of(cls, rule: Rule, point: PointInfo) -> Filter:
        """The filter of a point."""
        analog = point.type in (ValueType.NUMBER, ValueType.INTEGER) and not point.values
        return cls(rule, analog=analog, prompt=point.writable or not analog)

    def due(self, sample: Sample, now: float) -> bool:
        """True when this reading counts: the period is over, or something changed that cannot wait.

        Others may want the tag faster than this rule does; their readings come by here too.
        """
        on_time = now >= self._due - EARLY * self.rule.rate
        if not on_time and not self._urgent(sample):
            return False
        next_on_grid = self._due + self.rule.rate
        self._due = next_on_grid if on_time and next_on_grid > now else now + self.rule.rate
        return True

    def tell(self, sample: Sample, now: float) -> bool:
        """True when a due reading is to replace the state that was told last; remembers it as told."""
        if not (self._new_quality(sample) or self._moved(sample.value) or self._silent_too_long(now)):
            return False
        self._told, self._told_at = (sample.quality, sample.value), now
        return True

    def _urgent(self, sample: Sample) -> bool:
        return self._new_quality(sample) or (self.prompt and self._moved(sample.value))

    def _new_quality(self, sample: Sample) -> bool:
        return self._told is None or sample.quality is not self._told[0]

    def _moved(self, value: Value) -> bool:
        last = self._told[1] if self._told else None
        if self.analog and isinstance(value, int | float) and isinstance(last, int | float):
            return abs(value - last) > self.rule.deadband
        return value != last

    def _silent_too_long(self, now: float) -> bool:
        limit = self.rule.max_silence
        return limit is not None and now - self._told_at >= limit
