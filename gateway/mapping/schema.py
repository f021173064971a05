"""JSON Schemas of the mapping files, for editors. Made from the models, so they cannot drift from them."""

from __future__ import annotations

from typing import Any, Literal

from gateway.mapping.model import RawProfile
from gateway.mapping.sitefile import RawSite

_MODELS: dict[str, type[RawProfile | RawSite]] = {"profile": RawProfile, "site": RawSite}


def schema(kind: Literal["profile", "site"]) -> dict[str, Any]:
    """The JSON Schema of a profile or site file."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **_MODELS[kind].model_json_schema(by_alias=True),
        "title": f"gateway {kind}",
    }
