"""The checks of a site's outside names: each must be legal, and nothing may be called as another. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.naming import check_name
from gateway.mapping.node import Path
from gateway.mapping.own import OF_A_LINE, OF_THE_GATEWAY, of_a_drive
from gateway.mapping.profile import Profile
from gateway.mapping.site import DriveNames
from gateway.mapping.sitefile import LABEL
from gateway.tag import GATEWAY, own_name, tag_of

GATEWAYS_OWN = GATEWAY
"""The topics below ``<site>/_gateway`` are the gateway's own."""
BRANCHES = ("state", "data", "event", "meta", "status", "lease", "cmd", "ack")
"""What the topics of a drive branch into."""
PARTS = ("ParameterSet", "MethodSet", "Identification", "Diagnostics", "Lock", "Administration")
"""What stands below a drive's node beside the groups of its profile."""
COMMANDS = ("lease", "maintenance")
"""Topics of commands to the gateway itself about a drive."""


@dataclass(frozen=True, slots=True)
class Named:
    """A drive with its names; ``where`` tells the place in the file that a name of it comes from, by
    point (empty: the drive itself) and key."""

    drive: str
    names: DriveNames
    profile: Profile
    where: Mapping[tuple[str, str], Path]

    def place(self, member: str, key: str) -> Path:
        """Where a name is written: for the point itself, else the template."""
        return self.where.get((member, key)) or self.where["", key]

    def uses(self) -> Iterator[tuple[str, str, str]]:
        """Every name: of which point or command (empty: the drive), under which key, and the name."""
        yield from (("", f"drive_{key}", getattr(self.names, key)) for key in ("node", "browse", "topic"))
        for member, names in self.names.points.items():
            yield from ((member, key, getattr(names, key)) for key in ("node", "browse", "topic"))


def check_names(drives: Iterable[Named], site: str, lines: Iterable[str], report: Report) -> None:
    """Complain about names that are illegal or taken, at most once about each place of the file."""
    known = list(drives)
    once = _Once(report)
    for drive in known:
        if LABEL.fullmatch(drive.drive):
            _check_legal(drive, once)
    _Nodes(once, lines).check(known)
    for drive in known:
        _check_members(drive, once)
    _check_trees(known, site, once)


class _Once:
    """Complains at most once about each place: a template is wrong for every point at once."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._told: set[Path] = set()

    def error(self, place: Path, message: str, remedy: str) -> None:
        """As `Report.error`, for the first complaint about ``place``."""
        if place not in self._told:
            self._told.add(place)
            self._report.error(place, message, remedy)


def _check_legal(drive: Named, once: _Once) -> None:
    for member, key, name in drive.uses():
        try:
            check_name(key, name)
        except FormError as error:
            once.error(drive.place(member, key), error.message, error.remedy)


class _Nodes:
    """All node ids of the site: they are one name space."""

    def __init__(self, once: _Once, lines: Iterable[str]) -> None:
        self._once = once
        owners = {own_name(line): OF_A_LINE for line in lines} | {GATEWAY: OF_THE_GATEWAY}
        tags = [tag_of(owner, name) for owner, points in owners.items() for name in points]
        self._taken = dict.fromkeys((*owners, *tags), "the gateway's own")

    def check(self, drives: Iterable[Named]) -> None:
        """Complain about nodes of drives, points and commands that are taken."""
        for drive in drives:
            self._take(drive.names.node, drive.drive, drive.place("", "drive_node"))
            for part in (*PARTS, *drive.profile.groups):
                self._taken.setdefault(f"{drive.names.node}/{part}", f"{drive.drive}/{part}")
            for name in of_a_drive(drive.profile):
                self._taken.setdefault(tag_of(drive.names.node, name), tag_of(drive.drive, name))
        for drive in drives:
            for member, names in drive.names.points.items():
                self._take(names.node, f"{drive.drive}.{member}", drive.place(member, "node"))

    def _take(self, node: str, owner: str, place: Path) -> None:
        if node in self._taken:
            message = f"the node `{node}` of `{owner}` is `{self._taken[node]}` already"
            self._once.error(place, message, "add <drive> or <point>, or use another name")
        self._taken.setdefault(node, owner)


def _check_members(drive: Named, once: _Once) -> None:
    """Browse names and topics must differ within a drive."""
    for key, what in (("browse", "browse name"), ("topic", "topic")):
        taken = {name: f"{drive.drive}.{name}" for name in of_a_drive(drive.profile)}
        if key == "topic":
            taken |= dict.fromkeys(COMMANDS, "the gateway's own")
        for member, names in drive.names.points.items():
            name = getattr(names, key)
            if name in taken:
                message = (
                    f"the {what} `{name}` of `{drive.drive}.{member}` is that of `{taken[name]}` already"
                )
                once.error(drive.place(member, key), message, "add <point>, or use another name")
            taken.setdefault(name, f"{drive.drive}.{member}")


def _check_trees(drives: list[Named], site: str, once: _Once) -> None:
    """No drive's topics may be another's, lie inside one of its branches, or be the gateway's own."""
    for index, drive in enumerate(drives):
        tree, place = drive.names.topic, drive.place("", "drive_topic")
        if _below(tree, f"{site}/{GATEWAYS_OWN}"):
            once.error(place, f"`{site}/{GATEWAYS_OWN}` is the gateway's own topic", "use another name")
        for other in drives[:index]:
            if _mixed(tree, other.names.topic):
                message = f"the topics of `{drive.drive}` and `{other.drive}` mix at `{tree}`"
                nearest_written = max(place, other.place("", "drive_topic"), key=len)
                once.error(nearest_written, message, "add <drive>, or use another name")


def _mixed(one: str, other: str) -> bool:
    inside = any(
        _below(inner, f"{outer}/{branch}")
        for inner, outer in ((one, other), (other, one))
        for branch in BRANCHES
    )
    return one == other or inside


def _below(topic: str, tree: str) -> bool:
    return topic == tree or topic.startswith(f"{tree}/")
