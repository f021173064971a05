"""What the settings of a drive leave out of its profile, and which setting does. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from types import MappingProxyType

from gateway.mapping.profile import Command, Condition, Point, Profile

Settings = Mapping[str, Fraction]


def ruled_out(profile: Profile, special: Profile, settings: Settings) -> Mapping[str, str]:
    """Points and commands of the profile that the drive has not, with the reason: ``needs mode: fast``."""
    points = {
        point.name: _reason_of_point(point, settings)
        for point in profile.points.values()
        if point.name not in special.points
    }
    commands = {
        command.name: _reason_of_command(command, points)
        for command in profile.commands.values()
        if command.name not in special.commands
    }
    return MappingProxyType(points | commands)


def _reason_of_point(point: Point, settings: Settings) -> str:
    conditions = [point.when, *(case.when for case in point.cases)]
    return next((text for condition in conditions for text in _against(condition, settings)), "")


def _reason_of_command(command: Command, points: Mapping[str, str]) -> str:
    """The reason of the first point that the command needs and the drive has not."""
    terms = [*command.only_when, *(term for step in command.steps for term in (*step.when, *step.until))]
    needed = [*(name for step in command.steps for name in step.write), *command.args.values()]
    return next((points[name] for name in [*needed, *(term.name for term in terms)] if name in points), "")


def _against(condition: Condition, settings: Settings) -> Iterator[str]:
    """The terms on settings that do not hold."""
    for term in condition:
        if term.setting and not any(low <= settings[term.name] <= high for low, high in term.ranges):
            yield f"needs {term.text}"
