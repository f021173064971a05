"""The doctors of all lines: when they look, and who is told what they find. Pure.

Each line is looked at once a second, one line at a time, so that no step is long. What is found is a tag of
the line, stands in the report of health, and is an alarm where nothing else tells of it.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from functools import partial

from gateway.bridge.api import Diagnosis
from gateway.core.ailments import Place, diagnosis, subject
from gateway.core.alarms import Alarms
from gateway.core.lines import Lines
from gateway.core.own import OwnTags
from gateway.line.doctor.finding import Finding, Illness
from gateway.mapping.own import CONDITION, OF_A_LINE
from gateway.mapping.site import LineConfig
from gateway.tag import Instant, own_name, tag_of

EVERY = 1.0
"""Seconds between two looks at a line."""
OF_ONE_DRIVE = (Illness.TWO_DRIVES, Illness.LATE_ANSWERS)
"""These are found of each drive by itself."""
HEALTHY = "healthy"
"""The condition of a line without a finding."""
TOLD_OTHERWISE = frozenset[str](
    {Illness.PORT_DOWN, Illness.ALL_SILENT, Illness.DRIVE_SILENT, Illness.ECHO_UNDECLARED}
)
"""What events of drives and lines tell already, or what does no harm: no alarm is made of it."""


class Doctors:
    """One doctor for each line."""

    def __init__(self, configs: Sequence[LineConfig], lines: Lines, alarms: Alarms, own: OwnTags) -> None:
        self._configs = {config.name: config for config in configs}
        self._lines = lines
        self._alarms = alarms
        self._own = own
        self._found: dict[str, dict[str, Diagnosis]] = {name: {} for name in self._configs}
        self._words = dict.fromkeys(self._configs, "")
        """The diagnoses as they were when the last one came or went: their numbers grow with each look, and a
        text that changes every second is no news to anybody."""
        self._queue: list[tuple[float, str]] = []
        for name in self._configs:
            values = {
                "condition": partial(self._condition, name),
                "diagnosis": partial(self._text, name),
            }
            own.register(own_name(name), {point: OF_A_LINE[point] for point in CONDITION}, values)

    def start(self, now: float) -> None:
        """Begin: lines take turns within a second."""
        share = EVERY / max(1, len(self._configs))
        self._queue = [(now + EVERY + share * i, name) for i, name in enumerate(self._configs)]

    def wake(self) -> float | None:
        """When `tick` is next needed (monotonic)."""
        return self._queue[0][0] if self._queue else None

    def tick(self, now: Instant) -> None:
        """Look at the line whose turn it is."""
        if not self._queue or self._queue[0][0] > now.mono:
            return
        at, name = self._queue[0]
        heapq.heapreplace(self._queue, (max(at + EVERY, now.mono), name))
        line = self._lines.get(name)
        assert line is not None
        self._take(name, line.examine(now.mono), line.down_reason, now)

    def standing(self) -> tuple[Diagnosis, ...]:
        """Everything that is wrong now, line by line."""
        return tuple(one for found in self._found.values() for one in found.values())

    def _take(self, name: str, findings: Sequence[Finding], reason: str, now: Instant) -> None:
        before, place = self._found[name], Place(self._configs[name], reason)
        present: dict[str, Diagnosis] = {}
        for finding in findings:
            known = before.get(_key(finding))
            present[_key(finding)] = diagnosis(finding, place, known.since if known else now.wall)
        self._found[name] = present
        self._alarm(name, present, now)
        if _subjects(before) != _subjects(present):
            self._words[name] = "; ".join(f"{one.text} ({one.remedy})" for one in present.values())
            self._own.changed([tag_of(own_name(name), point) for point in CONDITION], now)

    def _alarm(self, name: str, present: Mapping[str, Diagnosis], now: Instant) -> None:
        """Raise what is there, clear what is gone: also what was there before a restart."""
        told = {key: one for key, one in present.items() if key not in TOLD_OTHERWISE}
        for key, one in told.items():
            self._alarms.raise_(subject(name), key, f"line {name}: {one.text} ({one.remedy})", now)
        for alarm in self._alarms.standing():
            if alarm.subject == subject(name) and _ours(alarm.name) and alarm.name not in told:
                self._alarms.clear(alarm.subject, alarm.name, now)

    def _condition(self, name: str, now: float) -> str:
        return ", ".join(dict.fromkeys(one.code for one in self._found[name].values())) or HEALTHY

    def _text(self, name: str, now: float) -> str:
        return self._words[name]


def _ours(name: str) -> bool:
    """True for the name of an alarm that is raised here."""
    return name in set(Illness) or name.startswith(tuple(f"{illness}_" for illness in OF_ONE_DRIVE))


def _key(finding: Finding) -> str:
    """What a finding is known by from one look to the next."""
    code = finding.illness.value
    return f"{code}_{finding.units[0]}" if finding.illness in OF_ONE_DRIVE else code


def _subjects(found: Mapping[str, Diagnosis]) -> list[tuple[str, tuple[str, ...]]]:
    return [(one.code, one.drives) for one in found.values()]
