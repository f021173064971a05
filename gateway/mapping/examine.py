"""From the text of a profile to all that is wrong in it, and to what is right in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

from gateway.mapping.check import check
from gateway.mapping.finding import Finding, Report, has_errors, in_order
from gateway.mapping.library import Library
from gateway.mapping.lineage import with_parents
from gateway.mapping.lost import Lost
from gateway.mapping.model import RawProfile
from gateway.mapping.profile import Command, Profile
from gateway.mapping.reader import read
from gateway.mapping.resolve import Resolved, resolve
from gateway.mapping.validation import validate


@dataclass(frozen=True, slots=True)
class Examined:
    """A profile that was read: what is right in it, what was left out, and what is wrong.

    Without errors the profile is whole. With errors nothing may be done with it but judge a site by it.
    """

    profile: Profile | None
    lost: Lost | None
    findings: list[Finding]


def read_profile(data: bytes, file: str, stem: str, library: Library) -> Examined:
    """The profile in the bytes of a file. ``file`` is its name in findings, ``stem`` the name that it must
    have, ``library`` has the profiles that it may be ``like``."""
    root, findings = read(data, file)
    if root is not None:
        root, descent = with_parents(root, library)
        findings += descent
    if root is None:
        return Examined(None, None, findings)
    report = Report(file, root)
    raw = validate(RawProfile, report)
    if raw is None:
        return Examined(None, report.lost, in_order([*findings, *report.findings]))
    resolved = resolve(raw, report)
    check(resolved, stem, report)
    found = in_order([*findings, *report.findings])
    profile = _what_is_right(resolved, report) if has_errors(found) else resolved.profile
    return Examined(profile, report.lost, found)


def _what_is_right(resolved: Resolved, report: Report) -> Profile:
    """The profile without points and commands that have errors, which count as left out."""
    profile = resolved.profile
    points = {
        name: point for name, point in profile.points.items() if not _has_errors(name, resolved, report)
    }
    commands = {
        name: command
        for name, command in profile.commands.items()
        if not report.wrong(("commands", name)) and _needed(command) <= points.keys()
    }
    for name in [*(profile.points.keys() - points.keys()), *(profile.commands.keys() - commands.keys())]:
        report.lost.declare(name)
    return replace(profile, points=MappingProxyType(points), commands=MappingProxyType(commands))


def _has_errors(name: str, resolved: Resolved, report: Report) -> bool:
    """True when something is wrong with what a point means."""
    keys = resolved.layout.keys[name]
    return name in resolved.layout.doubtful or report.doubtful(keys.path) or bool(keys.wrong(report))


def _needed(command: Command) -> set[str]:
    """The points that a command writes, lends its arguments from, or looks at."""
    terms = [*command.only_when, *(term for step in command.steps for term in (*step.when, *step.until))]
    written = {name for step in command.steps for name in step.write}
    return written | set(command.args.values()) | {term.name for term in terms if not term.setting}
