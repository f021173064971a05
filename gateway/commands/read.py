"""``gateway read``: samples, once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.bridge.api import PointInfo
    from gateway.tag import Sample

EXAMPLES = """
gateway read site.yaml fan-1.output_frequency

gateway read site.yaml 'fan-1.output_*' --json
"""


def read(
    site: SiteFile,
    tags: Annotated[list[str], typer.Argument(metavar="TAG", help="Tags; * and ? match.")],
    max_age: Annotated[float, typer.Option(min=0, help="Seconds; a younger sample is not read anew.")] = 0.0,
    as_json: AsJson = False,
) -> None:
    """Read tags from their drives and print value, quality and time. Exit 1 if one has no value."""
    from gateway.tag import Severity
    from gateway.terminal.connect import run
    from gateway.terminal.output import is_named

    samples = run(_read(site, tags, max_age, as_json))
    if any(sample.quality.severity is Severity.BAD and not is_named(sample) for sample in samples):
        raise typer.Exit(1)


async def _read(path: Path, patterns: Sequence[str], max_age: float, as_json: bool) -> Sequence[Sample]:
    from gateway.terminal.connect import open_bridge
    from gateway.terminal.sites import load
    from gateway.terminal.words import points_by_tag, select

    async with open_bridge(load(path)) as bridge:
        tags = select(bridge.catalogue, patterns)
        samples = await bridge.read(tags, max_age)
    _show(samples, points_by_tag(bridge.catalogue), as_json)
    return samples


def _show(samples: Sequence[Sample], points: dict[str, PointInfo], as_json: bool) -> None:
    from gateway.terminal.output import sample_line, sample_object, say, say_json

    for sample in samples:
        point = points[sample.tag]
        if as_json:
            say_json(sample_object(sample, point))
        else:
            say(sample_line(sample, point))
