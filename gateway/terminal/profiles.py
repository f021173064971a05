"""Profiles as plain data for programs; the shape stands in docs/cli.md."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any

from gateway.mapping.profile import (
    Argument,
    Broadcast,
    Command,
    Condition,
    Constant,
    Encoding,
    Limits,
    Point,
    Profile,
    Provenance,
    Step,
    Word,
)
from gateway.terminal.facts import error_object, modbus_object, number, serial_object, setting_object


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
        "serial": serial_object(profile.serial),
        "modbus": modbus_object(profile.modbus),
        "facts": {key: provenance_object(found) for key, found in profile.facts.items()},
        "settings": [setting_object(s) | provenance_object(s.provenance) for s in profile.settings.values()],
        "errors": [
            error_object(code, error) | provenance_object(error.provenance)
            for code, error in profile.errors.items()
        ],
        "groups": dict(profile.groups),
        **_address_space(profile.points, profile.words, profile.commands),
        "broadcast": broadcast_object(profile.broadcast),
    }


def broadcast_object(broadcast: Broadcast | None) -> dict[str, Any] | None:
    """What may be sent to all drives at once, which this version does not do; None when the drive takes no
    broadcasts."""
    if broadcast is None:
        return None
    space = _address_space(broadcast.points, broadcast.words, broadcast.commands)
    return {"unit": 0, "sent": False, **space, **provenance_object(broadcast.provenance)}


def _address_space(
    points: Mapping[str, Point], words: Mapping[int, Word], commands: Mapping[str, Command]
) -> dict[str, Any]:
    return {
        "points": [point_object(point) for point in points.values()],
        "words": [word_object(word) for word in words.values()],
        "commands": [command_object(command, points) for command in commands.values()],
    }


def point_object(point: Point) -> dict[str, Any]:
    """A point: where it is, what it means, how it may be written, and how far that may be believed."""
    return {
        "name": point.name,
        "group": point.group,
        "kind": point.kind,
        **_place(point),
        **encoding_object(point.encoding),
        "range": range_object(point.limits),
        "when": in_words(point.when),
        "cases": [
            {
                "when": in_words(case.when),
                **encoding_object(case.encoding),
                "range": range_object(case.limits),
            }
            for case in point.cases
        ],
        "rate": point.rate,
        **_writing(point),
        "help": point.help,
        **provenance_object(point.provenance),
    }


def _place(point: Point) -> dict[str, Any]:
    return {
        "registers": [hexadecimal(point.address + index) for index in range(point.words)],
        "table": point.table,
        "notation": point.notation,
        "bits": bits_of(point.encoding),
        "shift": point.shift,
        "select": {name: number(value.value) for name, value in point.select.items()},
    }


def encoding_object(encoding: Encoding) -> dict[str, Any]:
    """How raw bits become a value; ``exact`` is the scale as a fraction."""
    return {
        "type": encoding.type,
        "value_type": encoding.value_type,
        "word_order": encoding.word_order if encoding.words > 1 else None,
        "active": "low" if encoding.active_low else "high",
        "scale": number(encoding.scale),
        "exact": str(encoding.scale),
        "offset": number(encoding.offset),
        "times": encoding.times,
        "unit": encoding.symbol,
        "values": {str(raw): name for raw, name in encoding.values.items()},
        "patterns": {
            _pattern(mask, bits, encoding.width or 16): name for mask, bits, name in encoding.patterns
        },
        "special": {str(raw): name for raw, name in encoding.special.items()},
    }


def _writing(point: Point) -> dict[str, Any]:
    return {
        "access": point.access,
        "role": point.role,
        "by_command_only": point.by_command_only,
        "only_when": in_words(point.only_when),
        "pulse": point.pulse,
        "pause": point.pause,
        "silent": point.silent,
        "then": point.then,
        "twin": point.twin,
        "wear": point.wear,
        "danger": _spans(point.danger),
        "step": None if point.pace.step is None else number(point.pace.step),
        "slew": None if point.pace.slew is None else number(point.pace.slew),
        "interval": point.pace.interval,
    }


def word_object(word: Word) -> dict[str, Any]:
    """A register that is cut into fields, and what every write lays over it."""
    return {
        "register": hexadecimal(word.address),
        "shift": word.shift,
        "image": word.image,
        "always_mask": hexadecimal(word.always_mask),
        "always_bits": hexadecimal(word.always_bits),
        "fields": list(word.fields),
    }


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


def in_words(condition: Condition) -> list[str]:
    """A condition, one line each: ``running: false``."""
    return [term.text for term in condition]


def range_object(limits: Limits | None) -> list[int | float | str] | None:
    """Both ends: numbers, or names of settings or points."""
    return [_bound(limits.low), _bound(limits.high)] if limits else None


def bits_of(encoding: Encoding) -> list[int] | None:
    """First and last bit of a field; None when the whole register is meant."""
    return [encoding.bit, encoding.bit + encoding.width - 1] if encoding.width else None


def hexadecimal(value: int) -> str:
    """A register or word as documents print it: ``0024H``."""
    return f"{value:04X}H"


def provenance_object(provenance: Provenance) -> dict[str, Any]:
    """Document and place, and how far they may be believed."""
    source = f"{provenance.document} {provenance.place}".strip()
    return {"source": source, "similar_model": provenance.similar, "doubt": provenance.doubt}


def _bound(value: Fraction | str) -> int | float | str:
    return value if isinstance(value, str) else number(value)


def _pattern(mask: int, bits: int, width: int) -> str:
    """Mask and bits as a profile spells them: ``x01x0111B``."""
    digits = ("x" if not mask >> at & 1 else str(bits >> at & 1) for at in reversed(range(width)))
    return "".join(digits).removeprefix("x" * max(0, width - max(mask.bit_length(), 1))) + "B"


def _spans(danger: Mapping[int, str]) -> dict[str, str]:
    """Neighbouring raw values that do the same harm as one span: ``1..65535``."""
    spans: list[tuple[int, int, str]] = []
    for raw, text in sorted(danger.items()):
        if spans and spans[-1][1] == raw - 1 and spans[-1][2] == text:
            spans[-1] = (spans[-1][0], raw, text)
        else:
            spans.append((raw, raw, text))
    return {str(low) if low == high else f"{low}..{high}": text for low, high, text in spans}


def doubtful(points: Iterable[Point]) -> int:
    """How many points are in doubt or known of a similar model only."""
    return sum(point.provenance.doubt is not None or point.provenance.similar for point in points)
