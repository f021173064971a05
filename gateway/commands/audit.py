"""``gateway audit``: who asked for what, what was sent, what became of it; and is the record whole."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gateway.terminal.options import AsJson, SiteFile

if TYPE_CHECKING:
    from gateway.core.audit import Passage
    from gateway.core.disk import Disk
    from gateway.terminal.auditing import Wanted

EXAMPLES = """
gateway audit site.yaml --drive fan-1 --since 8h

gateway audit site.yaml --who anna --outcome refused --json

gateway audit site.yaml --verify
"""


def audit(  # noqa: PLR0913 - one filter each
    site: SiteFile,
    drive: Annotated[str, typer.Option(metavar="DRIVE", help="About this drive; * and ? match.")] = "",
    who: Annotated[str, typer.Option(metavar="NAME", help="Asked by this person; * and ? match.")] = "",
    since: Annotated[str, typer.Option(metavar="TIME", help="2026-11-24T12:00 (UTC), or 8h ago.")] = "",
    until: Annotated[str, typer.Option(metavar="TIME", help="Before this time.")] = "",
    outcome: Annotated[str, typer.Option(metavar="VERDICT", help="confirmed, refused, unknown ...")] = "",
    kind: Annotated[str, typer.Option(metavar="KIND", help="intent, outcome, alarm, boot ...")] = "",
    ask: Annotated[int | None, typer.Option(metavar="N", help="Everything about this ask.")] = None,
    last: Annotated[int | None, typer.Option(metavar="N", min=1, help="Only the last so many.")] = None,
    verify: Annotated[bool, typer.Option("--verify", help="Look whether the chain is whole.")] = False,
    holds: Annotated[
        str, typer.Option(metavar="HASH", help="With --verify: is the line with this hash there?")
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Read the journal, whether a gateway runs or not. With --verify, exit 1 and the place of each break if
    it is not whole."""
    import time

    from gateway.terminal.auditing import Wanted, time_of

    disk = _disk(site)
    if verify or holds:
        _verify(disk, holds, as_json)
        return
    now = time.time_ns()
    wanted = Wanted(
        drive=drive,
        who=who,
        since=time_of(since, now) if since else None,
        until=time_of(until, now) if until else None,
        outcome=outcome,
        kind=kind,
        ask=ask,
    )
    for passage in _chosen(disk, wanted, last):
        _say(passage, as_json)


def _disk(path: Path) -> Disk:
    from gateway.core.disk import Folder
    from gateway.terminal.errors import CommandError
    from gateway.terminal.sites import load

    data = load(path).data
    disk = Folder(data)
    if not disk.names():
        raise CommandError(f"there is no journal in {data} (a gateway makes one when it runs)")
    return disk


def _chosen(disk: Disk, wanted: Wanted, last: int | None) -> Iterator[Passage]:
    from gateway.core.audit import passages

    chosen = (p for p in passages(disk) if p.line.entry is not None and wanted.takes(p.line.entry))
    return chosen if last is None else iter(deque(chosen, last))


def _say(passage: Passage, as_json: bool) -> None:
    from gateway.terminal.auditing import entry_line, entry_object
    from gateway.terminal.output import say, say_json

    assert passage.line.entry is not None
    if as_json:
        say_json(entry_object(passage.line.entry, f"{passage.file}:{passage.line.number}"))
    else:
        say(entry_line(passage.line.entry))


def _verify(disk: Disk, hash: str, as_json: bool) -> None:
    from gateway.core.audit import check
    from gateway.terminal.auditing import checked_lines, checked_object
    from gateway.terminal.output import say, say_json

    found = check(disk, hash)
    if as_json:
        say_json(checked_object(found) | ({"holds": found.holds} if hash else {}))
    else:
        said = [f"the line with the hash {hash} is {'there' if found.holds else 'not there'}"] if hash else []
        say("\n".join([*checked_lines(found), *said]))
    if found.breaks or (hash and not found.holds):
        raise typer.Exit(1)
