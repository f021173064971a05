"""How drives, points and commands are called outside: one default rule, templates, single exceptions. Pure.

A template is a text with ``<placeholders>``. The templates of a drive replace those of the site key by
key, those the default ones; a name given to a single point replaces what the templates make.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from gateway.mapping.forms import FormError
from gateway.mapping.profile import Profile
from gateway.mapping.shape import nearest
from gateway.mapping.site import DriveNames, Names

DEFAULTS: Mapping[str, str] = MappingProxyType(
    {
        "drive_node": "<drive>",
        "drive_browse": "<drive>",
        "drive_topic": "<site>/<drive>",
        "node": "<drive>.<point>",
        "browse": "<point>",
        "topic": "<point>",
    }
)
"""Key of the section ``names`` to the template that holds when nobody gives another."""
COMMANDS = "commands"
"""What ``<group>`` means for a command, which is in no group."""
_PLACEHOLDER = re.compile(r"<([^<>]*)>")
_OF_A_DRIVE = ("site", "gateway", "line", "drive")
_OF_A_POINT = (*_OF_A_DRIVE, "group", "point")
_LONGEST = 512
_WILD = frozenset("+#")


@dataclass(frozen=True, slots=True)
class Owner:
    """Where a drive belongs: site, gateway and line; and its own name."""

    site: str
    gateway: str
    line: str
    drive: str

    def words(self) -> dict[str, str]:
        """Placeholder to what it stands for."""
        return {"site": self.site, "gateway": self.gateway, "line": self.line, "drive": self.drive}


def check_template(key: str, text: str) -> None:
    """Raises `FormError` for a placeholder that means nothing under this key, and a bracket alone."""
    known = _OF_A_DRIVE if key.startswith("drive_") else _OF_A_POINT
    for word in _PLACEHOLDER.findall(text):
        if word not in known:
            raise FormError(f"`<{word}>` means nothing in `{key}`", nearest(word, list(known)))
    if set("<>") & set(_PLACEHOLDER.sub("", text)):
        raise FormError(f"`{text}` has a bracket without its partner", "write placeholders like <point>")


def check_name(key: str, name: str) -> None:
    """Raises `FormError` when a name cannot be a node, a browse name or a topic."""
    if not name or name != name.strip() or not name.isprintable() or len(name) > _LONGEST:
        raise FormError(
            f"`{name}` cannot be a {_what(key)}",
            f"use 1 to {_LONGEST} visible characters, no blank at either end",
        )
    if key.endswith("topic"):
        _check_topic(name)


def _check_topic(name: str) -> None:
    if name.startswith("$"):
        raise FormError(f"the topic `{name}` would be the broker's own", "begin it with something else")
    for level in name.split("/"):
        if not level or any(c in _WILD or c.isspace() for c in level):
            raise FormError(f"`{name}` cannot be a topic", "no +, #, blanks or empty levels")


def names_of(
    owner: Owner,
    profile: Profile,
    templates: Mapping[str, str],
    single: Mapping[str, Mapping[str, str]] = MappingProxyType({}),
) -> DriveNames:
    """The names of a drive and of its points and commands.

    ``templates`` has every key of `DEFAULTS`; ``single`` holds names of single points and commands.
    """
    words = owner.words()
    return DriveNames(
        node=_filled(templates["drive_node"], words),
        browse=_filled(templates["drive_browse"], words),
        topic=_filled(templates["drive_topic"], words),
        points=MappingProxyType(
            {
                name: _names({**words, "group": group, "point": name}, templates, single.get(name, {}))
                for name, group in _members(profile)
            }
        ),
    )


def _members(profile: Profile) -> Iterator[tuple[str, str]]:
    """Name and group of each point and command."""
    yield from ((point.name, point.group) for point in profile.points.values())
    yield from ((name, COMMANDS) for name in profile.commands)


def _names(words: Mapping[str, str], templates: Mapping[str, str], single: Mapping[str, str]) -> Names:
    node, browse, topic = (
        single.get(key) or _filled(templates[key], words) for key in ("node", "browse", "topic")
    )
    return Names(node, browse, topic)


def _filled(template: str, words: Mapping[str, str]) -> str:
    return _PLACEHOLDER.sub(lambda match: words[match[1]], template)


def _what(key: str) -> str:
    return {"node": "node", "browse": "browse name", "topic": "topic"}[key.removeprefix("drive_")]
