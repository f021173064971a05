"""``gateway profiles``: the drive models that the gateway knows."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson

if TYPE_CHECKING:
    from gateway.mapping.profile import Profile

EXAMPLES = """
gateway profiles

gateway profiles teco-7200gs

gateway profiles ./my-drive.yaml --json
"""


def profiles(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="A profile's name, or the path of its file.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the profiles, or show one with everything that is known of the drive, its sources and doubts.

    Exit 1 if a profile has errors.
    """
    from gateway.terminal.models import profile_named

    if name:
        _show(profile_named(name), as_json)
    else:
        _list_all(as_json)


def _list_all(as_json: bool) -> None:
    """Tell the profiles that are in order; what is wrong in the others goes to standard error."""
    from gateway.mapping.load import builtin_mappings, load_profile
    from gateway.terminal.sites import listed

    wrong = False
    for path in sorted(builtin_mappings().glob("*.yaml")):
        profile, findings = load_profile(path)
        if profile is not None:
            _tell(profile) if as_json else _list(profile)
        else:
            sys.stderr.write(listed(findings) + "\n")
            wrong = True
    if wrong:
        raise typer.Exit(1)


def _tell(profile: Profile) -> None:
    from gateway.terminal.output import say_json
    from gateway.terminal.profiles import profile_object

    say_json(profile_object(profile))


def _list(profile: Profile) -> None:
    from gateway.terminal.output import say
    from gateway.terminal.profiles import doubtful

    doubts = doubtful(profile.points.values())
    say(f"{profile.name:20} {profile.title}, points: {len(profile.points)}, in doubt: {doubts}")


def _show(profile: Profile, as_json: bool) -> None:
    if as_json:
        _tell(profile)
        return
    from gateway.terminal.output import console, say
    from gateway.terminal.sheet import command_lines, head, points_table

    say("\n".join(head(profile)))
    for group, help in profile.groups.items():
        say(f"\n{group}: {help}".rstrip(": "))
        console().print(points_table(p for p in profile.points.values() if p.group == group))
    say("")
    say("\n".join(command_lines(profile.commands, profile.points)))
    if profile.broadcast is not None:
        say("\nto all drives of a line (unit 0):")
        console().print(points_table(profile.broadcast.points.values()))
        say("\n".join(command_lines(profile.broadcast.commands, profile.broadcast.points)))
