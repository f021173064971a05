"""Every fact of the documents is in the loaded profile and in `gateway profiles NAME --json`; nothing
else is."""

from __future__ import annotations

from collections.abc import Iterator
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


# -- what is said of the facts themselves --


def everything_with_a_source(found: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every part of a profile that carries a source, with its name."""
    yield from ((key, fact) for key, fact in found["facts"].items() if fact["stated"])
    layouts = [found, *([found["broadcast"]] if found["broadcast"] else [])]
    for layout in layouts:
        for part in (*layout["points"], *layout["commands"]):
            yield part["name"], part
    for part in (*found["settings"], *found["errors"], *found["addresses"]):
        yield str(part.get("name") or part.get("pattern")), part
    for part in (*found["points"], *found["settings"]):
        yield from ((f"{part['name']}={raw}", fact) for raw, fact in part["names"].items())


@pytest.mark.parametrize("name", FACTS)
def test_every_source_is_a_document_or_admitted_to_be_none(name: str) -> None:
    found = told(name)
    for what, part in everything_with_a_source(found):
        document, _, place = part["source"].partition(" ")
        assert document == "ours" or (document in found["documents"] and place), what
        assert part["similar_model"] == (document in found["similar_documents"]), what
        if document == "ours":
            assert part["doubt"], what


@pytest.mark.parametrize("name", FACTS)
def test_no_doubt_contradicts_the_source(name: str) -> None:
    """What is not on the page does not come from it; what is ours does not come from a document."""
    for what, part in everything_with_a_source(told(name)):
        doubt = part["doubt"] or ""
        ours = doubt.startswith(("our limit", "not on the page", "a limit of ours", "caution"))
        assert (part["source"] == "ours") >= ours, (what, part["source"], doubt)


def test_facts_that_are_in_no_document() -> None:
    admitted = {
        name: {what for what, part in everything_with_a_source(told(name)) if part["source"] == "ours"}
        for name in FACTS
    }
    assert admitted == {
        "teco-7200gs": {"modbus.bridge", "max_frequency"},
        "s2000": {"modbus.bridge", "serial.reply", "serial.pause"},
        "shihlin-sl3": {"serial.baud", "serial.units", "serial.reply", "max_frequency"},
    }


HOLES = {
    "teco-7200gs": "0003H-0008H 0025H-0026H 002EH-0030H 0034H-003CH 0117H-0117H",
    "s2000": "0002H-0006H 000AH-000EH 0013H-0013H",
    "shihlin-sl3": "",
}


@pytest.mark.parametrize("name", FACTS)
def test_holes_are_told_and_nothing_lies_in_them(name: str) -> None:
    found = told(name)
    assert [f"{low}-{high}" for low, high in found["modbus"]["holes"]] == HOLES[name].split()
    assert found["facts"]["modbus.holes"]["stated"] == bool(HOLES[name])
    taken = {register for point in found["points"] for register in point["registers"]}
    for low, high in found["modbus"]["holes"]:
        span = range(int(low[:-1], 16), int(high[:-1], 16) + 1)
        assert not taken & {f"{register:04X}H" for register in span}


def test_unused_bits_are_told() -> None:
    words = {word["register"]: word for word in told("teco-7200gs")["words"]}
    assert words["0001H"]["unused"] == []
    assert (words["0001H"]["always_mask"], words["0001H"]["always_bits"]) == ("FF00H", "0000H")
    assert words["0021H"]["unused"] == [[4, 4], [6, 6], [10, 10], [13, 15]]
    assert words["003DH"]["unused"] == [[2, 2], [7, 15]]
    words = {word["register"]: word for word in told("s2000")["words"]}
    assert words["0015H"]["unused"] == [[12, 12], [15, 15]]


def test_names_of_values_have_their_own_sources() -> None:
    (mode,) = (point for point in told("shihlin-sl3")["points"] if point["name"] == "operation_mode")
    assert mode["names"]["0"]["source"] == "sl3 example 1"
    assert mode["names"]["8"] == {
        "name": "panel",
        "help": "",
        "source": "sc3 p.133",
        "similar_model": True,
        "doubt": mode["names"]["8"]["doubt"],
    }
    (stop,) = (setting for setting in told("s2000")["settings"] if setting["name"] == "f5_04")
    assert stop["names"]["1"]["help"] == "Emergency stop in the time C1-09"
    (channel,) = (point for point in told("teco-7200gs")["points"] if point["name"] == "ao_12_channel_2")
    assert channel["names"]["0"]["help"] == "100 % is the maximum frequency"


def test_notations_of_the_manual() -> None:
    notations = {n["pattern"]: n for n in told("teco-7200gs")["addresses"]}
    assert notations["Sn-<n>"]["weights"] == {"n": 1}
    assert (notations["Sn-<n>"]["add"], notations["Sn-<n>"]["example"]) == (0xFF, "Sn-28 = 011BH")
    assert notations["Sn-<n>"]["source"] == "sim 9.3"


@pytest.mark.parametrize("name", FACTS)
def test_people_are_told_as_much(name: str) -> None:
    text = gateway("profiles", name).out
    for low, high in told(name)["modbus"]["holes"]:
        assert (low if low == high else f"{low}..{high}") in text
    for key, fact in told(name)["facts"].items():
        if fact["stated"]:
            origin = "in no document" if fact["source"] == "ours" else fact["source"]
            assert f"  {key}: {origin}" in text
