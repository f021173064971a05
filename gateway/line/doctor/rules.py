"""How one illness of a line is told from another. Pure.

Each rule looks at the chart and says nothing unless what it sees has no harmless explanation: a burst of
noise is over before it counts as a wrong speed, and a drive that was switched off is silent and nothing else.
An illness that explains what another rule saw comes first and is told alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from gateway.line.doctor.chart import NOBODY, Chart, Incident, Kind
from gateway.line.doctor.finding import Finding, Illness
from gateway.line.doctor.latency import latency_timer

RECENT = 15.0
"""Seconds that rules about what happens again and again look back: foreign masters may ask every few seconds,
and a drive that is held to be down is asked every five."""
STEADY = 4.5
"""Garbage alone for so many seconds is no burst of noise any more."""
LASTING = 2.0
"""Garbage of one unit for so many seconds is more than one accident."""
ENOUGH = 3
"""So many incidents are no accident."""
ASKED = 9.0
"""Seconds after which those who were asked stand for all: a line may have more drives than can be asked once
within ten seconds while none of them answers."""


@dataclass(frozen=True, slots=True)
class Patient:
    """What the rules look at. ``down`` are the units that are held to be down, ``echo`` is declared,
    ``longest`` is how long the reply of each unit takes at most by its profile (seconds)."""

    chart: Chart
    down: frozenset[int]
    echo: bool
    longest: Mapping[int, float]
    now: float

    def recent(self, *kinds: Kind, unit: int | None = None) -> list[Incident]:
        """What went wrong lately, with one unit or anywhere."""
        found = self.chart.incidents(self.now - RECENT, *kinds)
        return [one for one in found if unit is None or one.unit == unit]

    @property
    def heard_frames(self) -> bool:
        """True when valid frames of strangers came in lately: then the speed is right."""
        return bool(self.recent(Kind.REQUEST, Kind.REPLY, Kind.DOUBLED, Kind.CONTRADICTED, Kind.LATE))

    @property
    def late(self) -> frozenset[int]:
        """Units whose replies come when nobody waits for them any more: they are not silent."""
        return frozenset(unit for unit, known in self.chart.units.items() if known.lates)


Rule = Callable[[Patient], Iterator[Finding]]


def echo_missing(patient: Patient) -> Iterator[Finding]:
    """Replies come without the echo that the site declares."""
    bare = len(patient.recent(Kind.NO_ECHO))
    echoes = patient.chart.echoes.since(patient.now - RECENT, patient.now)
    if patient.echo and bare >= ENOUGH and bare > echoes:
        yield Finding(Illness.ECHO_MISSING, (), {"replies_without_echo": bare, "echoes": echoes})


def wrong_format(patient: Patient) -> Iterator[Finding]:
    """Garbage and nothing else, from nearly everybody who was asked, for longer than any burst of noise."""
    chart, since = patient.chart, max(patient.chart.answered_at, patient.now - 2 * RECENT)
    garbled = list(chart.incidents(since, Kind.GARBLED))
    silent = {one.unit for one in chart.incidents(since, Kind.SILENT)}
    units = {one.unit for one in garbled}
    alike = sum(one.like for one in garbled)
    if len(garbled) < ENOUGH or patient.heard_frames or 2 * alike >= len(garbled):
        return
    lasted = garbled[-1].at - garbled[0].at
    if lasted >= STEADY and len(silent - units) <= len(units) // 4:
        evidence = {"garbled": len(garbled), "drives": len(units), "seconds": round(lasted, 1), "valid": 0}
        yield Finding(Illness.WRONG_FORMAT, (), evidence)


def all_silent(patient: Patient) -> Iterator[Finding]:
    """Nobody answers, and nothing else comes in."""
    chart, now = patient.chart, patient.now
    mute = [known for known in chart.units.values() if known.misses]
    if patient.late:
        return
    heard = any(known.answered_at > -math.inf and not known.misses for known in chart.units.values())
    if not mute or heard or list(chart.incidents(now - RECENT, Kind.GARBLED)):
        return
    since = max(chart.answered_at, chart.opened_at)
    everybody = patient.down >= chart.units.keys()
    tried = len(mute) == len(chart.units) > 1 and now - since >= STEADY
    if everybody or tried or (now - since >= ASKED and len(mute) > 1):
        misses = sum(known.misses for known in mute)
        evidence = {"drives": len(mute), "unanswered": misses, "seconds": round(now - since, 1)}
        yield Finding(Illness.ALL_SILENT, (), {**evidence, "answered_before": int(since > chart.opened_at)})


def foreign_master(patient: Patient) -> Iterator[Finding]:
    """Valid requests that are not ours, or replies that nobody asked for."""
    requests = patient.recent(Kind.REQUEST)
    replies = patient.recent(Kind.REPLY)
    if len(requests) >= 2 or len(requests) + len(replies) >= ENOUGH:
        units = tuple(sorted({one.unit for one in (*requests, *replies)}))
        yield Finding(Illness.FOREIGN_MASTER, units, {"requests": len(requests), "replies": len(replies)})


def two_drives(patient: Patient) -> Iterator[Finding]:
    """Second replies to one request; or most replies of one unit damaged, while those of others are not."""
    for unit in patient.chart.units:
        evidence = _doubled(patient, unit) or _collided(patient, unit)
        if evidence:
            yield Finding(Illness.TWO_DRIVES, (unit,), evidence)


def _doubled(patient: Patient, unit: int) -> dict[str, float]:
    second = patient.recent(Kind.DOUBLED, Kind.CONTRADICTED, unit=unit)
    answers = patient.chart.answers(patient.now - RECENT, patient.now, [unit])
    if len(second) < ENOUGH or len(second) < 0.2 * answers:
        return {}
    contradicted = sum(one.kind is Kind.CONTRADICTED for one in second)
    return {"second_replies": len(second), "contradicting": contradicted, "replies": answers}


def _collided(patient: Patient, unit: int) -> dict[str, float]:
    """Most of its replies garbled while others answered well: what others said before or after tells nothing,
    since noise and a wrong speed end too."""
    chart, now = patient.chart, patient.now
    garbled = list(chart.incidents(now - 2 * RECENT, Kind.GARBLED))
    mine = [one for one in garbled if one.unit == unit]
    lasted = mine[-1].at - mine[0].at if mine else 0.0
    if len(mine) < ENOUGH or lasted < LASTING:
        return {}
    good = chart.answers(mine[0].at + 1.0, now, [unit])
    meanwhile = chart.answers(mine[0].at + 1.0, now) - chart.answers(mine[-1].at + 1.0, now)
    others = meanwhile - good + chart.answers(mine[-1].at + 1.0, now, [unit])
    theirs = len(garbled) - len(mine)
    shaped = sum(one.like or one.long for one in mine)
    alone = others >= 5 and theirs <= 0.05 * others and len(mine) > good
    single = len(chart.units) == 1 and lasted >= STEADY and shaped >= 0.75 * len(mine)
    if not alone and not (single and len(mine) >= 4 * good):
        return {}
    return {"garbled": len(mine), "replies": good, "garbled_of_others": theirs, "replies_of_others": others}


def late_answers(patient: Patient) -> Iterator[Finding]:
    """Replies that take longer than the profile says: too late, or waited for since that was learned."""
    chart, since = patient.chart, patient.now - 2 * RECENT
    for unit, longest in patient.longest.items():
        late = chart.units[unit].lates
        taken = [one.after - one.duration for one in chart.arrivals if one.unit == unit and one.at > since]
        slow, lost = ([each for each in some if each > longest] for some in (taken, late))
        if len(slow) + len(lost) >= ENOUGH:
            usual = median(slow or lost)
            evidence = {"replies": len(slow), "too_late": len(lost)}
            times = {"milliseconds": round(1000 * usual), "longest": round(1000 * longest)}
            yield Finding(Illness.LATE_ANSWERS, (unit,), {**evidence, **times})


def drive_silent(patient: Patient) -> Iterator[Finding]:
    """Some are held to be down because nothing comes back, others answer."""
    chart = patient.chart
    garbled = {one.unit for one in patient.recent(Kind.GARBLED)}
    silent = tuple(sorted(patient.down - garbled - patient.late))
    if silent and chart.answered_at > max(chart.units[unit].down_at for unit in silent):
        misses = sum(chart.units[unit].misses for unit in silent)
        answering = len(chart.units) - len(patient.down)
        yield Finding(Illness.DRIVE_SILENT, silent, {"unanswered": misses, "answering": answering})


def noise(patient: Patient) -> Iterator[Finding]:
    """Damaged replies of units that answered well afterwards, or of all; or bytes out of nowhere."""
    chart = patient.chart
    for_good = patient.now - max(chart.answered_at, chart.opened_at) > STEADY
    garbled = [
        one
        for one in patient.recent(Kind.GARBLED)
        if one.at < chart.units[one.unit].answered_at or (for_good and one.like)
    ]
    strays = patient.recent(Kind.STRAY)
    answers = chart.answers(patient.now - RECENT, patient.now)
    bad = sorted(one.at for one in (*garbled, *strays))
    if len(bad) < ENOUGH or bad[-1] - bad[0] < LASTING or len(bad) < 0.005 * answers:
        return
    units = tuple(sorted({one.unit for one in (*garbled, *strays)} - {NOBODY}))
    alone = len(units) == 1 and len(patient.chart.units) > 1 and not strays
    evidence = {"damaged": len(garbled), "strays": len(strays), "replies": answers, "drives": len(units)}
    yield Finding(Illness.NOISE, units if alone else (), evidence)


def echo_undeclared(patient: Patient) -> Iterator[Finding]:
    """Our own requests come back."""
    chart = patient.chart
    echoes = chart.echoes.since(patient.now - RECENT, patient.now)
    if (
        not patient.echo
        and echoes >= ENOUGH
        and 2 * echoes >= chart.answers(patient.now - RECENT, patient.now)
    ):
        yield Finding(Illness.ECHO_UNDECLARED, (), {"echoes": echoes})


def latency(patient: Patient) -> Iterator[Finding]:
    """Replies arrive on a grid of 16 ms."""
    evidence = latency_timer([one for one in patient.chart.arrivals if one.at > patient.now - 2 * RECENT])
    if evidence:
        yield Finding(Illness.LATENCY_TIMER, (), evidence)


EXPLAINING: Sequence[tuple[Rule, frozenset[Illness]]] = (
    (echo_missing, frozenset(Illness)),
    (foreign_master, frozenset({Illness.TWO_DRIVES, Illness.NOISE, Illness.ECHO_UNDECLARED})),
    (wrong_format, frozenset(Illness)),
    (all_silent, frozenset(Illness)),
    (two_drives, frozenset({Illness.NOISE})),
    (late_answers, frozenset()),
    (drive_silent, frozenset()),
    (noise, frozenset({Illness.LATENCY_TIMER})),
    (latency, frozenset()),
    (echo_undeclared, frozenset()),
)
"""The rules in order, and what each illness explains."""


def findings(patient: Patient) -> list[Finding]:
    """What is wrong."""
    found: list[Finding] = []
    explained: set[Illness] = set()
    for rule, explains in EXPLAINING:
        new = [one for one in rule(patient) if one.illness not in explained]
        found += new
        if new:
            explained |= explains
    return found
