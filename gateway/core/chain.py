"""The lines of the journal, chained by hashes: made and checked. Pure.

A line is ``{"hash":"<64 hex digits>",<content>}`` and a newline. The hash is the SHA-256 over the hash of the
line before it (as text) and the content, byte for byte; so any program that can hash can check a journal.
``n`` in the content counts the lines from the first one ever written, through all files. A file begins with
a ``snapshot``, whose ``after`` is the hash of the line before it: the last one of the file before, or
`NOTHING_BEFORE`.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec

NOTHING_BEFORE = "0" * 64
"""Stands for the hash before the first line of all."""

SNAPSHOT = "snapshot"
"""The kind of the first entry of each file."""

HALF = "half a line"

_HEAD = b'{"hash":"'
_CONTENT = len(_HEAD) + 64 + len(b'",')
"""Where the content begins in a line."""

Entry = Mapping[str, Any]
"""An entry of the journal as plain JSON data, with its ``kind``."""

_SHAPE = re.compile(rb'{"hash":"[0-9a-f]{64}",')

_encode = msgspec.json.Encoder().encode
_decode = msgspec.json.Decoder(dict[str, Any]).decode


@dataclass(frozen=True, slots=True)
class Head:
    """The end of a chain: number and hash of its last line."""

    n: int = 0
    hash: str = NOTHING_BEFORE


@dataclass(frozen=True, slots=True)
class Line:
    """One line of a file: ``number`` counts from 1, ``start`` and ``end`` are byte offsets.

    ``entry`` is None when the line is no entry at all. ``problem`` tells what is wrong with its place in
    the chain, "" if nothing is.
    """

    number: int
    start: int
    end: int
    entry: dict[str, Any] | None
    head: Head
    problem: str = ""


def seal(entry: Entry, before: Head) -> tuple[bytes, Head]:
    """The line of an entry that comes after ``before``, and the new end of the chain."""
    content = _encode({"n": before.n + 1, **entry})[1:]
    hashed = _hash(before.hash, content)
    return _HEAD + hashed.encode() + b'",' + content + b"\n", Head(before.n + 1, hashed)


def lines_of(data: bytes, before: Head | None = None) -> Iterator[Line]:
    """The lines of a file, checked. ``before`` is the end of the file before it, None if that is not known:
    then the first line is believed. Behind a break, lines are held against the line before them as it
    stands, so that each break is told once."""
    start = number = 0
    while start < len(data):
        newline = data.find(b"\n", start)
        end = len(data) if newline < 0 else newline + 1
        number += 1
        line = _line(data[start:end], number, start, before)
        yield line
        before = line.head if line.entry is not None else before
        start = end


def _line(text: bytes, number: int, start: int, before: Head | None) -> Line:
    end = start + len(text)
    entry = _entry(text)
    if entry is None:
        whole = text.endswith(b"\n")
        return Line(number, start, end, None, before or Head(), "no entry of a journal" if whole else HALF)
    head = Head(entry["n"], text[len(_HEAD) : _CONTENT - 2].decode())
    if before is None and entry["kind"] != SNAPSHOT:
        return Line(number, start, end, entry, head, "the file does not begin with a snapshot")
    before = before or Head(head.n - 1, entry["after"])
    return Line(number, start, end, entry, head, _problem(head, text[_CONTENT:-1], before))


def _entry(text: bytes) -> dict[str, Any] | None:
    """The entry of a line; None unless it has the shape of one, newline included."""
    if not _SHAPE.match(text) or not text.endswith(b"}\n"):
        return None
    try:
        entry = _decode(text)
    except (msgspec.MsgspecError, UnicodeDecodeError):
        return None
    n, kind = entry.get("n"), entry.get("kind")
    shaped = type(n) is int and isinstance(kind, str)
    return entry if shaped and (kind != SNAPSHOT or isinstance(entry.get("after"), str)) else None


def _problem(head: Head, content: bytes, before: Head) -> str:
    if _hash(before.hash, content) == head.hash and head.n == before.n + 1:
        return ""
    if head.n == before.n + 1:
        return f"entry {head.n} or the one before it was changed"
    if head.n > before.n + 1:
        return f"entries {before.n + 1} to {head.n - 1} are missing before entry {head.n}"
    return f"entry {head.n} stands after entry {before.n}"


def _hash(before: str, content: bytes) -> str:
    return hashlib.sha256(before.encode() + content).hexdigest()
