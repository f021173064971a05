"""Every fact of the documents is in the loaded profile and in `gateway profiles NAME --json`; nothing
else is."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest

from gateway.mapping.load import builtin_mappings, load_profile
from gateway.mapping.profile import Point, Profile
from tests.cli.program import gateway
from tests.profiles import s2000, shihlin_sl3, teco_7200gs
from tests.profiles.facts import Fact

FACTS = {
    "teco-7200gs": teco_7200gs.FACTS,
    "s2000": s2000.FACTS,
    "shihlin-sl3": shihlin_sl3.FACTS,
}
ERRORS = {
    "teco-7200gs": teco_7200gs.ERRORS,
    "s2000": s2000.ERRORS,
    "shihlin-sl3": shihlin_sl3.ERRORS,
}


@cache
def profile(name: str) -> Profile:
    """A shipped profile."""
    loaded, findings = load_profile(builtin_mappings() / f"{name}.yaml")
    assert loaded is not None, [str(finding) for finding in findings]
    return loaded


@cache
def told(name: str) -> dict[str, Any]:
    """What the command line tells of a profile."""
    (found,) = gateway("profiles", name, "--json").objects
    return found


def fact_of(point: Point) -> Fact:
    cut = point.encoding
    bits = (cut.bit, cut.bit + cut.width - 1) if cut.width else None
    exact = "by case" if point.cases else str(cut.scale)
    return Fact(point.name, point.address, bits, exact, cut.symbol, point.access, cut.type, dict(cut.values))


def fact_told(point: dict[str, Any]) -> Fact:
    return Fact(
        name=point["name"],
        register=int(point["registers"][0].rstrip("H"), 16),
        bits=tuple(point["bits"]) if point["bits"] else None,
        exact="by case" if point["cases"] else point["exact"],
        unit=point["unit"],
        access=point["access"],
        type=point["type"],
        values={int(raw): name for raw, name in point["values"].items()},
    )


@pytest.mark.parametrize("name", FACTS)
def test_the_profile_holds_every_fact_and_no_other(name: str) -> None:
    found = {point.name: fact_of(point) for point in profile(name).points.values()}
    assert found == {fact.name: fact for fact in FACTS[name]}


@pytest.mark.parametrize("name", FACTS)
def test_the_command_line_tells_every_fact_and_no_other(name: str) -> None:
    found = {point["name"]: fact_told(point) for point in told(name)["points"]}
    assert found == {fact.name: fact for fact in FACTS[name]}


@pytest.mark.parametrize("name", ERRORS)
def test_errors(name: str) -> None:
    assert {code: error.name for code, error in profile(name).errors.items()} == ERRORS[name]
    assert {int(e["code"][:-1], 16): e["name"] for e in told(name)["errors"]} == ERRORS[name]


@pytest.mark.parametrize("name", FACTS)
def test_everything_has_a_source_and_a_help(name: str) -> None:
    for point in told(name)["points"]:
        document = point["source"].partition(" ")[0]
        assert document in told(name)["documents"], point["name"]
        assert point["similar_model"] == (document in told(name)["similar_documents"])
        assert point["source"].partition(" ")[2], point["name"]


@pytest.mark.parametrize("name", FACTS)
def test_a_fact_stands_once(name: str) -> None:
    names = [fact.name for fact in FACTS[name]]
    assert len(names) == len(set(names))
