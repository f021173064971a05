"""What answers speak for: each profile with its reasons, the best one first. Pure.

A drive of another make may answer just so; what is found here are suggestions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from gateway.core.conditions import holds
from gateway.mapping.profile import Limits, Point, Profile
from gateway.modbus.encoding import Decoded, decode
from gateway.modbus.pdu import Reply
from gateway.scan.ask import Answer, Ask, is_plain
from gateway.scan.order import Setting
from gateway.scan.signature import Check, checks_of

STATION = "station_address"
"""A point that shows the unit address that is set on the drive."""
LIKELY = 0.6
"""Share of the checks that must fit for a profile to be suggested."""


@dataclass(frozen=True, slots=True)
class Reason:
    """One observation, and whether it fits the profile."""

    fits: bool
    text: str


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A profile with everything that speaks for and against it."""

    profile: Profile
    reasons: tuple[Reason, ...]

    @property
    def fits(self) -> int:
        """How many observations fit."""
        return sum(reason.fits for reason in self.reasons)

    @property
    def share(self) -> float:
        """The share of the observations that fit, 0..1."""
        return self.fits / len(self.reasons) if self.reasons else 0.0

    @property
    def likely(self) -> bool:
        """True when enough fits to name the profile."""
        return self.share >= LIKELY


def suggestions(
    profiles: Iterable[Profile], setting: Setting, unit: int, answers: Mapping[Ask, Answer]
) -> list[Suggestion]:
    """All profiles, those that fit best first."""
    judged = [Suggestion(profile, tuple(_reasons(profile, setting, unit, answers))) for profile in profiles]
    return sorted(judged, key=lambda suggestion: (-suggestion.share, -suggestion.fits))


def _reasons(
    profile: Profile, setting: Setting, unit: int, answers: Mapping[Ask, Answer]
) -> Iterator[Reason]:
    if setting.serial:
        can = setting.known_to(profile)
        yield Reason(can, f"can{'' if can else 'not'} be set to {setting}")
    for check in checks_of(profile):
        if check.ask in answers:
            yield _compared(profile, check, answers[check.ask].reply)
    yield from _values(profile, unit, answers)


def _compared(profile: Profile, check: Check, reply: Reply | None) -> Reason:
    if reply is None:
        return Reason(False, f"says nothing to {check.what}")
    if reply.exception is None:
        return Reason(check.answered, f"answers {check.what}")
    meaning = profile.errors.get(reply.exception)
    code = f"{reply.exception:02X}H"
    named = f"{code} {meaning.name}" if meaning else f"{code}, which its list has not"
    fits = not check.answered and (meaning is not None or not profile.errors)
    return Reason(fits, f"refuses {check.what} ({named})")


def _values(profile: Profile, unit: int, answers: Mapping[Ask, Answer]) -> Iterator[Reason]:
    """What is telling in the values that came: impossible ones, the unit's own number, the model's marks."""
    shown = {point.name: value for point, value in _shown(profile, answers)}
    for name, value in shown.items():
        if fault := _impossible(profile.points[name], value):
            yield Reason(False, fault)
    if STATION in shown:
        yield Reason(shown[STATION].value == unit, f"{STATION} shows {shown[STATION].value}")
    for term in profile.modbus.identity:
        if term.name in shown:
            yield Reason(holds(term, shown[term.name].value), f"{term.name} shows {shown[term.name].value}")


def _shown(profile: Profile, answers: Mapping[Ask, Answer]) -> Iterator[tuple[Point, Decoded]]:
    """The plain points that lie wholly in what was read."""
    registers: dict[int, int] = {}
    for ask, answer in answers.items():
        if answer.reply is not None:
            registers.update(enumerate(answer.reply.words, ask.address))
    for point in profile.points.values():
        words: Sequence[int | None] = [registers.get(point.address + n) for n in range(point.words)]
        known = [word for word in words if word is not None]
        if is_plain(point) and not point.cases and point.encoding.times is None and len(known) == point.words:
            yield point, decode(point.encoding, known)


def _impossible(point: Point, shown: Decoded) -> str:
    """Why a drive of this model would not show that; empty if it may."""
    value = shown.value
    if value is None or isinstance(value, (bool, str)):
        return ""
    if point.encoding.values or point.encoding.patterns:
        return "" if shown.text is not None else f"{point.name} shows {value}, which has no name"
    outside = point.limits is not None and not _within(Fraction(value), point.limits)
    return f"{point.name} shows {value:g}, outside its range" if outside else ""


def _within(value: Fraction, limits: Limits) -> bool:
    low, high = limits.low, limits.high
    return (isinstance(low, str) or value >= low) and (isinstance(high, str) or value <= high)
