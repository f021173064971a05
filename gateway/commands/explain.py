"""``gateway explain``: where a tag comes from, how it is read, who gets it and under which names."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.bridge.api import Catalogue, CommandInfo, Demand, DriveInfo, PointInfo
    from gateway.mapping.site import Site
    from gateway.terminal.explained import Explained

EXAMPLES = """
gateway explain site.yaml fan-1.output_frequency

gateway explain site.yaml fan-1.run_forward --json
"""


def explain(
    site: SiteFile,
    tag: Annotated[str, typer.Argument(metavar="TAG", help="A point or command: fan-1.output_frequency.")],
    as_json: AsJson = False,
) -> None:
    """Explain a tag: document, section, register, doubt, the read that brings it, its node and topic.

    Who wants it is told by the running gateway; without one the read is that of a plan for everything
    that is monitored.
    """
    from gateway.terminal.connect import run
    from gateway.terminal.explained import explained_lines, explained_object
    from gateway.terminal.output import say, say_json

    found = run(_explain(site, tag))
    if as_json:
        say_json(explained_object(found))
    else:
        say("\n".join(explained_lines(found)))


async def _explain(path: Path, tag: str) -> Explained:
    from gateway.bridge.place import running
    from gateway.terminal.connect import running_bridge
    from gateway.terminal.sites import load

    site = load(path)
    if running(site.data):
        async with running_bridge(site) as bridge:
            return _found(site, bridge.catalogue, tag, await bridge.demand(tag), True)
    catalogue, demand = _planned(site, tag)
    return _found(site, catalogue, tag, demand, False)


def _found(site: Site, catalogue: Catalogue, tag: str, demand: Demand, running: bool) -> Explained:
    """The subject of a tag. Raises UsageError if there is none."""
    from gateway.tag import split_tag, tag_of
    from gateway.terminal.errors import UsageError
    from gateway.terminal.explained import Explained
    from gateway.terminal.words import nearest

    subjects: dict[str, tuple[DriveInfo, PointInfo | CommandInfo]] = {}
    for drive in catalogue.drives:
        subjects |= {tag_of(drive.name, point.name): (drive, point) for point in drive.points}
        subjects |= {tag_of(drive.name, command.name): (drive, command) for command in drive.commands}
    if tag not in subjects:
        raise UsageError(f"there is no tag {tag!r}{nearest(tag, subjects)}")
    config = next(drive for drive in site.drives if drive.name == split_tag(tag)[0])
    drive, info = subjects[tag]
    return Explained(site, config, drive, info, demand, running)


def _planned(site: Site, tag: str) -> tuple[Catalogue, Demand]:
    """What the core itself plans when everything monitored is wanted, and this tag beside it."""
    from gateway import __version__
    from gateway.bridge.api import Demand
    from gateway.bridge.messages import AskDemand, DemandIs, Watch
    from gateway.core.core import Core
    from gateway.core.events import Asked, Joined, Started, Tell
    from gateway.tag import Instant, Role
    from gateway.terminal.words import points_by_tag, select

    core, now = Core(site, __version__), Instant(0.0, 0)
    points = points_by_tag(core.catalogue)
    wanted = {*select(core.catalogue, ()), *([tag] if tag in points and points[tag].readable else [])}
    wants = {name: site.rates[points[name].rate] for name in wanted}
    for event in (Started(), Joined(1, "explain", Role.VIEWER), Asked(1, Watch(1, wants))):
        core.step(event, now)
    told = core.step(Asked(1, AskDemand(2, tag)), now)
    answers = (m.message.demand for m in told if isinstance(m, Tell) and isinstance(m.message, DemandIs))
    reading = next(answers, Demand()).reading
    return core.catalogue, Demand(reading=reading)
