"""Conditions of profiles, held against what a drive shows. Pure."""

from __future__ import annotations

from fractions import Fraction

from gateway.core.drive import Drive
from gateway.core.store import Store
from gateway.mapping.profile import Condition, Kind, Term
from gateway.tag import Quality, Sample, Value


def holds(term: Term, value: Value) -> bool:
    """True when the value lies in one of the term's ranges; a missing or text value never does."""
    if value is None or isinstance(value, str):
        return False
    number = Fraction(value) if isinstance(value, int) else Fraction(str(value))
    return any(low <= number <= high for low, high in term.ranges)


def shown(drive: Drive, store: Store, term: Term) -> Sample | None:
    """The good sample that a term leans on; None when there is none."""
    held = store.get(drive.tag(term.name))
    return held.sample if held is not None and held.sample.quality is Quality.GOOD else None


def contradicted(drive: Drive, store: Store, condition: Condition) -> str | None:
    """What a good sample or a setting says against the condition, in words; None when nothing does."""
    for term in condition:
        if term.setting:
            if not holds(term, float(drive.config.settings[term.name])):
                return f"needs {term.text}"
            continue
        sample = shown(drive, store, term)
        if sample is not None and not holds(term, sample.value):
            return words_against(drive, term, sample)
    return None


def proved(drive: Drive, store: Store, condition: Condition, since: float) -> bool:
    """True when every term holds in a sample whose value was read after ``since`` (monotonic)."""
    for term in condition:
        held = store.get(drive.tag(term.name))
        if held is None or held.at <= since or held.sample.quality is not Quality.GOOD:
            return False
        if not holds(term, held.sample.value):
            return False
    return True


def words_against(drive: Drive, term: Term, sample: Sample) -> str:
    """``needs run_source: line, but it is terminals (Sn-08: Whose run command counts)``."""
    point = drive.profile.points[term.name]
    about = f" ({point.notation}: {point.help})" if point.kind is Kind.PARAMETER and point.help else ""
    return f"needs {term.text}, but it is {shown_as(sample)}{about}"


def shown_as(sample: Sample) -> str:
    """A sample's value as people write it."""
    if sample.text is not None:
        return sample.text
    if isinstance(sample.value, bool):
        return str(sample.value).lower()
    return f"{sample.value:g}" if isinstance(sample.value, float) else str(sample.value)
