"""The reference of the mapping language, made from its models: ``python -m gateway.mapping.reference``.

Form, default and place of every key come from the models, meaning and example from `meanings`.
"""

from __future__ import annotations

import functools
import sys
import typing
from collections.abc import Iterator
from enum import Enum
from types import NoneType
from typing import Annotated, Any, Literal

from pydantic.fields import FieldInfo

from gateway.mapping import scalars, simulate, sitefile
from gateway.mapping.meanings import PROFILE, Meaning
from gateway.mapping.model import Fact, Notation, RawProfile, Sourced, Traits
from gateway.mapping.shape import Entry, Shape
from gateway.mapping.sitefile import RawSite
from gateway.mapping.sitemeanings import SITE

HEAD = """\
# Mapping reference

Every key of profiles and site files. Made from the models by `python -m gateway.mapping.reference`: do not
edit this file. The language is explained in [mapping.md](mapping.md); [tutorial.md](tutorial.md) builds up a
drive step by step.

In an editor with a YAML language server, write the schemas to files and name them in the first line of yours:

```sh
gateway schema profile > profile.schema.json
gateway schema site > site.schema.json
```

```yaml
# yaml-language-server: $schema=./profile.schema.json
```
"""
_COMMON: tuple[type[Shape], ...] = (Sourced, Traits)
_WORDS: tuple[tuple[Any, str], ...] = (
    (scalars.Text, "text"),
    (scalars.Name, "name"),
    (scalars.Number, "number"),
    (scalars.Integer, "whole number"),
    (scalars.Count, "count"),
    (scalars.Byte, "byte"),
    (scalars.Truth, "`true`, `false`"),
    (scalars.Span, "range"),
    (scalars.WholeSpan, "range of whole numbers"),
    (scalars.UnitOf, "unit"),
    (scalars.Duration, "time"),
    (scalars.Durations, "two times"),
    (scalars.Bits, "bit position"),
    (scalars.Address, "address"),
    (scalars.Format, "format"),
    (scalars.Wear, "count, `unknown` or `none`"),
    (scalars.Later, "not supported"),
    (scalars.Misplaced, "not here"),
    (simulate.Texts, "text or list of text"),
    (sitefile.Label, "label"),
    (sitefile.Speed, "speed and format"),
    (sitefile.Port, "port"),
    (sitefile.OnExpiry, "action"),
)
"""The small forms, as docs/mapping.md calls them."""


def reference() -> str:
    """The whole page."""
    parts = [HEAD, "## Profile\n", *map(_section, _models(RawProfile)), "## Site file\n"]
    return "\n".join([*parts, *map(_section, _models(RawSite))])


def meaning(model: type[Shape], key: str) -> Meaning:
    """What a key of a model means. Raises KeyError for a key that nobody explained."""
    for declared in model.__mro__:
        for table in (PROFILE, SITE):
            if key in (known := table.get(_base(declared.__name__), {})):
                return known[key]
    raise KeyError(f"{model.__name__}.{key}")


def title(model: type[Shape]) -> str:
    """How a model is called in the reference: ``RawProfile`` is ``Profile``, ``Fact[...]`` a ``Fact``."""
    name = _base(model.__name__).removeprefix("Raw")
    return "".join(f" {c.lower()}" if c.isupper() and i else c for i, c in enumerate(name))


@functools.cache
def models(model: type[Shape]) -> tuple[type[Shape], ...]:
    """A model and all that its keys lead to, each once, in the order of the keys."""
    found: dict[type[Shape], None] = {}
    _collect(model, found)
    return tuple(found)


def _models(root: type[Shape]) -> list[type[Shape]]:
    """The models that get a section: plain facts share one, inherited keys have their own."""
    all_models = models(root)
    common = [shared for shared in _COMMON if any(issubclass(model, shared) for model in all_models)]
    facts = [Fact] if any(_base(model.__name__) == "Fact" for model in all_models) else []
    plain = [m for m in all_models if _base(m.__name__) != "Fact" and (_own_keys(m) or m is root)]
    return [plain[0], *common, *facts, *plain[1:]]


def _collect(hint: Any, found: dict[type[Shape], None]) -> None:
    if isinstance(hint, type) and issubclass(hint, Shape):
        if hint not in found:
            found[hint] = None
            for part in (*(field.annotation for field in hint.model_fields.values()), _extra(hint)):
                _collect(part, found)
        return
    for part in typing.get_args(hint):
        _collect(part, found)


def _extra(model: type[Shape]) -> Any:
    """What stands under the names that a model leaves open; None when it leaves none open."""
    return typing.get_type_hints(model, include_extras=True).get("__pydantic_extra__")


def _own_keys(model: type[Shape]) -> list[str]:
    """The keys that a model declares beside those that many share, by their names in Python."""
    shared = {
        name
        for common in _COMMON
        if common is not model and issubclass(model, common)
        for name in common.model_fields
    }
    return [name for name in model.model_fields if name not in shared]


def _section(model: type[Shape]) -> str:
    lines = [f"### {title(model)}", "", *_about(model), ""]
    rows = [_row(model, name) for name in _own_keys(model)]
    if rows:
        lines += ["| key | meaning | form | default | example |", "|---|---|---|---|---|", *rows, ""]
    return "\n".join(lines)


def _about(model: type[Shape]) -> Iterator[str]:
    yield " ".join((model.__doc__ or "").split())
    if issubclass(model, Entry):
        yield f"A single value stands for its key `{model.first}`."
    if model is Notation:
        yield "Every other key is a part of the pattern, and its value what that part counts."
    also = [title(common) for common in _COMMON if common is not model and issubclass(model, common)]
    if also:
        yield f"Also: the keys of {' and '.join(f'[{name}](#{_anchor(name)})' for name in also)}."


def _row(model: type[Shape], name: str) -> str:
    field = model.model_fields[name]
    key = field.alias or name
    told = meaning(model, key)
    hint = typing.get_type_hints(model, include_extras=True)[name]
    example = f"`{told.example}`" if told.example else ""
    default = told.default or _default(field)
    cells = (f"`{key}`", told.text, form(hint), f"`{default}`" if "<" in default else default, example)
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.default
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}s"
    if isinstance(value, list):
        return f"[{', '.join(value)}]"
    return str(value) if isinstance(value, (int, str)) else ""


def form(hint: Any) -> str:
    """How a value of this type is written, in the words of docs/mapping.md."""
    for known, words in _WORDS:
        if hint == known:
            return words
    origin, args = typing.get_origin(hint), typing.get_args(hint)
    if not args:
        return _plain_form(hint)
    if origin is Literal:
        return ", ".join(f"`{value}`" for value in args)
    if origin is dict:
        return f"{'names' if args[0] is str else form(args[0])} to {form(args[1])}"
    if origin in (list, Annotated):
        return f"{'list of ' if origin is list else ''}{form(args[0])}"
    return " or ".join(form(part) for part in args if part is not NoneType)


def _plain_form(hint: Any) -> str:
    if isinstance(hint, type) and issubclass(hint, Enum):
        return ", ".join(f"`{value.value}`" for value in hint)
    if isinstance(hint, type) and issubclass(hint, Shape):
        return _shape_form(hint)
    if hint is NoneType:
        return "refused"
    return "any" if isinstance(hint, typing.TypeVar) else "text"


def _shape_form(model: type[Shape]) -> str:
    """A link to the section of a model; what is in it, if it has no section of its own."""
    facts = model.__pydantic_generic_metadata__["args"]
    if facts:
        return form(facts[0])
    if _own_keys(model) or _extra(model) is None:
        return f"[{title(model).lower()}](#{_anchor(title(model))})"
    return form(_extra(model))


def _base(name: str) -> str:
    return name.partition("[")[0]


def _anchor(name: str) -> str:
    return name.lower().replace(" ", "-")


if __name__ == "__main__":
    sys.stdout.write(reference())
