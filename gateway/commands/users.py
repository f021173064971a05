"""``gateway users``: who may log in over OPC UA."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from gateway.tag import Role
from gateway.terminal.options import AsJson, SiteFile

app = typer.Typer(
    no_args_is_help=True,
    help="List, add and remove the users of a site.",
    epilog="Example: gateway users add site.yaml anna --role operator",
)

UserName = Annotated[str, typer.Argument(metavar="NAME", help="The user's name.")]


@app.command("list")
def list_users(site: SiteFile, as_json: AsJson = False) -> None:
    """List the users and their roles."""
    from gateway.terminal.output import say, say_json
    from gateway.users import roles

    for name, role in roles(_file(site)).items():
        if as_json:
            say_json({"name": name, "role": role})
        else:
            say(f"{name:20} {role}")


@app.command("add")
def add(
    site: SiteFile,
    name: UserName,
    role: Annotated[Role, typer.Option(help="What he may do.")] = Role.VIEWER,
) -> None:
    """Add a user, or give one a new role and password. The password is asked for, or read from a pipe."""
    from gateway.terminal.errors import CommandError
    from gateway.users import UsersError, add_user

    try:
        add_user(_file(site), name, role, _password())
    except UsersError as error:
        raise CommandError(str(error)) from error


@app.command("remove")
def remove(site: SiteFile, name: UserName) -> None:
    """Remove a user. Exit 1 if there is none of that name."""
    from gateway.terminal.errors import CommandError
    from gateway.users import remove_user

    path = _file(site)
    if not remove_user(path, name):
        raise CommandError(f"there is no user {name!r} in {path}")


def _password() -> str:
    """Never an argument: those can be seen by everybody on the machine."""
    if sys.stdin.isatty():
        return str(typer.prompt("Password", hide_input=True, confirmation_prompt=True))
    return sys.stdin.readline().rstrip("\r\n")


def _file(site: Path) -> Path:
    from gateway.terminal.errors import CommandError
    from gateway.terminal.sites import load

    path = (load(site).opcua or {}).get("users_file")
    if not path:
        raise CommandError(f"{site} names no users file (add opcua: users_file: users.json)")
    return Path(path)
