"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

SiteFile = Annotated[Path, typer.Argument(metavar="SITE", help="The site file.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="One JSON object a line, for programs.")]
Ports = Annotated[
    list[str] | None,
    typer.Option("--line", metavar="NAME=PORT", help="Another port for a line than the site file says."),
]
Confirm = Annotated[
    str,
    typer.Option("--confirm", metavar="WORDS", help="The harm that it does, in the words of its refusal."),
]
Hold = Annotated[bool, typer.Option("--hold", help="Stay afterwards and renew the lease until Ctrl-C.")]
TimeToLive = Annotated[
    float, typer.Option("--ttl", metavar="SECONDS", min=0.1, help="How long it may wait to be sent.")
]
