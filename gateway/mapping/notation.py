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
from gateway.mapping.shape import closest

_SECTION = "addresses"
_HEX = re.compile(r"[0-9A-F]{1,4}H")
_LONG_HEX = re.compile(r"[0-9A-F]{5,}H")
_ALMOST_HEX = re.compile(r"(?:0[xX]|[hH])([0-9A-Fa-f]{1,4})|([0-9A-Fa-f]{1,4})[hH]", re.ASCII)
"""Ways in which others write hexadecimal."""
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


class UnknownNotationError(FormError):
    """An address in a notation that is wrong itself, which is complained about where it stands."""


class Notations:
    """All notations of a profile."""

    def __init__(self, raw: Addresses, report: Report) -> None:
        self._rules: list[_Rule] = []
        self._wrong = list(report.lost.keys_of(_SECTION))
        for pattern, notation in (raw.__pydantic_extra__ or {}).items():
            self._declare(pattern, notation, report)

    def find(self, text: str) -> Place:
        """The place that an address text means.

        Raises `FormError` when nothing matches, when two notations do, and outside 0 to FFFFH.
        """
        matches = [(rule.table, at) for rule in self._rules if (at := rule.apply(text)) is not None]
        if _HEX.fullmatch(text):
            matches.insert(0, (Table.HOLDING, int(text[:-1], 16)))
        if not matches and any(_regex(pattern).fullmatch(text) for pattern in self._wrong):
            raise UnknownNotationError(f"`{text}` cannot be computed", "correct the notation")
        if not matches and _LONG_HEX.fullmatch(text):
            raise FormError(f"the address `{text}` is too big", "an address is 0000H to FFFFH")
        if not matches:
            raise FormError(f"`{text}` is not an address", self._remedy(text))
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

    def _remedy(self, text: str) -> str:
        """The spelling that is meant, or all that there are."""
        digits = _ALMOST_HEX.fullmatch(text)
        if digits:
            return f"did you mean `{(digits[1] or digits[2]).upper():>04}H`?"
        numbers = re.findall(r"\d+", text)
        patterns = [*(rule.pattern for rule in self._rules), *self._wrong]
        alike = [_PART.sub("<n>", each) for each in patterns if len(_PART.findall(each)) == len(numbers)]
        meant = closest(re.sub(r"\d+", "<n>", text), alike)
        if meant and any(character.isalpha() for character in text):
            return f"did you mean `{re.sub('<n>', lambda _: numbers.pop(0), meant)}`?"
        return f"write it as one of {', '.join(['0107H', *patterns])}"

    def _declare(self, pattern: str, notation: Notation, report: Report) -> None:
        path = (_SECTION, pattern)
        parts = _PART.findall(pattern)
        weights = notation.weights
        if not parts or set(parts) != set(weights) or len(set(parts)) != len(parts):
            report.error(
                path,
                f"the parts of `{pattern}` and its weights differ",
                "give each <part> one weight",
                key=True,
            )
        if report.wrong(path):
            self._wrong.append(pattern)
            return
        values = tuple(weights[part] for part in parts)
        rule = _Rule(pattern, _regex(pattern), values, notation.add, Table(notation.table))
        self._rules.append(rule)
        _prove(rule, notation.example, path, report)


def _regex(pattern: str) -> re.Pattern[str]:
    """What fits a notation, with a group for each of its parts."""
    return re.compile(r"(\d+)".join(re.escape(piece) for piece in _PART.split(pattern)[::2]), re.ASCII)


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
