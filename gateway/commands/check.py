"""``gateway check``: what is wrong in a site file, and with ``--live`` in what its drives show."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.bridge.api import Bridge, DriveInfo
    from gateway.mapping.site import DriveConfig, Site
    from gateway.tag import Sample
    from gateway.terminal.live import Found

EXAMPLES = """
gateway check site.yaml

gateway check site.yaml --live
"""


def check(
    site: SiteFile,
    live: Annotated[
        bool, typer.Option("--live", help="Also read every drive once and compare; writes nothing.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Check a site file and the profiles it uses; print every finding. Exit 1 if one is an error.

    With --live every readable point is read once from every drive, by the running gateway or else by this
    command. Exit 1 if a drive does not answer or contradicts its profile.
    """
    loaded = _check_files(site, as_json)
    if live:
        from gateway.terminal.connect import run

        if not run(_check_drives(loaded, as_json)):
            raise typer.Exit(1)


def _check_files(path: Path, as_json: bool) -> Site:
    """Tell what is wrong in the files; the site if nothing is."""
    from gateway.mapping.finding import has_errors, in_order
    from gateway.mapping.load import load_site
    from gateway.terminal.judged import judged
    from gateway.terminal.output import say, say_json

    loaded, findings = load_site(path)
    if loaded is not None:
        findings = in_order([*findings, *judged(loaded)])
    for finding in findings:
        if as_json:
            say_json(finding)
        else:
            say(str(finding))
    if loaded is None or has_errors(findings):
        raise typer.Exit(1)
    if not as_json:
        drives = len(loaded.drives)
        say(f"{path}: site {loaded.site}, lines: {len(loaded.lines)}, drives: {drives}, no errors")
    return loaded


async def _check_drives(site: Site, as_json: bool) -> bool:
    """Tell what every drive shows, one after the other; True if none contradicts its profile."""
    from gateway.terminal.live import found_lines, found_object
    from gateway.terminal.output import say, say_json

    fits = True
    async for seen in _found(site):
        fits = fits and not seen.contradictions
        if as_json:
            say_json(found_object(seen))
        else:
            say("\n".join(found_lines(seen)))
    return fits


async def _found(site: Site) -> AsyncIterator[Found]:
    from gateway.terminal.connect import open_bridge
    from gateway.terminal.live import found

    configs = {drive.name: drive for drive in site.drives}
    async with open_bridge(site) as bridge:
        for info in bridge.catalogue.drives:
            config = configs[info.name]
            yield found(config, info, await _read(bridge, info, config))


async def _read(bridge: Bridge, info: DriveInfo, config: DriveConfig) -> list[Sample]:
    """Everything readable of a drive. What depends on other points is read again once those are known."""
    from gateway.tag import Quality, tag_of
    from gateway.terminal.live import behind_selector

    skipped = set(behind_selector(config.profile))
    mapped = config.profile.points.keys() - skipped
    names = [point.name for point in info.points if point.readable and point.name in mapped]
    samples = {s.tag: s for s in await bridge.read([tag_of(info.name, name) for name in names])}
    waiting = [tag for tag, sample in samples.items() if sample.quality is Quality.WAITING]
    again = await bridge.read(waiting) if waiting else ()
    return list({**samples, **{sample.tag: sample for sample in again}}.values())
