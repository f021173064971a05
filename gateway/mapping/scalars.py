"""The types of the models' scalars: each reads a small form and tells editors its JSON Schema.

The loader sees every scalar as the text in the file; editors see YAML's own types, so a number may
stand as integer, number or text in the schema.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Annotated, Any

from pydantic import PlainValidator, ValidationInfo, WithJsonSchema

from gateway.mapping import forms
from gateway.mapping.forms import FormError, Range, Unit
from gateway.mapping.profile import SerialFormat

NUMBER_SCHEMA: dict[str, Any] = {"type": ["integer", "number", "string"]}
WHOLE_SCHEMA: dict[str, Any] = {"type": ["integer", "string"]}
ANY_SCHEMA: dict[str, Any] = {"type": ["boolean", "integer", "number", "string"]}


def text_form(read: Callable[[str], Any]) -> PlainValidator:
    """A validator that applies a small form to a text and refuses lists and tables."""

    def validate(value: object) -> Any:
        if not isinstance(value, str):
            kind = "a list" if isinstance(value, list) else "a table"
            raise FormError(f"{kind} stands where one value is expected", "write a single value")
        return read(value)

    return PlainValidator(validate)


def _plain(text: str) -> str:
    if not text.strip():
        raise FormError("the text is empty", "write something, or leave the key out")
    return text


def _refuse(value: object, info: ValidationInfo) -> Any:
    raise FormError(f"`{info.field_name}` is not supported by this version", "leave it out")


def _misplace(value: object, info: ValidationInfo) -> Any:
    raise FormError(f"`{info.field_name}` belongs to a field of `bits`", "move it there")


def _count(text: str) -> int:
    value = forms.integer(text)
    if value < 1:
        raise FormError(f"`{text}` is less than 1", "write 1 or more")
    return value


def _unsigned(text: str) -> int:
    value = forms.integer(text)
    if not 0 <= value <= 0xFF:
        raise FormError(f"`{text}` does not fit one byte", "write 00H to FFH")
    return value


def _wear(text: str) -> int | str:
    return text if text in ("unknown", "none") else _count(text)


Text = Annotated[str, text_form(_plain), WithJsonSchema(ANY_SCHEMA)]
Name = Annotated[str, text_form(forms.name), WithJsonSchema({"type": "string"})]
Number = Annotated[Fraction, text_form(forms.number), WithJsonSchema(NUMBER_SCHEMA)]
Integer = Annotated[int, text_form(forms.integer), WithJsonSchema(WHOLE_SCHEMA)]
Count = Annotated[int, text_form(_count), WithJsonSchema(WHOLE_SCHEMA)]
Byte = Annotated[int, text_form(_unsigned), WithJsonSchema(WHOLE_SCHEMA)]
Truth = Annotated[bool, text_form(forms.truth), WithJsonSchema({"type": "boolean"})]
Span = Annotated[Range, text_form(forms.span), WithJsonSchema({"type": "string"})]
WholeSpan = Annotated[tuple[int, int], text_form(forms.integers_span), WithJsonSchema(WHOLE_SCHEMA)]
UnitOf = Annotated[Unit, text_form(forms.unit), WithJsonSchema({"type": "string"})]
Duration = Annotated[float, text_form(forms.duration), WithJsonSchema({"type": "string"})]
TimeOrName = Annotated[float | str, text_form(forms.time_or_name), WithJsonSchema({"type": "string"})]
Durations = Annotated[tuple[float, float], text_form(forms.durations), WithJsonSchema({"type": "string"})]
Bits = Annotated[tuple[int, int], text_form(forms.bits), WithJsonSchema(WHOLE_SCHEMA)]
Address = Annotated[str, text_form(_plain), WithJsonSchema(NUMBER_SCHEMA)]
Format = Annotated[SerialFormat, text_form(forms.serial_format), WithJsonSchema({"type": "string"})]
Wear = Annotated[int | str, text_form(_wear), WithJsonSchema(WHOLE_SCHEMA)]
Later = Annotated[
    None, PlainValidator(_refuse), WithJsonSchema({"not": {}, "description": "not supported yet"})
]
"""A key of the language that this version does not act on: refused by name."""
Misplaced = Annotated[None, PlainValidator(_misplace), WithJsonSchema({"not": {}})]
"""A key that stands one level too high."""
