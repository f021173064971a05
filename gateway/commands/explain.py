"""``gateway explain``: where a tag comes from, how it is read, who gets it and under which names."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.bridge.api import Catalogue, CommandInfo, Demand
    from gateway.mapping.site import Site
    from gateway.terminal.broadcasts import ForAll
    from gateway.terminal.explained import Explained
    from gateway.terminal.explainedown import ExplainedOwn

EXAMPLES = """
gateway explain site.yaml fan-1.output_frequency

gateway explain site.yaml fan-1.run_forward --json

gateway explain site.yaml _north.utilisation
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
    from gateway.terminal.output import say, say_json
    from gateway.terminal.sites import load

    about, lines = _told(run(_explain(load(site), tag)))
    if as_json:
        say_json(about)
    else:
        say("\n".join(lines))


def _told(found: Explained | ExplainedOwn | ForAll) -> tuple[dict[str, Any], Iterable[str]]:
    """What there is to tell, for programs and for people."""
    from gateway.terminal import broadcasts, explained, explainedown

    if isinstance(found, explainedown.ExplainedOwn):
        return explainedown.explained_object(found), explainedown.explained_lines(found)
    if isinstance(found, broadcasts.ForAll):
        return broadcasts.explained_object(found), broadcasts.explained_lines(found)
    return explained.explained_object(found), explained.explained_lines(found)


async def _explain(site: Site, tag: str) -> Explained | ExplainedOwn | ForAll:
    from gateway.bridge.place import running
    from gateway.tag import split_tag
    from gateway.terminal.broadcasts import broadcast_of
    from gateway.terminal.connect import running_bridge
    from gateway.terminal.sites import refuse_absent

    for_all = broadcast_of(site, tag)
    if for_all is not None:
        return for_all
    refuse_absent(site, *split_tag(tag))
    if running(site.data):
        async with running_bridge(site) as bridge:
            return _found(site, bridge.catalogue, tag, await bridge.demand(tag), True)
    catalogue, demand = _planned(site, tag)
    return _found(site, catalogue, tag, demand, False)


def _found(
    site: Site, catalogue: Catalogue, tag: str, demand: Demand, running: bool
) -> Explained | ExplainedOwn:
    """The subject of a tag. Raises UsageError if there is none."""
    from gateway.bridge.api import DIAGNOSTIC, PointInfo
    from gateway.tag import split_tag, tag_of
    from gateway.terminal.errors import UsageError
    from gateway.terminal.explained import Explained
    from gateway.terminal.explainedown import ExplainedOwn
    from gateway.terminal.words import nearest, points_by_tag

    commands = {tag_of(d.name, command.name): command for d in catalogue.drives for command in d.commands}
    subjects: dict[str, PointInfo | CommandInfo] = {**points_by_tag(catalogue), **commands}
    if tag not in subjects:
        raise UsageError(f"there is no tag {tag!r}{nearest(tag, subjects)}")
    info, name = subjects[tag], split_tag(tag)[0]
    if isinstance(info, PointInfo) and info.kind == DIAGNOSTIC:
        owner = next(owner for owner in catalogue.owners if owner.name == name)
        return ExplainedOwn(owner, info, demand, running)
    config = next(drive for drive in site.drives if drive.name == name)
    drive = next(drive for drive in catalogue.drives if drive.name == name)
    return Explained(site, config, drive, info, demand, running)


def _planned(site: Site, tag: str) -> tuple[Catalogue, Demand]:
    """What the core itself plans when everything monitored is wanted, and this tag beside it."""
    from gateway import __version__
    from gateway.bridge.api import Demand
    from gateway.bridge.messages import AskDemand, DemandIs, Watch
    from gateway.core.core import Core
    from gateway.core.events import Asked, Joined, Started, Tell
    from gateway.core.memory import Memory
    from gateway.tag import Instant, Role
    from gateway.terminal.learned import learned_gaps
    from gateway.terminal.words import points_by_tag, select

    core, now = Core(site, __version__), Instant(0.0, 0)
    points = points_by_tag(core.catalogue)
    wanted = {*select(core.catalogue, ()), *([tag] if tag in points and points[tag].readable else [])}
    wants = {name: site.rates[points[name].rate] for name in wanted}
    memory = Memory(gaps=learned_gaps(site))
    for event in (Started(memory), Joined(1, "explain", Role.VIEWER), Asked(1, Watch(1, wants))):
        core.step(event, now)
    told = core.step(Asked(1, AskDemand(2, tag)), now)
    answers = (m.message.demand for m in told if isinstance(m, Tell) and isinstance(m.message, DemandIs))
    demand = next(answers, Demand())
    return core.catalogue, Demand(reading=demand.reading, gaps=demand.gaps)
