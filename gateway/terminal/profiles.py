"""Profiles as plain data for programs; the shape stands in docs/cli.md."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from gateway.mapping.profile import (
    Argument,
    Broadcast,
    Command,
    Constant,
    Point,
    Profile,
    Step,
    Word,
)
from gateway.terminal.facts import (
    DERIVED,
    error_object,
    modbus_object,
    notation_object,
    number,
    serial_object,
    setting_object,
)
from gateway.terminal.points import hexadecimal, in_words, names_object, point_object, provenance_object


def profile_object(profile: Profile) -> dict[str, Any]:
    """Everything that is known of a drive model, with its sources and doubts."""
    return {
        "name": profile.name,
        "title": profile.title,
        "maker": profile.maker,
        "models": list(profile.models),
        "version": profile.version,
        "documents": {name: document.title for name, document in profile.documents.items()},
        "similar_documents": [name for name, document in profile.documents.items() if document.similar],
        "addresses": [notation_object(n) | provenance_object(n.provenance) for n in profile.notations],
        "serial": serial_object(profile.serial),
        "modbus": modbus_object(profile.modbus),
        "facts": facts_object(profile),
        "settings": [
            setting_object(s) | {"names": names_object(s.names)} | provenance_object(s.provenance)
            for s in profile.settings.values()
        ],
        "errors": [
            error_object(code, error) | provenance_object(error.provenance)
            for code, error in profile.errors.items()
        ],
        "groups": dict(profile.groups),
        **_address_space(profile.points, profile.words, profile.commands),
        "broadcast": broadcast_object(profile.broadcast),
    }


def broadcast_object(broadcast: Broadcast | None) -> dict[str, Any] | None:
    """What may be sent to all drives at once; None when the drive takes no broadcasts."""
    if broadcast is None:
        return None
    space = _address_space(broadcast.points, broadcast.words, broadcast.commands)
    return {"unit": 0, **space, **provenance_object(broadcast.provenance)}


def _address_space(
    points: Mapping[str, Point], words: Mapping[int, Word], commands: Mapping[str, Command]
) -> dict[str, Any]:
    return {
        "points": [point_object(point) for point in points.values()],
        "words": [word_object(word, points) for word in _all_words(points, words)],
        "commands": [command_object(command, points) for command in commands.values()],
    }


def facts_object(profile: Profile) -> dict[str, dict[str, Any]]:
    """Where each plain fact comes from. ``stated`` is false for what the profile does not say, so that the
    default of the language holds."""
    sections = {"serial": serial_object(profile.serial), "modbus": modbus_object(profile.modbus)}
    keys = [f"{name}.{key}" for name, section in sections.items() for key in section if key not in DERIVED]
    unstated = {"source": None, "similar_model": False, "doubt": None, "stated": False}
    return {
        key: provenance_object(profile.facts[key]) | {"stated": True} if key in profile.facts else unstated
        for key in keys
    }


def _all_words(points: Mapping[str, Point], words: Mapping[int, Word]) -> Iterator[Word]:
    """Every register that is cut into fields; one that means something else when it is read comes twice."""
    for word in words.values():
        yield word
        others = (p for p in points.values() if p.address == word.address and p.encoding.width)
        if read := tuple(point.name for point in others if point.name not in word.fields):
            yield Word(word.address, image=False, fields=read, shift=word.shift)


def word_object(word: Word, points: Mapping[str, Point]) -> dict[str, Any]:
    """A register that is cut into fields, and what every write lays over it; ``unused`` are the bits that
    the document leaves open."""
    return {
        "register": hexadecimal(word.address),
        "shift": word.shift,
        "image": word.image,
        "always_mask": hexadecimal(word.always_mask),
        "always_bits": hexadecimal(word.always_bits),
        "fields": list(word.fields),
        "unused": _unused(word, points),
    }


def _unused(word: Word, points: Mapping[str, Point]) -> list[list[int]]:
    """First and last of each stretch of bits that nothing names."""
    taken = word.always_mask
    for name in word.fields:
        cut = points[name].encoding
        taken |= ((1 << cut.width) - 1) << cut.bit
    free = [bit for bit in range(16) if not taken >> bit & 1]
    starts = [bit for bit in free if bit - 1 not in free]
    ends = [bit for bit in free if bit + 1 not in free]
    return [list(span) for span in zip(starts, ends, strict=True)]


def command_object(command: Command, points: Mapping[str, Point]) -> dict[str, Any]:
    """A command: its arguments with the points that lend them type, unit and limits, and its steps."""
    return {
        "name": command.name,
        "args": dict(command.args),
        "only_when": in_words(command.only_when),
        "steps": [step_object(step, points) for step in command.steps],
        "role": command.role,
        "urgent": command.urgent,
        "help": command.help,
        **provenance_object(command.provenance),
    }


def step_object(step: Step, points: Mapping[str, Point]) -> dict[str, Any]:
    """One frame of a command, and what proves it."""
    return {
        "when": in_words(step.when),
        "write": {name: written(value, points.get(name)) for name, value in step.write.items()},
        "registers": sorted({hexadecimal(points[name].address) for name in step.write if name in points}),
        "until": in_words(step.until),
        "within": step.within,
    }


def written(value: Constant | Argument, point: Point | None) -> bool | int | float | str:
    """What a step writes, as a profile spells it: ``forward``, ``true``, ``0``, ``<frequency>``."""
    if isinstance(value, Argument):
        return f"{'-' if value.negate else ''}<{value.name}>"
    if point is None:
        return number(value.value)
    names = point.encoding.values
    if names:
        return names.get(int(value.value), number(value.value))
    return bool(value.value) if point.encoding.value_type == "boolean" else number(value.value)


def doubtful(points: Iterable[Point]) -> int:
    """How many points are in doubt or known of a similar model only."""
    return sum(point.provenance.doubt is not None or point.provenance.similar for point in points)
