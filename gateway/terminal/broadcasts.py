"""What a profile says of messages to all drives at once: how to ask for it, and who may."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from gateway.mapping.absent import members
from gateway.mapping.profile import Broadcast, Command, Point
from gateway.mapping.site import DriveConfig, Site
from gateway.tag import Role, own_name, split_tag
from gateway.terminal.points import point_object
from gateway.terminal.profiles import command_object
from gateway.terminal.sheet import command_text, doubt_text, notes, place_text, source_text

UNIT = 0
"""The unit address that all drives obey."""


@dataclass(frozen=True, slots=True)
class ForAll:
    """A point or command of the broadcast layout of a drive's profile."""

    config: DriveConfig
    broadcast: Broadcast
    subject: Point | Command
    role: Role | None
    """Least role that may command the line as a whole; None: nobody may."""

    @property
    def how(self) -> str:
        """How it reaches the wire, in words."""
        if self.role is None:
            return f"not at all: {self.config.line} has no `broadcast: {{role: ...}}` in the site file"
        name = self.subject.name
        commands = self.broadcast.commands.items()
        names = [
            n for n, command in commands if n == name or any(name in step.write for step in command.steps)
        ]
        by = ", ".join(names) or "no command"
        return f"by {by} of {self.config.line}, {self.role.value} and above (a stop: operator)"


def explained_object(found: ForAll) -> dict[str, Any]:
    """For programs; the shape stands in docs/cli.md."""
    subject, layout = found.subject, found.broadcast
    document = found.config.profile.documents.get(subject.provenance.document)
    about = point_object(subject) if isinstance(subject, Point) else command_object(subject, layout.points)
    return {
        "tag": f"{found.config.name}.{subject.name}",
        "line": found.config.line,
        "unit_address": UNIT,
        "profile": found.config.profile.name,
        "document": document.title if document else None,
        "section": subject.provenance.place,
        **about,
        "sent": found.role is not None,
        "reason": found.how,
    }


def explained_lines(found: ForAll) -> Iterator[str]:
    """For people: a headline, then one fact a line."""
    yield f"{found.config.name}.{found.subject.name}: {found.subject.help}".rstrip(": ")
    for title, text in _facts(found):
        yield f"  {title:9} {text}"


def _facts(found: ForAll) -> Iterator[tuple[str, str]]:
    subject = found.subject
    yield "sent", found.how
    yield "document", source_text(subject.provenance, found.config.profile.documents)
    if doubt := doubt_text(subject.provenance):
        yield "doubt", doubt
    if isinstance(subject, Point):
        yield "register", f"{place_text(subject)}, unit {UNIT} (all drives) on {found.config.line}"
        yield from (("note", text) for text in notes(subject, doubts=False))
    else:
        yield from (("command", line) for line in command_text(subject, found.broadcast.points))


def broadcast_of(site: Site, tag: str) -> ForAll | None:
    """What a tag means if it is of a broadcast layout: ``pump-2.run_forward_all``, or of the line."""
    drive, name = split_tag(tag)
    owners = [config for config in site.drives if drive in (config.name, config.line, own_name(config.line))]
    config = next(iter(owners), None)
    broadcast = config.profile.broadcast if config is not None else None
    if config is None or broadcast is None or name not in members(broadcast):
        return None
    role = next(line.broadcast for line in site.lines if line.name == config.line)
    return ForAll(config, broadcast, broadcast.points.get(name) or broadcast.commands[name], role)
