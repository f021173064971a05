"""``gateway schema``: JSON Schemas of the two kinds of mapping files, for editors."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

EXAMPLES = """
gateway schema site > site.schema.json
"""


class Which(StrEnum):
    """The two kinds of files."""

    PROFILE = "profile"
    SITE = "site"


def schema(which: Annotated[Which, typer.Argument(help="The kind of file.")]) -> None:
    """Print the JSON Schema of profiles or site files, for completion and checks in an editor."""
    import json

    from gateway.mapping import schema as schemas
    from gateway.terminal.output import say

    say(json.dumps(schemas.schema(which.value), indent=2))
