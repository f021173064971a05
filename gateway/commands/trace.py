"""``gateway trace``: what was on the wire of a line, as text, as JSON or for Wireshark."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.capture.source import Source
    from gateway.mapping.site import Site
    from gateway.terminal.tracing import Tell

EXAMPLES = """
gateway trace site.yaml north --last 10

gateway trace site.yaml north --follow

gateway trace site.yaml --pcapng trace.pcapng

gateway trace site.yaml north --follow --pcapng - | wireshark -k -i -

gateway trace site.yaml --from kept.txt --pcapng kept.pcapng
"""


def trace(
    site: SiteFile,
    lines: Annotated[
        list[str] | None, typer.Argument(metavar="[LINE]...", help="The lines' names; default: all.")
    ] = None,
    pcapng: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Write pcapng for Wireshark; - is standard output."),
    ] = None,
    last: Annotated[
        float | None, typer.Option(metavar="SECONDS", min=0, help="Only so far back.", show_default=False)
    ] = None,
    follow: Annotated[bool, typer.Option("--follow", "-f", help="Go on with what comes.")] = False,
    kept: Annotated[
        Path | None, typer.Option("--from", metavar="FILE", help="Read a kept trace, text or pcapng.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show the last frames on the lines of the running gateway: >> sent, << received, and what they were.

    Times are those of a frame's first bit on the wire. Each line keeps its last 32768 frames.
    """
    from gateway.terminal.errors import UsageError
    from gateway.terminal.sites import chosen_lines, load

    loaded = load(site)
    names = chosen_lines(loaded, lines or ())
    if as_json and pcapng is not None:
        raise UsageError("--json and --pcapng exclude each other")
    if kept is None:
        _tell_live(loaded, names, last, follow, pcapng, as_json)
    elif follow or last is not None:
        raise UsageError("a kept trace has neither --follow nor --last")
    else:
        _tell_kept(kept, names, pcapng, as_json)


def _tell_live(
    site: Site, names: list[str], last: float | None, follow: bool, pcapng: str | None, as_json: bool
) -> None:
    from gateway.capture.source import source_of
    from gateway.terminal.connect import run, running_bridge
    from gateway.terminal.tracing import live_frames

    sources = [source_of(line) for line in site.lines if line.name in names]

    async def work() -> None:
        async with running_bridge(site) as bridge:
            with ExitStack() as stack:
                tell = _teller(stack, sources, pcapng, as_json)
                async for batch in live_frames(bridge, sources, last, follow):
                    for captured in batch:
                        tell(captured)

    run(work())


def _tell_kept(path: Path, names: list[str], pcapng: str | None, as_json: bool) -> None:
    from gateway.terminal.tracing import kept_frames

    frames = kept_frames(path, names)
    with ExitStack() as stack:
        tell = _teller(stack, list({f.source.name: f.source for f in frames}.values()), pcapng, as_json)
        for captured in frames:
            tell(captured)


def _teller(stack: ExitStack, sources: list[Source], pcapng: str | None, as_json: bool) -> Tell:
    from gateway.terminal.tracing import json_teller, pcapng_teller, text_teller

    if pcapng is not None:
        return pcapng_teller(stack, pcapng, sources)
    return json_teller() if as_json else text_teller(sources)
