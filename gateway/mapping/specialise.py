"""A profile for one drive instance: what its settings alone decide is decided. Pure.

Afterwards only conditions on points remain, which the core looks at while it runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from types import MappingProxyType

from gateway.mapping.condition import Condition, Term
from gateway.mapping.device import CommLoss
from gateway.mapping.profile import Command, Point, Profile, Word

Settings = Mapping[str, Fraction]


def specialise(profile: Profile, settings: Settings) -> Profile:
    """The profile of a drive with these settings.

    Addresses are shifted. Terms on settings that hold are dropped. Cases and points that a setting rules
    out are left out, and so is everything that is said of them; a case that nothing else decides becomes
    the point's own meaning. Conditions of commands and preconditions keep their settings, so that a
    refusal can name them.
    """
    kept = [_point(point, settings) for point in profile.points.values()]
    points = {point.name: point for point in kept if point is not None}
    return replace(
        profile,
        points=MappingProxyType(points),
        words=MappingProxyType({word.address: word for word in _words(profile, points, settings)}),
        commands=MappingProxyType(
            {name: command for name, command in profile.commands.items() if _possible(command, points)}
        ),
        serial=replace(profile.serial, comm_loss=_comm_loss(profile.serial.comm_loss, settings)),
    )


def _point(point: Point, settings: Settings) -> Point | None:
    """The point as this drive has it; None when it has not."""
    when = _left(point.when, settings)
    if when is None:
        return None
    cases = []
    for case in point.cases:
        left = _left(case.when, settings)
        if left is not None:
            cases.append(replace(case, when=left))
        if left == ():
            break
    if point.cases and not cases:
        return None
    shifted = replace(point, when=when, address=_shifted(point.address, point.shift, settings), shift=None)
    if not cases:
        return shifted
    meant = replace(shifted, encoding=cases[0].encoding, limits=cases[0].limits)
    return replace(meant, cases=() if not cases[0].when else tuple(cases))


def _left(condition: Condition, settings: Settings) -> Condition | None:
    """What remains of a condition once its settings are known; None when it can never hold."""
    left: list[Term] = []
    for term in condition:
        if not term.setting:
            left.append(term)
        elif not any(low <= settings[term.name] <= high for low, high in term.ranges):
            return None
    return tuple(left)


def _words(profile: Profile, points: Mapping[str, Point], settings: Settings) -> list[Word]:
    return [
        replace(
            word,
            address=_shifted(word.address, word.shift, settings),
            shift=None,
            fields=tuple(name for name in word.fields if name in points),
        )
        for word in profile.words.values()
    ]


def _shifted(address: int, shift: str | None, settings: Settings) -> int:
    return address if shift is None else address + int(settings[shift])


def _possible(command: Command, points: Mapping[str, Point]) -> bool:
    """False for commands that write a point which this drive has not."""
    return all(name in points for step in command.steps for name in step.write)


def _comm_loss(loss: CommLoss, settings: Settings) -> CommLoss:
    """Without an action where the settings say that the drive does not look at the line."""
    left = _left(loss.when, settings)
    return CommLoss() if left is None else replace(loss, when=left)
