"""Points of profiles as plain data for programs, and what else of a profile looks alike everywhere."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from gateway.mapping.profile import Condition, Encoding, Limits, NameFact, Point, Provenance
from gateway.terminal.facts import number


def point_object(point: Point) -> dict[str, Any]:
    """A point: where it is, what it means, how it may be written, and how far that may be believed."""
    return {
        "name": point.name,
        "group": point.group,
        "kind": point.kind,
        **_place(point),
        **encoding_object(point.encoding),
        "names": names_object(point.names),
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
        "counts": list(encoding.counts) if encoding.counts else None,
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
        "sets": point.sets,
    }


def names_object(names: Mapping[int, NameFact]) -> dict[str, dict[str, Any]]:
    """Raw value to its name, a sentence about it, and where it comes from."""
    return {
        str(raw): {"name": fact.name, "help": fact.help, **provenance_object(fact.provenance)}
        for raw, fact in names.items()
    }


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
