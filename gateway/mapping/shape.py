"""The base of the models of mapping files: what a table is, and how its keys are spelled."""

from __future__ import annotations

import difflib
from typing import Any, ClassVar

from pydantic import (
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from gateway.mapping.forms import FormError

SEEN = "seen"
"""In the context of a validation: the model that each table was checked against."""
TRIMMED = "trimmed"
"""In the context of a validation: true when something was left out of the file."""
ELSEWHERE: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("address", "addr", "register", "reg"), ("at", "unit")),
    **dict.fromkeys(("scale", "factor", "multiplier", "gain", "units"), ("unit",)),
    **dict.fromkeys(("min", "max", "minimum", "maximum", "limits"), ("range", "ranges")),
    **dict.fromkeys(("enum", "enums", "map", "options", "choices"), ("values",)),
    **dict.fromkeys(("description", "desc", "comment", "label"), ("help",)),
    **dict.fromkeys(("slave", "slave_id", "station", "id", "node_id"), ("unit",)),
    **dict.fromkeys(("baud", "baudrate", "baud_rate", "speed", "parity", "stopbits"), ("serial",)),
    **dict.fromkeys(("device", "tty", "host", "path"), ("port",)),
    **dict.fromkeys(("poll", "period", "interval", "scan"), ("rate",)),
    **dict.fromkeys(("writable", "readonly", "rw", "mode"), ("access",)),
    **dict.fromkeys(("data_type", "datatype", "format"), ("type", "serial")),
}
"""Keys that other configurations have, and what says the same here."""
_MANY = 15
"""More known words than these are not listed."""


class Shape(BaseModel):
    """Base of all models of mapping files: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)
    least: ClassVar[dict[str, Any]] = {}
    """What stands for a key that must be there and is wrong, while the rest of the file is checked."""

    @model_validator(mode="before")
    @classmethod
    def _note(cls, data: Any, info: ValidationInfo) -> Any:
        """Remember which model a table was checked against, for spelling its keys."""
        data = cls.written_out(data)
        if isinstance(info.context, dict):
            info.context[SEEN][id(data)] = (cls, data)
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


class Filled:
    """Marks a list or table that must not be empty, unless something was left out of the file."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_after_validator_function(_filled, handler(source))

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        table = handler(core)
        return {**table, "minItems" if table.get("type") == "array" else "minProperties": 1}


def _filled(values: Any, info: core_schema.ValidationInfo) -> Any:
    if not values and not (info.context or {}).get(TRIMMED):
        raise FormError("nothing stands in it", "write at least one")
    return values


def nearest(word: str, known: list[str], else_: str = "correct it") -> str:
    """A remedy that names the known word that is spelled most like ``word``; ``else_`` where none is and
    there are too many to list."""
    match = closest(word, known)
    if match:
        return f"did you mean `{match}`?"
    if len(known) > _MANY:
        return else_
    return f"known are {', '.join(known)}" if known else "there are none"


def closest(word: str, known: list[str], alike: float = 0.6) -> str | None:
    """The known word that is spelled most like ``word``; None when none is, or less than ``alike`` (to 1)."""
    match = difflib.get_close_matches(word, known, n=1, cutoff=alike)
    return match[0] if match else None
