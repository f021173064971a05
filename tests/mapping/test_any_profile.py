"""Any profile that the schema accepts loads and every point comes back, or it is refused with words."""

from __future__ import annotations

import json
from typing import Any

import jsonschema
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from gateway.mapping.finding import has_errors
from gateway.mapping.load import profile_of
from gateway.mapping.reader import read
from gateway.mapping.schema import schema
from gateway.mapping.specialise import specialise
from tests.mapping.roundtrip import check_round_trips
from tests.mapping.texts import TECO

VALIDATOR = jsonschema.Draft202012Validator(schema("profile"))
few = settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck))

NAMES = ["mode", "speed", "load", "heat", "word", "level"]
names = st.sampled_from(NAMES)
numbers = st.sampled_from(["0", "1", "7", "-1", "-40", "2.5", "0EH", "1110B", "300", "65535", "FFFFH", "1e3"])
spans = st.sampled_from(["0..1", "0..50", "-10..10", "0..speed", "0..limit", "3..2", "0..FFFFH"])
raw_keys = st.sampled_from(["0", "1", "2", "3", "FFFFH", "x1B", "x0B", "1x0B", "xx01B"])
words = st.sampled_from(["off", "on", "a", "b", "c"])
values = st.dictionaries(raw_keys, words, min_size=1, max_size=3)
conditions = st.dictionaries(
    names | st.just("limit"), numbers | spans | words | st.lists(numbers, min_size=1), max_size=2
)
meanings: dict[str, st.SearchStrategy[Any]] = {
    "type": st.sampled_from(["u16", "s16", "u32", "s32", "u64", "f32", "bcd", "text 6"]),
    "unit": st.sampled_from(["0.01 Hz", "1/300 %", "10/1023 V", "11/726 V", "1 A", "0.1 kW"]),
    "times": names | st.just("limit"),
    "offset": numbers,
    "values": values,
    "special": st.dictionaries(raw_keys, words, max_size=1),
    "range": spans,
    "words": st.sampled_from(["high_first", "low_first"]),
}
traits: dict[str, st.SearchStrategy[Any]] = {
    **meanings,
    "kind": st.sampled_from(["status", "measurement", "setpoint", "switch", "command", "parameter"]),
    "access": st.sampled_from(["read", "write", "read-write"]),
    "when": conditions,
    "only_when": conditions,
    "wear": st.sampled_from(["unknown", "100000"]),
    "shift": st.just("limit"),
    "select": st.dictionaries(names, numbers, max_size=1),
    "cases": st.lists(st.fixed_dictionaries({}, optional={"when": conditions, **meanings}), max_size=3),
}
positions = st.integers(0, 15).map(str) | st.sampled_from(["0..3", "2..3", "8..F", "C"])
fields = st.fixed_dictionaries({"bit": positions}, optional=traits) | positions
places = st.integers(0, 40).map(lambda at: f"{at:04X}H")
registers = st.fixed_dictionaries({"at": places}, optional=traits) | places
frames = st.fixed_dictionaries(
    {"at": places, "image": st.booleans(), "bits": st.dictionaries(names, fields, min_size=1, max_size=3)}
)
HEAD = {
    "profile": "any",
    "title": "Any",
    "maker": "Nobody",
    "models": ["A"],
    "version": "1",
    "documents": {"m": "manual"},
    "serial": {"baud": ["9600"], "rtu": ["8N1"]},
    "settings": {"limit": {"range": "1..9", "default": "3"}},
}
profiles = st.dictionaries(names, registers | frames, min_size=1, max_size=4).map(
    lambda points: {**HEAD, "groups": {"g": {"points": points}}}
)


def judged(text: bytes) -> bool:
    """True when the profile loads, and then its points come back; else there are words."""
    profile, findings = profile_of(text, "any.yaml", "any")
    assert (profile is None) == has_errors(findings)
    assert all(f.line >= 1 and f.column >= 1 and f.message and f.remedy for f in findings)
    if profile is not None:
        check_round_trips(profile)
        given = {name: setting.default for name, setting in profile.settings.items()}
        if None not in given.values():
            check_round_trips(specialise(profile, given))  # type: ignore[arg-type]
    return profile is not None


@few
@given(profiles)
def test_what_the_schema_accepts(data: dict[str, Any]) -> None:
    assert not list(VALIDATOR.iter_errors(data))
    event(f"loads: {judged(json.dumps(data).encode())}")


@few
@given(st.fixed_dictionaries({}, optional=meanings))
def test_one_point_of_any_encoding(meaning: dict[str, Any]) -> None:
    meaning.pop("times", None)
    points = {"one": {"at": "0000H", **meaning}, "speed": "0020H"}
    data = {**HEAD, "groups": {"g": {"points": points}}}
    assert not list(VALIDATOR.iter_errors(data))
    event(f"loads: {judged(json.dumps(data).encode())}")


def test_some_of_them_load() -> None:
    plain = {"g": {"points": {"one": {"at": "0000H", "type": "s32", "unit": "11/726 V", "offset": "-40"}}}}
    assert judged(json.dumps({**HEAD, "groups": plain}).encode())


SEED = TECO.read_bytes()


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, len(SEED) - 1), st.binary(max_size=3)), max_size=6), st.booleans())
def test_a_file_with_bytes_changed(changes: list[tuple[int, bytes]], shortened: bool) -> None:
    data = SEED
    for at, piece in changes:
        data = data[:at] + piece + (b"" if shortened else data[at + len(piece) :])
    root, findings = read(data, "f")
    assert root is not None or findings
    profile, found = profile_of(data, "f", "teco-7200gs")
    assert (profile is None) == has_errors(found)
