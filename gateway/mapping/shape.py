"""Checks a tree of texts against a model, and says what is wrong where.

Pydantic does the checking; this turns its errors into findings with places, nearest spellings and
remedies. Entries whose form is wrong are cut out and the rest is checked on, so that one pass tells all.
"""

from __future__ import annotations

import difflib
from typing import Any, ClassVar, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    GetJsonSchemaHandler,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, ErrorDetails

from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.node import Path

TABLES = (
    "points",
    "bits",
    "commands",
    "settings",
    "errors",
    "addresses",
    "groups",
    "values",
    "documents",
    "drives",
    "lines",
    "mqtt",
)
"""Keys whose value is a table (or list) of entries that can be left out one by one."""

_SEEN = "seen"
_ROUNDS = 20


class Shape(BaseModel):
    """Base of all models of mapping files: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)

    @model_validator(mode="before")
    @classmethod
    def _note(cls, data: Any, info: ValidationInfo) -> Any:
        """Remember which model a table was checked against, for spelling its keys."""
        data = cls.written_out(data)
        if isinstance(info.context, dict):
            info.context[_SEEN][id(data)] = (cls, data)
        return data

    @classmethod
    def written_out(cls, data: Any) -> Any:
        """The table that ``data`` stands for; `Entry` applies the bare scalar rule here."""
        if not isinstance(data, dict):
            raise FormError("a table of `key: value` is expected here", "write keys below or in {}")
        return data

    @classmethod
    def key_names(cls) -> list[str]:
        """The keys as they are written in a file."""
        return [info.alias or name for name, info in cls.model_fields.items()]


class Entry(Shape):
    """A table that may be written as a bare scalar, which then is its first key."""

    first: ClassVar[str]
    lists: ClassVar[bool] = False
    """True when the first key may also be a list."""

    @classmethod
    def written_out(cls, data: Any) -> Any:
        """A bare scalar as ``{first key: scalar}``."""
        bare = isinstance(data, str) or (cls.lists and isinstance(data, list))
        return {cls.first: data} if bare else super().written_out(data)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        table = handler.resolve_ref_schema(handler(core))
        bare = table.get("properties", {}).get(cls.first, {})
        return {"anyOf": [{k: v for k, v in bare.items() if k not in ("title", "default")}, table]}


M = TypeVar("M", bound=Shape)


def validate(model: type[M], report: Report) -> M | None:
    """The model of the report's file; None when its form is too broken to look further.

    The model lacks the entries whose form is wrong; `Report.partial` then tells so.
    """
    data: Any = report.root.plain()
    for _ in range(_ROUNDS):
        seen: dict[int, tuple[type[Shape], Any]] = {}
        try:
            return model.model_validate(data, context={_SEEN: seen})
        except ValidationError as error:
            report.partial = True
            found = error.errors(include_url=False)
        for detail in found:
            _tell(detail, data, seen, report)
        cuts = [_cut(detail) for detail in found]
        if any(cut is None for cut in cuts):
            return None
        for cut in cuts:
            _remove(data, cut or ())
    return None


def _place(detail: ErrorDetails) -> Path:
    """Path of an error in the file: without pydantic's own marks for keys and unions."""
    return tuple(part for part in detail["loc"] if not str(part).startswith(("[", "|")))


def _tell(detail: ErrorDetails, data: Any, seen: dict[int, tuple[type[Shape], Any]], report: Report) -> None:
    """Turn one error of pydantic into a finding."""
    path = _place(detail)
    error = detail.get("ctx", {}).get("error")
    if isinstance(error, FormError):
        report.error(path, error.message, error.remedy)
    elif detail["type"] == "missing":
        if not _has_key(report, path):
            report.error(path[:-1], f"`{path[-1]}` is missing", "add it", key=True)
    elif detail["type"] == "extra_forbidden":
        model = seen.get(id(_at(data, path[:-1])), (Shape, None))[0]
        report.error(path, f"unknown key `{path[-1]}`", nearest(str(path[-1]), model.key_names()), key=True)
    elif detail["type"] != "too_short" or _length(report, path) == detail["ctx"]["actual_length"]:
        report.error(path, *_words(detail))


def _length(report: Report, path: Path) -> int:
    """How many values a list or table has in the file, before anything was cut out."""
    node = report.root
    for part in path:
        node = node.child(part) or node
    return max(len(node.value), len(node.keys))


def _has_key(report: Report, path: Path) -> bool:
    """True when the key stands in the file (and its empty value was complained about)."""
    node = report.root
    for part in path[:-1]:
        node = node.child(part) or node
    return str(path[-1]) in node.keys


def _words(detail: ErrorDetails) -> tuple[str, str]:
    """Message and remedy of an error that is pydantic's own."""
    if detail["type"] in ("literal_error", "enum") and isinstance(detail["input"], str):
        return f"`{detail['input']}` is not known here", f"use {detail['ctx']['expected']}".replace("'", "`")
    if detail["type"] == "list_type":
        return "a list is expected here", "write it like [a, b]"
    if detail["type"] == "dict_type":
        return "a table of `name: value` is expected here", "write names below or in {}"
    if detail["type"] in ("literal_error", "enum"):
        return "one word is expected here", f"use {detail['ctx']['expected']}".replace("'", "`")
    if detail["type"] in ("too_short", "too_long"):
        context = detail["ctx"]
        bound = f"at least {context['min_length']}" if "min_length" in context else f"{context['max_length']}"
        return f"the number of values here is {context['actual_length']}", f"write {bound}"
    return detail["msg"].lower(), "see docs/mapping.md for what may stand here"


def nearest(word: str, known: list[str]) -> str:
    """A remedy that names the known word that is spelled most like ``word``."""
    match = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    if match:
        return f"did you mean `{match[0]}`?"
    return f"known are {', '.join(known)}" if known else "there are none"


def _at(data: Any, path: Path) -> Any:
    for part in path:
        if isinstance(data, dict):
            data = data.get(part)
        elif isinstance(data, list) and isinstance(part, int):
            data = data[part]
    return data


def _cut(detail: ErrorDetails) -> Path | None:
    """What to leave out so that the rest can be checked: the entry that holds the error, else the
    unknown key, else nothing can."""
    path = _place(detail)
    ends = [index + 2 for index, part in enumerate(path[:-1]) if part in TABLES]
    if ends:
        return path[: ends[-1]]
    return path if detail["type"] == "extra_forbidden" else None


def _remove(data: Any, path: Path) -> None:
    holder = _at(data, path[:-1])
    if isinstance(holder, dict):
        holder.pop(path[-1], None)
