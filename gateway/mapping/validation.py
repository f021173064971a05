"""Checks a tree of texts against a model, and says what is wrong where.

Pydantic does the checking; this turns its errors into findings with places, nearest spellings and
remedies. A key whose form is wrong is left out, or stands for as little as it can where it must be there, and
the rest is checked on, so that one pass tells all.
"""

from __future__ import annotations

import copy
import re
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.node import Node, Path
from gateway.mapping.shape import ELSEWHERE, SEEN, TRIMMED, Shape, closest, nearest

_ROUNDS = 20
_SURE = 0.7
"""So alike must a word be to one of a few; else all of them are listed."""

M = TypeVar("M", bound=Shape)


def validate(model: type[M], report: Report) -> M | None:
    """The model of the report's file; None when its form is too broken to look further.

    The model lacks what has a wrong form; `Report.lost` tells what that is.
    """
    data: Any = report.root.plain()
    for path in report.lost.paths:
        _take_out(data, path)
    adopted: set[Path] = set()
    for _ in range(_ROUNDS):
        seen: dict[int, tuple[type[Shape], Any]] = {}
        try:
            return model.model_validate(data, context={SEEN: seen, TRIMMED: bool(report.lost)})
        except ValidationError as error:
            found = error.errors(include_url=False)
        wrongs = [_wrong(detail, data, seen) for detail in found]
        for wrong in wrongs:
            if wrong.path not in adopted:
                _tell(wrong, wrongs, report)
        renamed = [wrong for wrong in wrongs if _adopt(wrong, data, report.root)]
        fresh = {wrong.meant_path for wrong in renamed}
        rest = [wrong for wrong in wrongs if wrong not in renamed and wrong.path not in fresh]
        left = [_leave_out(wrong, data, report) for wrong in rest]
        adopted |= fresh
        if not all(left):
            return None
    return None


@dataclass(frozen=True, slots=True)
class _Wrong:
    """One error of pydantic: where, and the model of the table that it stands in."""

    detail: ErrorDetails
    path: Path
    model: type[Shape]

    @property
    def missing(self) -> bool:
        return self.detail["type"] == "missing"

    @property
    def unknown(self) -> bool:
        return self.detail["type"] == "extra_forbidden"

    @property
    def meant(self) -> str | None:
        """The key that an unknown one probably is."""
        return (self.foreign or closest(self.key, self.model.key_names())) if self.unknown else None

    @property
    def foreign(self) -> str | None:
        """The key that says here what an unknown one says elsewhere."""
        alike = closest(self.key, self.model.key_names(), _SURE)
        known = (word for word in ELSEWHERE.get(self.key.lower(), ()) if word in self.model.key_names())
        return next(known, None) if alike is None else None

    @property
    def key(self) -> str:
        """The key itself."""
        return str(self.path[-1])

    @property
    def meant_path(self) -> Path:
        """Where that key would stand."""
        return (*self.path[:-1], self.meant or "")


def _wrong(detail: ErrorDetails, data: Any, seen: dict[int, tuple[type[Shape], Any]]) -> _Wrong:
    """An error with its place, which is without pydantic's own marks for keys and unions."""
    path: Path = tuple(part for part in detail["loc"] if not str(part).startswith(("[", "|")))
    return _Wrong(detail, path, seen.get(id(_at(data, path[:-1])), (Shape, None))[0])


def _tell(wrong: _Wrong, others: list[_Wrong], report: Report) -> None:
    """Turn one error into a finding. A key that is missing because it is misspelled is told once."""
    path, error = wrong.path, wrong.detail.get("ctx", {}).get("error")
    if isinstance(error, FormError):
        report.error(path, error.message, error.remedy)
    elif wrong.unknown:
        report.error(path, f"unknown key `{path[-1]}`", _key_meant(wrong), key=True)
    elif not wrong.missing:
        report.error(path, *_words(wrong.detail))
    elif not report.lost.covers(path) and not any(
        other.path[:-1] == path[:-1] and other.meant == path[-1] for other in others
    ):
        report.error(path[:-1], f"`{path[-1]}` is missing", "add it", key=True)


def _key_meant(wrong: _Wrong) -> str:
    """The key that is spelled like an unknown one, or that means the same elsewhere."""
    if wrong.foreign is not None:
        return f"here that is `{wrong.foreign}`"
    return nearest(wrong.key, wrong.model.key_names(), "docs/mapping-reference.md has all keys")


def _words(detail: ErrorDetails) -> tuple[str, str]:
    """Message and remedy of an error that is pydantic's own."""
    given = detail["input"]
    if detail["type"] in ("literal_error", "enum"):
        expected = detail["ctx"]["expected"].replace("'", "`")
        if not isinstance(given, str):
            return "one word is expected here", f"use {expected}"
        match = closest(given, re.findall("`([^`]+)`", expected), _SURE)
        return f"`{given}` is not known here", f"did you mean `{match}`?" if match else f"use {expected}"
    if detail["type"] == "list_type":
        return "a list is expected here", f"write it like [{given if isinstance(given, str) else 'a, b'}]"
    if detail["type"] == "dict_type":
        return "a table of `name: value` is expected here", "write names below or in {}"
    if detail["type"] in ("too_short", "too_long"):
        context = detail["ctx"]
        bound = f"at least {context['min_length']}" if "min_length" in context else f"{context['max_length']}"
        return f"the number of values here is {context['actual_length']}", f"write {bound}"
    return detail["msg"].lower(), "see docs/mapping.md for what may stand here"


def _adopt(wrong: _Wrong, data: Any, root: Node) -> bool:
    """Take an unknown key for the one that it misspells, so that what stands below is checked as well."""
    if not wrong.unknown:
        return False
    holder, node, key = _at(data, wrong.path[:-1]), root.at(wrong.path[:-1]), wrong.key
    meant = wrong.foreign or closest(key, wrong.model.key_names(), _SURE)
    if meant is None or node is None or not isinstance(node.value, dict) or meant in node.keys:
        return False
    holder[meant] = holder.pop(key)
    node.keys[meant], node.value[meant] = node.keys[key], node.value[key]
    return True


def _leave_out(wrong: _Wrong, data: Any, report: Report) -> bool:
    """Take what is wrong out of the data; False when nothing would be left. What must be there stands for
    as little as it can, and where it cannot, the table that it is missing from goes too."""
    path = wrong.path
    if wrong.missing:
        report.lost.add(path)
        holder = _at(data, path[:-1])
        if path[-1] in wrong.model.least and isinstance(holder, dict):
            holder[path[-1]] = copy.deepcopy(wrong.model.least[str(path[-1])])
            return True
        path = path[:-1]
    gone = _take_out(data, path)
    if gone:
        report.lost.add(gone)
    return bool(gone)


def _take_out(data: Any, path: Path) -> Path:
    """Remove the value at ``path``, or the innermost value above it that has a key; empty: there is none."""
    for length in range(len(path), 0, -1):
        holder = _at(data, path[: length - 1])
        if isinstance(holder, dict):
            holder.pop(path[length - 1], None)
            return path[:length]
    return ()


def _at(data: Any, path: Path) -> Any:
    """What stands at ``path``; None where the data are not that deep."""
    for part in path:
        if isinstance(data, dict):
            data = data.get(part)
        elif isinstance(data, list) and isinstance(part, int) and part < len(data):
            data = data[part]
        else:
            return None
    return data
