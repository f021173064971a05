"""The names of the gateway's topics.

::

    <drive>/state/<point>            retained: the present value
    <drive>/data                     values that were read together
    <drive>/event                    what happened
    <drive>/meta                     retained: points and commands
    <drive>/status                   retained: does the drive answer
    <drive>/lease                    retained: who may command it
    <drive>/cmd/<point or command>   to the gateway
    <drive>/ack/<point or command>   the answer
    <drive>/cmd/lease, cmd/maintenance   to the gateway itself, about the drive
    <site>/_gateway/<gateway>/status   retained: birth and will
    <site>/_gateway/<gateway>/event
    <site>/_gateway/<gateway>/state/<point>, data                what the gateway tells of itself
    <site>/_gateway/<gateway>/lines/<line>/state/<point>, data   and of a line, where a rule asks for it
    <site>/_gateway/<gateway>/lines/<line>/cmd/<command>, ack/<command>, meta   to all drives of a line

``<drive>`` is what the site calls the drive's tree, ``<site>/<drive name>`` if it calls it nothing;
``<point>`` likewise the point's own name. Both may have several levels.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from gateway.bridge.api import CommandInfo, DriveInfo, OwnerInfo, PointInfo
from gateway.northbound.mqtt.levels import TopicError, check_level, check_levels, is_below

RESERVED = "_gateway"
"""The gateway's own topics are below ``<site>/_gateway``; no drive's may be there."""
BRANCHES = ("state", "data", "event", "meta", "status", "lease", "cmd", "ack")
"""What a drive's tree branches into."""
LEASE, MAINTENANCE = "lease", "maintenance"
OWN = (LEASE, MAINTENANCE)
"""Commands to the gateway itself about a drive; no point's or command's topic may be called so."""


class Target(NamedTuple):
    """What a command topic addresses. ``name`` is the point or command, empty when the drive has none
    there; ``place`` is what stands behind ``cmd/``. ``own``: it is one of `OWN`."""

    drive: str
    name: str
    place: str
    own: bool = False


class Topics:
    """The topics of one gateway.

    Raises:
        TopicError: if a name cannot stand in a topic, or two things would have the same one.
    """

    def __init__(
        self, site: str, gateway: str, drives: Iterable[DriveInfo] = (), others: Sequence[OwnerInfo] = ()
    ) -> None:
        self._site = check_level(site)
        self._own = f"{site}/{RESERVED}/{check_level(gateway)}"
        _check_first(site)
        self._trees: dict[str, str] = {}
        self._own_trees = {other.name: other.topic for other in others}
        self._places: dict[tuple[str, str], str] = {}
        self._targets: dict[str, Target] = {}
        for drive in drives:
            self._add_drive(drive)
        self._check_trees()
        self._commanded = dict(self._trees)
        for other in others:
            self._add_commands(other)

    def state(self, drive: str, point: str) -> str:
        """Present value of a point."""
        if drive in self._own_trees:
            return f"{self._own_trees[drive]}/state/{point}"
        return f"{self._trees[drive]}/state/{self._places[drive, point]}"

    def data(self, drive: str) -> str:
        """Values of a drive that were read together."""
        return f"{self._trees.get(drive) or self._own_trees[drive]}/data"

    def event(self, drive: str) -> str:
        """Events of a drive; of the gateway itself for any other name."""
        return f"{self._trees.get(drive) or self._own_trees.get(drive, self._own)}/event"

    def meta(self, drive: str) -> str:
        """What a drive offers, or a line to all its drives."""
        return f"{self._commanded[drive]}/meta"

    def status(self, drive: str) -> str:
        """Whether a drive answers."""
        return f"{self._trees[drive]}/status"

    def lease(self, drive: str) -> str:
        """Who may command a drive."""
        return f"{self._trees[drive]}/{LEASE}"

    def ack(self, target: Target) -> str:
        """Answers to the commands for a target."""
        return f"{self._commanded[target.drive]}/ack/{target.place}"

    @property
    def gateway_status(self) -> str:
        """Birth and will of the gateway."""
        return f"{self._own}/status"

    @property
    def commands(self) -> tuple[str, ...]:
        """The filters that catch the commands for our drives and lines, one for each of them."""
        return tuple(f"{tree}/cmd/#" for tree in self._commanded.values())

    def command(self, topic: str) -> Target | None:
        """What a command topic addresses, exactly; None for a topic that is no command for our drives."""
        if (known := self._targets.get(topic)) is not None:
            return known
        for drive, tree in self._commanded.items():
            if topic.startswith(f"{tree}/cmd/"):
                return Target(drive, "", topic.removeprefix(f"{tree}/cmd/"))
        return None

    def foreign(self, topic: str) -> bool:
        """True when answers may be sent to ``topic`` because a client asks for it.

        Nothing inside the trees of the site and of our drives (the gateway would lend its rights to forge a
        state, an answer or a command), no wildcards, nothing of the broker's.
        """
        own = any(is_below(topic, tree) for tree in (self._site, *self._trees.values()))
        return bool(topic) and not own and not topic.startswith("$") and not set(topic) & set("+#\0")

    def _add_drive(self, drive: DriveInfo) -> None:
        tree = self._trees[drive.name] = drive.topic or f"{self._site}/{check_level(drive.name)}"
        _check_first(check_levels(tree))
        if is_below(tree, f"{self._site}/{RESERVED}"):
            raise TopicError(f"{drive.name}: the gateway's own topics are below {RESERVED} (rename it)")
        members: list[PointInfo | CommandInfo] = [*drive.points, *drive.commands]
        for name in OWN:
            self._targets[f"{tree}/cmd/{name}"] = Target(drive.name, name, name, own=True)
        for member in members:
            self._add_member(drive.name, tree, member)

    def _add_commands(self, other: OwnerInfo) -> None:
        """What can be commanded beside drives: a line, all drives of it at once."""
        if other.commands:
            self._commanded[other.name] = other.topic
        for command in other.commands:
            target = Target(other.name, command.name, command.name)
            self._targets[f"{other.topic}/cmd/{command.name}"] = target

    def _add_member(self, drive: str, tree: str, member: PointInfo | CommandInfo) -> None:
        place = self._places[drive, member.name] = check_levels(member.topic or member.name)
        topic = f"{tree}/cmd/{place}"
        if topic in self._targets:
            both = f"{self._targets[topic].name} and {member.name}"
            raise TopicError(f"{drive}: {both} would both be at {topic} (give one of them another topic)")
        self._targets[topic] = Target(drive, member.name, place)

    def _check_trees(self) -> None:
        """No drive's tree may be another's, or lie inside one of its branches."""
        for name, tree in self._trees.items():
            for other, above in self._trees.items():
                inside = any(is_below(tree, f"{above}/{branch}") for branch in BRANCHES)
                if inside or (tree == above and name != other):
                    raise TopicError(f"topics of {name} and {other} mix at {tree} (give one another topic)")


def _check_first(topic: str) -> None:
    if topic.startswith("$"):
        raise TopicError(f"{topic!r}: topics that begin with $ belong to the broker (rename it)")
