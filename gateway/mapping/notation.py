"""How the manual writes addresses, and what they are on the wire.

``0107H`` is a wire address. Anything else must match one of the notations that the profile declares:
a pattern with a ``<part>`` or several, each of which counts so much; the parts and a constant add up to
the wire address. Each notation is proved by an example out of the manual.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.model import Addresses, Notation
from gateway.mapping.node import Path
from gateway.mapping.profile import Table

_HEX = re.compile(r"[0-9A-F]{1,4}H")
_PART = re.compile(r"<([a-z]+)>")
_LAST = 0xFFFF


@dataclass(frozen=True, slots=True)
class Place:
    """A wire address, and how the manual writes it."""

    table: Table
    address: int
    text: str


@dataclass(frozen=True, slots=True)
class _Rule:
    """One declared notation."""

    pattern: str
    regex: re.Pattern[str]
    weights: tuple[int, ...]
    add: int
    table: Table

    def apply(self, text: str) -> int | None:
        """The wire address of ``text``; None when it does not match."""
        match = self.regex.fullmatch(text)
        if not match:
            return None
        return self.add + sum(w * int(part) for w, part in zip(self.weights, match.groups(), strict=True))


class Notations:
    """All notations of a profile."""

    def __init__(self, raw: Addresses, report: Report) -> None:
        self._rules: list[_Rule] = []
        for pattern, notation in (raw.__pydantic_extra__ or {}).items():
            self._declare(pattern, notation, report)

    def find(self, text: str) -> Place:
        """The place that an address text means.

        Raises `FormError` when nothing matches, when two notations do, and outside 0 to FFFFH.
        """
        matches = [(rule.table, at) for rule in self._rules if (at := rule.apply(text)) is not None]
        if _HEX.fullmatch(text):
            matches.insert(0, (Table.HOLDING, int(text[:-1], 16)))
        if not matches:
            raise FormError(f"`{text}` is not an address", self._remedy())
        if len(matches) > 1:
            raise FormError(f"the address `{text}` fits two notations", "make their patterns differ")
        table, address = matches[0]
        _inside(address, text)
        return Place(table, address, text)

    def shifted(self, place: Place, distance: int) -> Place:
        """The place ``distance`` registers behind another, written in the same manner."""
        address = place.address + distance
        _inside(address, f"{place.text} + {distance}")
        return Place(place.table, address, self._shifted_text(place, distance))

    def _shifted_text(self, place: Place, distance: int) -> str:
        for rule in self._rules:
            match = rule.regex.fullmatch(place.text)
            if match and rule.weights[-1] and distance % rule.weights[-1] == 0:
                last, start = match[match.re.groups], match.start(match.re.groups)
                number = int(last) + distance // rule.weights[-1]
                return place.text[:start] + f"{number:0{len(last)}d}" + place.text[start + len(last) :]
        return f"{place.address + distance:04X}H"

    def _remedy(self) -> str:
        forms = ", ".join(["0107H", *(rule.pattern for rule in self._rules)])
        return f"write it as one of {forms}"

    def _declare(self, pattern: str, notation: Notation, report: Report) -> None:
        path = ("addresses", pattern)
        parts = _PART.findall(pattern)
        weights = notation.weights
        if not parts or set(parts) != set(weights) or len(set(parts)) != len(parts):
            report.error(
                path,
                f"the parts of `{pattern}` and its weights differ",
                "give each <part> one weight",
                key=True,
            )
            return
        regex = re.compile(r"(\d+)".join(re.escape(piece) for piece in _PART.split(pattern)[::2]), re.ASCII)
        values = tuple(weights[part] for part in parts)
        rule = _Rule(pattern, regex, values, notation.add, Table(notation.table))
        self._rules.append(rule)
        _prove(rule, notation.example, path, report)


def _prove(rule: _Rule, example: str, path: Path, report: Report) -> None:
    """Compute the notation's example and compare."""
    text, equals, stated = (part.strip() for part in example.partition("="))
    computed = rule.apply(text)
    if not equals or computed is None or not _HEX.fullmatch(stated):
        report.error(
            (*path, "example"),
            f"`{example}` is no example of `{rule.pattern}`",
            "write one pair out of the manual, like Cn-42 = 0229H",
        )
    elif computed != int(stated[:-1], 16):
        report.error(
            (*path, "example"),
            f"the example gives {computed:04X}H, not {stated}",
            "correct the weights, `add` or the example",
        )


def _inside(address: int, text: str) -> None:
    if not 0 <= address <= _LAST:
        raise FormError(f"the address `{text}` is outside 0000H to FFFFH", "correct it")
