"""Whatever stands in a file: it loads, or there are findings; it never ends in an exception."""

from __future__ import annotations

import re

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gateway.mapping.finding import has_errors
from gateway.mapping.load import profile_of
from tests.mapping.texts import TECO, small

LINES = TECO.read_text(encoding="utf-8").splitlines()
WORDS = sorted(set(re.findall(r"[\w.<>-]+", "\n".join(LINES))))
SECTIONS = ["serial", "modbus", "settings", "values", "errors", "commands", "addresses", "documents"]
quick = settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))


def judged(text: str) -> None:
    profile, findings = profile_of(text.encode(), "f", "small")
    assert (profile is None) == has_errors(findings)
    for finding in findings:
        assert finding.line >= 1 and finding.column >= 1 and finding.message and finding.remedy


@quick
@given(st.integers(0, len(LINES) - 1), st.sampled_from(WORDS), st.sampled_from(WORDS))
def test_a_profile_with_one_word_changed(line: int, old: str, new: str) -> None:
    lines = [*LINES]
    lines[line] = lines[line].replace(old, new) if old in lines[line] else f"{lines[line]} {new}"
    judged("\n".join(lines))


@quick
@given(st.sets(st.integers(0, len(LINES) - 1), max_size=4))
def test_a_profile_with_lines_missing(lost: set[int]) -> None:
    judged("\n".join(line for number, line in enumerate(LINES) if number not in lost))


scalars = st.sampled_from(
    [
        "0",
        "-1",
        "0001H",
        "FFFFH",
        "65536",
        "1e3",
        "true",
        "on",
        "a",
        "<n>",
        "0..3",
        "a..b",
        "0.01 Hz",
        "200ms",
        "u32",
    ]
)
keys = st.sampled_from(
    [
        "at",
        "bits",
        "bit",
        "unit",
        "times",
        "offset",
        "values",
        "special",
        "range",
        "counts",
        "rate",
        "access",
        "kind",
        "type",
        "image",
        "repeat",
        "stride",
        "only_when",
        "wear",
        "danger",
        "always",
        "pulse",
        "active",
        "when",
        "cases",
        "help",
        "source",
        "doubt",
        "words",
    ]
)
trees = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys | scalars, inner, max_size=4),
    max_leaves=8,
)


def flow(tree: object) -> str:
    if isinstance(tree, dict):
        return "{" + ", ".join(f"{key}: {flow(value)}" for key, value in tree.items()) + "}"
    if isinstance(tree, list):
        return "[" + ", ".join(map(flow, tree)) + "]"
    return str(tree)


@settings(max_examples=200, deadline=None)
@given(st.dictionaries(st.sampled_from(["a", "b", "c_<n>", "run", "D"]), trees, max_size=3))
def test_any_points(points: dict[str, object]) -> None:
    judged(small("\n".join(f"{name}: {flow(tree)}" for name, tree in points.items()) or "{}"))


@settings(max_examples=100, deadline=None)
@given(trees, st.sampled_from(SECTIONS))
def test_any_section(tree: object, section: str) -> None:
    text = small("a: 0001H")
    without = "".join(line for line in text.splitlines(keepends=True) if not line.startswith(f"{section}:"))
    judged(f"{without}{section}: {flow(tree)}\n")
