"""JSON Schemas of the mapping files, for editors. Made from the models, so they cannot drift from them."""

from __future__ import annotations

from typing import Any, Literal

from gateway.mapping.model import RawProfile
from gateway.mapping.reference import meaning, models
from gateway.mapping.shape import Shape
from gateway.mapping.sitefile import RawSite

_MODELS: dict[str, type[RawProfile | RawSite]] = {"profile": RawProfile, "site": RawSite}


def schema(kind: Literal["profile", "site"]) -> dict[str, Any]:
    """The JSON Schema of a profile or site file; every key carries its meaning."""
    root = _MODELS[kind]
    whole = root.model_json_schema(by_alias=True)
    for name, definition in {root.__name__: whole, **whole.get("$defs", {})}.items():
        if (model := _model(name, root)) is not None:
            _describe(definition, model)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **whole,
        "title": f"gateway {kind}",
    }


def _model(name: str, root: type[Shape]) -> type[Shape] | None:
    """The model of a definition. Those of plain facts differ in type only, and `Fact` explains them all."""
    plain = name.partition("_")[0]
    return next((model for model in models(root) if model.__name__.partition("[")[0] == plain), None)


def _describe(definition: dict[str, Any], model: type[Shape]) -> None:
    """Write the meaning of every key into a model's table, which may stand beside a bare scalar."""
    for table in (definition, *definition.get("anyOf", ())):
        for key, value in table.get("properties", {}).items():
            told = meaning(model, key)
            value["description"] = f"{told.text} (like {told.example})" if told.example else told.text
