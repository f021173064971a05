"""``gateway profiles``: the drive models that the gateway knows."""

from __future__ import annotations

from pathlib import Path
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
    """List the profiles, or show one with every point, command, source and doubt."""
    paths = [_find(name)] if name else sorted(_folder().glob("*.yaml"))
    for path in paths:
        profile = _load(path)
        if as_json:
            _tell(profile)
        elif name:
            _show(profile)
        else:
            _list(profile)


def _folder() -> Path:
    from gateway.mapping.load import builtin_mappings

    return builtin_mappings()


def _find(name: str) -> Path:
    from gateway.terminal.errors import UsageError
    from gateway.terminal.words import nearest

    path = Path(name) if name.endswith((".yaml", ".yml")) else _folder() / f"{name}.yaml"
    if not path.is_file():
        known = [file.stem for file in _folder().glob("*.yaml")]
        raise UsageError(f"there is no profile {name!r}{nearest(name, known)}")
    return path


def _load(path: Path) -> Profile:
    from gateway.mapping.load import load_profile
    from gateway.terminal.sites import WrongSiteError, listed

    profile, findings = load_profile(path)
    if profile is None:
        raise WrongSiteError(listed(findings))
    return profile


def _tell(profile: Profile) -> None:
    from gateway.terminal.output import say_json
    from gateway.terminal.profiles import profile_object

    say_json(profile_object(profile))


def _list(profile: Profile) -> None:
    from gateway.terminal.output import say

    doubts = sum(point.provenance.doubt is not None for point in profile.points.values())
    say(f"{profile.name:20} {profile.title}, points: {len(profile.points)}, in doubt: {doubts}")


def _show(profile: Profile) -> None:
    from rich.table import Table

    from gateway.terminal.output import console, say
    from gateway.terminal.profiles import point_row

    say(f"{profile.name}: {profile.title} ({profile.maker} {', '.join(profile.models)})")
    for key, document in profile.documents.items():
        say(f"  {key}: {document.title}")
    table = Table(box=None, header_style="dim", padding=(0, 2, 0, 0))
    for title in ("point", "register", "type", "unit", "access", "rate", "doubt"):
        table.add_column(title)
    for point in profile.points.values():
        table.add_row(*point_row(point))
    console().print(table)
    for command in profile.commands.values():
        args = " ".join(f"{arg}=({point})" for arg, point in command.args.items())
        say(f"command {command.name} {args}".rstrip())
