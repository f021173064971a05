"""``gateway scan``: who is on a port, how it is set, and which profiles fit."""

from __future__ import annotations

from typing import Annotated

import typer

from gateway.terminal.options import AsJson

EXAMPLES = """
gateway scan /dev/ttyUSB0

gateway scan /dev/ttyUSB0 --baud 9600 --format 8N2 --units 1..10

gateway scan tcp://192.168.0.7:4001 --framing rtu --json
"""


def scan(  # noqa: PLR0913 - as many as there are options
    port: Annotated[
        str, typer.Argument(metavar="PORT", help="A device, tcp://host:port or modbus://host:port.")
    ],
    baud: Annotated[
        list[int] | None, typer.Option(metavar="BAUD", help="Only this speed; may be repeated.")
    ] = None,
    formats: Annotated[
        list[str] | None, typer.Option("--format", metavar="8N2", help="Only this format; may be repeated.")
    ] = None,
    framing: Annotated[list[str] | None, typer.Option(metavar="rtu|ascii", help="Only this framing.")] = None,
    units: Annotated[
        list[str] | None, typer.Option(metavar="1..31", help="These unit addresses.", show_default="1..31")
    ] = None,
    profiles: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Think of these drive models only; name or file.")
    ] = None,
    timeout: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=0.01,
            help="How long a unit has to answer.",
            show_default="0.2; 0.5 by network",
        ),
    ] = None,
    all_settings: Annotated[
        bool, typer.Option("--all", help="Go on with other settings after somebody answered.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Find the units on a port, its speed and format, and the profiles that fit them.

    Sends reads and loop-backs, never a write, the likeliest settings first; keeps the silences. What it
    suggests is no proof: compare the nameplates. Exit 1 if nobody answers.
    """
    from gateway.terminal.scanner import Choices, plan_of, run_scan

    choices = Choices(baud or (), formats or (), framing or (), units or (), profiles or ())
    plan = plan_of(port, choices, timeout, all_settings)
    raise typer.Exit(run_scan(port, plan, as_json))
