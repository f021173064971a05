"""``gateway acknowledge``: somebody has seen an alarm."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.tag import Outcome

EXAMPLES = """
gateway acknowledge site.yaml fan-1.restarted

gateway acknowledge site.yaml --all
"""


def acknowledge(
    site: SiteFile,
    alarms: Annotated[list[str] | None, typer.Argument(metavar="ALARM", help="As health shows it.")] = None,
    every: Annotated[bool, typer.Option("--all", help="All that stand.")] = False,
    as_json: AsJson = False,
) -> None:
    """Say that an alarm was seen. It is gone once its cause is gone too. Exit 1 if there is no such alarm."""
    from gateway.tag import Verdict
    from gateway.terminal.connect import run
    from gateway.terminal.errors import UsageError
    from gateway.terminal.output import outcome_line, outcome_object, say, say_json

    if every == bool(alarms):
        raise UsageError("name the alarms, or --all")
    outcomes = run(_acknowledge(site, alarms or ()))
    for alarm, outcome in outcomes:
        if as_json:
            say_json({"alarm": alarm, **outcome_object(outcome)})
        else:
            say(outcome_line(alarm, outcome))
    if any(outcome.verdict is not Verdict.CONFIRMED for _, outcome in outcomes):
        raise typer.Exit(1)


async def _acknowledge(path: Path, alarms: Sequence[str]) -> list[tuple[str, Outcome]]:
    """Acknowledge these alarms, or all that stand."""
    from gateway.terminal.connect import local_origin, running_bridge
    from gateway.terminal.sites import load

    async with running_bridge(load(path)) as bridge:
        wanted = alarms or [alarm.key for alarm in (await bridge.health()).alarms if not alarm.acknowledged]
        return [(alarm, await bridge.acknowledge(alarm, local_origin())) for alarm in wanted]
