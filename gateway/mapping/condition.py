"""Conditions on a drive's state, and where facts come from: what every part of a profile may carry. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

OURS = "ours"
"""Stands for a document where there is none: what nobody states and the profile assumes."""


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a fact comes from: a document's id (or `OURS`) and place, whether that document is about a
    similar model only, and why the fact may be wrong (None: no doubt)."""

    document: str = ""
    place: str = ""
    similar: bool = False
    doubt: str | None = None


UNSTATED = Provenance()
"""The origin of what states none."""


@dataclass(frozen=True, slots=True)
class NameFact:
    """What is known of one named raw value: a sentence about it, and where it comes from."""

    name: str
    help: str = ""
    provenance: Provenance = UNSTATED


@dataclass(frozen=True, slots=True)
class Term:
    """One line of a condition: the point's value lies in one of the closed ranges.

    Values compare as numbers: bits as 0 and 1, enumerations by their raw number, others in their unit.
    """

    name: str
    ranges: tuple[tuple[Fraction, Fraction], ...]
    text: str
    """The line as the author wrote it, for messages: ``run_source: line``."""
    setting: bool = False
    """True when ``name`` is a setting of the drive instance, not a point."""


Condition = tuple[Term, ...]
"""All terms must hold. The empty condition always holds."""

Bound = Fraction | str
"""A limit: a number in the point's unit, or the name of the setting or point that holds it."""


@dataclass(frozen=True, slots=True)
class Constant:
    """A value that is always written: raw for enumerations, else in the point's unit."""

    value: Fraction
