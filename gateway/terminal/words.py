"""Words from the command line turned into tags and values. Pure."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

from gateway.bridge.api import Catalogue, CommandInfo, DriveInfo, OwnerInfo, PointInfo
from gateway.tag import Value, ValueType, matches, tag_of
from gateway.terminal.errors import UsageError

_T = TypeVar("_T")

TRUE, FALSE = ("true", "on", "yes", "1"), ("false", "off", "no", "0")
MONITORED = ("status", "measurement", "fault")


def points_by_tag(catalogue: Catalogue) -> dict[str, PointInfo]:
    """Every point of every drive, of the lines and of the gateway, by tag, in the order of the catalogue."""
    return {tag_of(owner.name, point.name): point for owner in catalogue.owners for point in owner.points}


def select(catalogue: Catalogue, patterns: Iterable[str]) -> list[str]:
    """The readable tags that the patterns name (``fan-1.*``), each once; without patterns, everything
    that is monitored. The gateway's own names are named by an underscore only (``_north.*``, ``fan-1._*``).

    Raises:
        UsageError: if a pattern names nothing.
    """
    points = {tag: point for tag, point in points_by_tag(catalogue).items() if point.readable}
    wanted = list(patterns)
    if not wanted:
        return [tag for tag, point in points.items() if point.kind in MONITORED]
    found: dict[str, None] = {}
    for pattern in wanted:
        hits = [tag for tag in points if matches(pattern, tag)]
        if not hits:
            raise UsageError(f"no readable tag matches {pattern!r}{nearest(pattern, points)}")
        found.update(dict.fromkeys(hits))
    return list(found)


def find_drive(catalogue: Catalogue, name: str) -> DriveInfo:
    """The drive of that name. Raises UsageError if there is none."""
    return _find({drive.name: drive for drive in catalogue.drives}, name, "drive")


def drive_named(catalogue: Catalogue, name: str) -> DriveInfo | None:
    """The drive of that name; None if there is none."""
    return next((drive for drive in catalogue.drives if drive.name == name), None)


def commanded_named(catalogue: Catalogue, name: str) -> OwnerInfo | None:
    """The drive of that name, else the line whose drives can be commanded together (``north``, ``_north``);
    None if there is neither."""
    lines = (line for line in catalogue.lines if line.commands and name in (line.browse, line.name))
    return drive_named(catalogue, name) or next(lines, None)


def command_named(owner: OwnerInfo | None, name: str) -> CommandInfo | None:
    """The command of a drive or line; None if there is none."""
    return next((command for command in owner.commands if command.name == name), None) if owner else None


def written_by(owner: OwnerInfo | None, name: str) -> PointInfo | None:
    """The point that the only argument of a command is about; None if there is none, or more."""
    command = command_named(owner, name)
    names = [argument.point for argument in command.args] if command else []
    points = owner.points if owner and len(names) == 1 else ()
    return next((point for point in points if point.name == names[0]), None)


def arguments(command: CommandInfo | None, words: Sequence[str]) -> dict[str, Value]:
    """``NAME=VALUE`` words as the arguments of a command (None: of one that is not there), as far as they can
    be read. The core says what is wrong with the others.

    Raises:
        UsageError: if a name is given twice.
    """
    known = {argument.name: argument for argument in command.args} if command else {}
    values: dict[str, Value] = {}
    for word in words:
        name, text = split(word)
        if name in values:
            raise UsageError(f"{name} is given twice")
        argument = known.get(name)
        values[name] = as_meant(text, argument.type, argument.values) if argument else text
    return values


def as_meant(text: str, type: ValueType, values: Mapping[int, str]) -> Value:
    """A value as `read_value`; what cannot be read stays a text, for the core to say what is wrong."""
    try:
        return read_value(text, type, values)
    except UsageError:
        return text


def split(word: str) -> tuple[str, str]:
    """Both sides of ``NAME=VALUE``. Raises UsageError if there is no ``=``."""
    name, sign, text = word.partition("=")
    if not (sign and name and text):
        raise UsageError(f"NAME=VALUE is expected, not {word!r}")
    return name, text


def read_value(text: str, type: ValueType, values: Mapping[int, str]) -> Value:
    """A value as a person writes it; an enumeration by number or name.

    Raises:
        UsageError: if it is not of that type. A number that is not finite never is.
    """
    if values:
        return _read_choice(text, values)
    return _READERS[type](text)


def nearest(word: str, known: Iterable[str]) -> str:
    """`` (did you mean x?)`` when something known is spelled like ``word``, else nothing."""
    close = difflib.get_close_matches(word, list(known), n=1)
    return f" (did you mean {close[0]}?)" if close else ""


def _find(known: Mapping[str, _T], name: str, what: str) -> _T:
    if name not in known:
        raise UsageError(f"there is no {what} {name!r}{nearest(name, known)}")
    return known[name]


def _read_choice(text: str, values: Mapping[int, str]) -> Value:
    if text in values.values():
        return text
    if text.isdecimal() and int(text) in values:
        return int(text if text.isascii() and "_" not in text else "")
    raise UsageError(f"{text!r} is none of {', '.join(values.values())}{nearest(text, values.values())}")


def _read_boolean(text: str) -> Value:
    if text.lower() in TRUE + FALSE:
        return text.lower() in TRUE
    raise UsageError(f"{text!r} is neither true nor false")


def _read_integer(text: str) -> Value:
    try:
        return int(text if text.isascii() and "_" not in text else "")
    except ValueError:
        raise UsageError(f"{text!r} is not a whole number") from None


def _read_number(text: str) -> Value:
    try:
        number = float(text if text.isascii() and "_" not in text else "")
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise UsageError(f"{text!r} is not a number")
    return number


_READERS: Mapping[ValueType, Callable[[str], Value]] = {
    ValueType.BOOLEAN: _read_boolean,
    ValueType.INTEGER: _read_integer,
    ValueType.NUMBER: _read_number,
    ValueType.TEXT: str,
}
