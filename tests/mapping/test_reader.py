"""The reader: every scalar is text with its place, and nothing of YAML's powers is left."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from gateway.mapping.node import Node
from gateway.mapping.reader import MAX_CHARACTERS, read


def tree(text: str) -> Node:
    root, findings = read(text.encode(), "f")
    assert findings == []
    assert root is not None
    return root


def test_scalars_stay_as_they_are_written() -> None:
    root = tree("a: 0600\nb: on\nc: 12:30\nd: 1e3\ne: 2001-01-01\nf: 'null'\ng: 0x1F\nh: ''\n")
    assert root.plain() == {
        "a": "0600",
        "b": "on",
        "c": "12:30",
        "d": "1e3",
        "e": "2001-01-01",
        "f": "null",
        "g": "0x1F",
        "h": "",
    }


def test_values_and_keys_know_their_places() -> None:
    root = tree("a:\n  - {b: 1,\n     c: 2}\n")
    assert root.mark(("a", 0, "c")) == (3, 9)
    assert root.mark(("a", 0, "c"), key=True) == (3, 6)
    assert root.mark(("a", 0, "missing")) == (2, 5)


def test_t5_an_alias_bomb_does_nothing() -> None:
    lines = ["a0: &a0 [x, x]"] + [f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]" for n in range(1, 40)]
    _, findings = read("\n".join(lines).encode(), "f")
    assert len(findings) == 40 + 2 * 39


def test_a_tag_does_nothing(tmp_path: Path) -> None:
    target = tmp_path / "made"
    root, findings = read(f"a: !!python/object/apply:pathlib.Path.touch [{target}]".encode(), "f")
    assert [finding.line for finding in findings] == [1]
    assert root is not None and root.plain() == {"a": [str(target)]}
    assert not target.exists()


def test_a_file_that_is_too_long_is_not_even_parsed() -> None:
    root, findings = read(b"a: " + b"x" * MAX_CHARACTERS, "f")
    assert root is None
    assert str(findings[0]) == f"f:1:1: the file is longer than {MAX_CHARACTERS} bytes (split or shorten it)"


def test_what_is_not_text() -> None:
    assert (
        str(read(b"a: 1\nb: \xff\n", "f")[1][0])
        == "f:2:1: this line is not UTF-8 text (save the file as UTF-8)"
    )
    assert "may not stand in YAML" in read(b"a: 1\nb: \x00\n", "f")[1][0].message


def test_a_byte_order_mark_is_no_key() -> None:
    assert read(b"\xef\xbb\xbfa: 1", "f")[0].plain() == {"a": "1"}  # type: ignore[union-attr]


def test_t5_depth_has_a_limit_that_no_recursion_error_needs_to_enforce() -> None:
    root, findings = read(b"[" * 100_000, "f")
    assert root is None
    assert "nested deeper" in findings[0].message


@given(st.one_of(st.binary(max_size=200), st.text(max_size=200).map(str.encode)))
def test_any_bytes_give_a_tree_or_findings(data: bytes) -> None:
    root, findings = read(data, "f")
    assert root is not None or findings


@given(st.text(alphabet="ab:{}[]-,&*!|>'\"#\n \t%@`?~0", max_size=80))
def test_any_yaml_like_text_gives_a_tree_or_findings(text: str) -> None:
    root, findings = read(text.encode(), "f")
    assert root is not None or findings
