"""R1: whatever is done to the lines of a journal is found, at its place."""

from __future__ import annotations

import hashlib
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from gateway.core.chain import HALF, NOTHING_BEFORE, Head, lines_of, seal

texts = st.text(max_size=20)
entries = st.lists(
    st.dictionaries(texts.filter(lambda name: name not in ("hash", "n", "kind", "after")), texts, max_size=3),
    min_size=2,
    max_size=8,
)


def journal(contents: list[dict[str, Any]]) -> list[bytes]:
    """The lines of a file that begins with a snapshot."""
    lines, head = [], Head()
    for entry in [{"kind": "snapshot", "after": NOTHING_BEFORE}, *({"kind": "x", **c} for c in contents)]:
        line, head = seal(entry, head)
        lines.append(line)
    return lines


def first_problem(data: bytes) -> tuple[int, str] | None:
    return next(((line.number, line.problem) for line in lines_of(data) if line.problem), None)


@given(entries)
def test_r1_a_chain_is_what_the_documentation_says(contents: list[dict[str, Any]]) -> None:
    """Checked by hand, with nothing of ours."""
    before = NOTHING_BEFORE
    for line in journal(contents):
        content = line[75:-1]
        assert line == b'{"hash":"' + line[9:73] + b'",' + content + b"\n"
        assert line[9:73].decode() == hashlib.sha256(before.encode() + content).hexdigest()
        before = line[9:73].decode()


@given(entries)
def test_r1_what_was_sealed_is_found_whole(contents: list[dict[str, Any]]) -> None:
    found = list(lines_of(b"".join(journal(contents))))
    assert [line.problem for line in found] == [""] * (len(contents) + 1)
    for line, content in zip(found[1:], contents, strict=True):
        assert line.entry is not None
        assert content.items() <= line.entry.items()
    assert [line.head.n for line in found] == list(range(1, len(found) + 1))


@given(entries, st.data())
def test_r1_a_changed_byte_is_found_in_its_line_or_the_next(
    contents: list[dict[str, Any]], data: st.DataObject
) -> None:
    lines = journal(contents)
    at = data.draw(st.integers(0, len(lines) - 1))
    offset = data.draw(st.integers(0, len(lines[at]) - 2))
    other = data.draw(st.integers(0, 255).filter(lambda byte: byte not in (lines[at][offset], ord("\n"))))
    lines[at] = lines[at][:offset] + bytes([other]) + lines[at][offset + 1 :]
    found = first_problem(b"".join(lines))
    assert found is not None
    assert found[0] - 1 in (at, at + 1)


@given(entries, st.data())
def test_r1_a_line_that_was_taken_out_is_found_at_its_place(
    contents: list[dict[str, Any]], data: st.DataObject
) -> None:
    lines = journal(contents)
    at = data.draw(st.integers(1, len(lines) - 2))
    del lines[at]
    assert first_problem(b"".join(lines)) == (
        at + 1,
        f"entries {at + 1} to {at + 1} are missing before entry {at + 2}",
    )


@given(entries, st.data())
def test_r1_lines_that_changed_places_are_found(contents: list[dict[str, Any]], data: st.DataObject) -> None:
    lines = journal(contents)
    at = data.draw(st.integers(0, len(lines) - 2))
    lines[at], lines[at + 1] = lines[at + 1], lines[at]
    found = first_problem(b"".join(lines))
    assert found is not None
    assert found[0] - 1 == at


def test_r1_a_beginning_that_was_cut_off_is_found() -> None:
    lines = journal([{"a": "1"}, {"a": "2"}])
    assert first_problem(b"".join(lines[1:])) == (1, "the file does not begin with a snapshot")


def test_r1_half_a_line_is_told_as_that() -> None:
    lines = journal([{"a": "1"}])
    assert first_problem(b"".join(lines)[:-1]) == (2, HALF)


def test_r1_a_break_is_told_once() -> None:
    lines = journal([{"a": str(n)} for n in range(5)])
    lines[2] = lines[2].replace(b'"1"', b'"7"')
    assert [line.number for line in lines_of(b"".join(lines)) if line.problem] == [3]
