"""The JSON Schemas: the shipped files fit, wrong ones do not, and no key of the models is missing."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import jsonschema
import pytest
import yaml

from gateway.mapping import model, sections, sitefile
from gateway.mapping.schema import schema
from gateway.mapping.shape import Shape
from tests.mapping.texts import PLANT, ROOT, TECO

Kind = Literal["profile", "site"]


class Yaml12(yaml.SafeLoader):
    """Sees scalars as editors do (YAML 1.2): only true and false are truth values."""


Yaml12.yaml_implicit_resolvers = {
    first: [(tag, regexp) for tag, regexp in rules if tag.rpartition(":")[2] in ("int", "float", "null")]
    for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
Yaml12.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("^(true|false)$"), list("tf"))


def as_editors_see_it(path: Path) -> Any:
    return json.loads(json.dumps(yaml.load(path.read_text(encoding="utf-8"), Yaml12)))


def complaints(kind: Kind, data: Any) -> list[str]:
    validator = jsonschema.Draft202012Validator(schema(kind))
    return [f"{list(error.absolute_path)}: {error.message}" for error in validator.iter_errors(data)]


@pytest.mark.parametrize("kind", ["profile", "site"])
def test_it_is_a_schema(kind: Kind) -> None:
    jsonschema.Draft202012Validator.check_schema(schema(kind))


@pytest.mark.parametrize(("kind", "path"), [("profile", TECO), ("site", PLANT)], ids=["profile", "site"])
def test_the_shipped_files_fit(kind: Kind, path: Path) -> None:
    assert complaints(kind, as_editors_see_it(path)) == []


WRONG = """unknown_key unknown_section missing_section missing_at scalar_for_table empty_list
table_for_scalar outside_bits like_is_list"""


@pytest.mark.parametrize("name", WRONG.split())
def test_wrong_profiles_do_not_fit(name: str) -> None:
    path = ROOT / "tests" / "mapping" / "bad" / "profile" / f"{name}.yaml"
    assert complaints("profile", as_editors_see_it(path))


@pytest.mark.parametrize("name", ["unknown_keys", "missing", "password", "not_a_list", "control"])
def test_wrong_sites_do_not_fit(name: str) -> None:
    path = ROOT / "tests" / "mapping" / "bad" / "site" / f"{name}.yaml"
    assert complaints("site", as_editors_see_it(path))


def test_a_number_may_stand_as_number_or_text() -> None:
    data = as_editors_see_it(TECO)
    data["groups"]["monitor"]["points"]["output_current"]["at"] = 8501
    data["modbus"]["read_max"] = {"is": "10H", "source": "sim 8"}
    assert complaints("profile", data) == []


def shapes(*modules: ModuleType) -> list[type[Shape]]:
    """All models in these modules."""
    found = {value for module in modules for value in vars(module).values() if isinstance(value, type)}
    return sorted((value for value in found if issubclass(value, Shape)), key=lambda shape: shape.__name__)


def table_of(definition: dict[str, Any]) -> dict[str, Any]:
    """The table of a model that may also stand as a bare scalar."""
    return next((part for part in definition.get("anyOf", ()) if "properties" in part), definition)


@pytest.mark.parametrize(
    ("kind", "modules"), [("profile", [model]), ("site", [sections, sitefile])], ids=["profile", "site"]
)
def test_schema_and_models_have_the_same_keys(kind: Kind, modules: list[ModuleType]) -> None:
    whole = schema(kind)
    definitions = {"RawProfile": whole, "RawSite": whole, **whole["$defs"]}
    compared = 0
    for shape in shapes(*modules):
        if shape.__name__ in definitions:
            table = table_of(definitions[shape.__name__])
            assert set(table["properties"]) == set(shape.key_names()), shape
            assert table["additionalProperties"] is False or shape.model_config["extra"] == "allow"
            compared += 1
    assert compared >= 10


def test_every_key_is_explained() -> None:
    text = (ROOT / "docs" / "mapping.md").read_text(encoding="utf-8")
    words = set(re.findall(r"`([a-z_0-9]+)`", text))
    known = {key for shape in shapes(model, sections, sitefile) for key in shape.key_names()}
    assert known - words == set()
