"""The command line: every command is a module of `gateway.commands`; here they are put together."""

from __future__ import annotations

from typing import Annotated

import typer

from gateway import __version__
from gateway.commands import (
    acknowledge,
    audit,
    check,
    command,
    demo,
    doctor,
    explain,
    health,
    lease,
    maintenance,
    plan,
    profiles,
    read,
    run,
    scan,
    schema,
    simulate,
    trace,
    users,
    watch,
    write,
)

app = typer.Typer(
    name="gateway",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Try it: gateway demo. Exit codes: 0 done, 1 refused, failed or found wrong, 2 wrong usage.",
)


def _tell_version(asked: bool) -> None:
    if asked:
        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def _gateway(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and end.", is_eager=True, callback=_tell_version),
    ] = False,
) -> None:
    """Variable-frequency drives on Modbus, shown to OPC UA and MQTT, and commanded from there.

    Not a safety device: emergency stop and safe torque off stay hard-wired.
    """


def _panel(title: str, *modules: object) -> None:
    """Register the modules' commands under a heading; a module's command has the module's name."""
    for module in modules:
        name = module.__name__.rpartition(".")[2]  # type: ignore[attr-defined]
        epilog = "Examples:\n\n" + module.EXAMPLES.strip()  # type: ignore[attr-defined]
        app.command(name, epilog=epilog, rich_help_panel=title)(getattr(module, name))


_panel("Run", demo, run, simulate)
_panel("Look and act", read, watch, write, command, lease, maintenance)
_panel("Look and act", trace, audit, health, doctor, acknowledge)
_panel("Prepare", check, scan, plan, profiles, explain, schema)
app.add_typer(users.app, name="users", rich_help_panel="Prepare")
