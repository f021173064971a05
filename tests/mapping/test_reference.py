"""The reference of the mapping language: complete, and as the models are."""

from __future__ import annotations

import re
from typing import Any, Literal

import pytest

from gateway.mapping.meanings import PROFILE
from gateway.mapping.model import RawProfile
from gateway.mapping.reference import meaning, models, reference
from gateway.mapping.schema import schema
from gateway.mapping.shape import Shape
from gateway.mapping.sitefile import RawSite
from gateway.mapping.sitemeanings import SITE
from tests.mapping.texts import ROOT

PAGE = ROOT / "docs" / "mapping-reference.md"
MADE = reference()
ALL = [*models(RawProfile), *models(RawSite)]


def keys(model: type[Shape]) -> list[str]:
    return [field.alias or name for name, field in model.model_fields.items()]


def test_the_committed_page_is_the_generated_one() -> None:
    assert PAGE.read_text(encoding="utf-8") == reference(), (
        "run: python -m gateway.mapping.reference > docs/mapping-reference.md"
    )


def test_every_key_is_explained_and_nothing_else() -> None:
    declared = {base.__name__.partition("[")[0] for model in ALL for base in model.__mro__}
    used = {(model, key) for model in ALL for key in keys(model) if meaning(model, key).text}
    assert len(used) > 200
    for name, table in (*PROFILE.items(), *SITE.items()):
        assert name in declared, name
        known = {key for model in ALL for key in keys(model) if _is(model, name)}
        assert set(table) <= known, name


def _is(model: type[Shape], name: str) -> bool:
    return any(base.__name__.partition("[")[0] == name for base in model.__mro__)


def test_every_link_leads_to_a_section() -> None:
    text = MADE
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    anchors = {title.lower().replace(" ", "-") for title in titles}
    links = re.findall(r"\]\(#([^)]+)\)", text)
    assert len(links) > 50
    assert set(links) <= anchors


@pytest.mark.parametrize(
    "row",
    [
        "| `at` | address of the (first) register | address | required | `0024H, Cn-02` |",
        "| `within` | how long to wait for that | time | 1s | `2s` |",
        "| `lease` | `session`: the first command takes the lease; `required`: it must be taken first; "
        "`off`: none | `session`, `required`, `off` | session | `required` |",
        "| `only_when` | refused otherwise | names to text or list of text | always allowed "
        "| `{run_source: line}` |",
    ],
)
def test_a_row(row: str) -> None:
    assert row in MADE.splitlines()


@pytest.mark.parametrize("kind", ["profile", "site"])
def test_every_key_in_the_schema_has_a_description(kind: Literal["profile", "site"]) -> None:
    bare = []
    whole = schema(kind)
    for name, definition in {kind: whole, **whole["$defs"]}.items():
        tables: list[dict[str, Any]] = [definition, *definition.get("anyOf", ())]
        properties = {key: value for table in tables for key, value in table.get("properties", {}).items()}
        bare += [f"{name}.{key}" for key, value in properties.items() if not value.get("description")]
    assert bare == []
