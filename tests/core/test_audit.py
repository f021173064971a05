"""A look at every line of a journal: what is whole, what is broken, and where (R1)."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.core.audit import Break, check, passages
from gateway.core.ledger import Ledger
from tests.core.faultydisk import Content, FaultyDisk


def written(*kinds: str, rotate: int = 100_000, **more: Any) -> FaultyDisk:
    """A disk with entries of these kinds, each written for itself."""
    disk = FaultyDisk()
    ledger = Ledger(disk, rotate=rotate)
    ledger.open()
    for number, kind in enumerate(kinds):
        ledger.write([{"kind": kind, "time": number, "mono": 1.0, "lived": 1.0, **more}])
    return disk


def edited(disk: FaultyDisk, name: str, old: bytes, new: bytes) -> None:
    disk.files[name] = Content(bytearray(bytes(disk.files[name].now).replace(old, new)))


def test_a_whole_journal_has_no_break_and_ends_where_it_was_written_last() -> None:
    disk = written("test", "test", "test")
    [name] = disk.names()
    lines = [passage.line for passage in passages(disk)]
    found = check(disk)
    assert (found.files, found.entries, found.breaks, found.half) == (1, 4, [], "")
    assert (found.first, found.last) == (lines[0].head, lines[-1].head)
    assert found.first.n == 1
    assert found.last.n == 4
    assert {passage.file for passage in passages(disk)} == {name}


def test_the_chain_goes_on_from_file_to_file() -> None:
    disk = written(*["test"] * 6, rotate=400)
    found = check(disk)
    assert found.files == len(disk.names()) > 2
    assert found.breaks == []
    assert found.last.n == found.entries


def test_half_a_line_at_the_end_is_being_written_and_no_break() -> None:
    disk = written("test", "test")
    [name] = disk.names()
    disk.files[name].now.extend(b'{"hash":"12')
    found = check(disk)
    assert (found.entries, found.breaks, found.half) == (3, [], name)


def test_half_a_line_before_other_lines_is_a_break() -> None:
    disk = written(*["test"] * 3, rotate=400)
    first, second, *_ = disk.names()
    del disk.files[first].now[-30:]
    breaks = check(disk).breaks
    assert breaks[0] == Break(first, 2, None, "half a line")
    assert [one.file for one in breaks[1:]] == [second], "the entry that is missing is told once"
    assert check(disk).half == ""


def test_a_changed_entry_is_told_with_its_file_line_and_number() -> None:
    disk = written("test", "test", "test")
    [name] = disk.names()
    edited(disk, name, b'"time":1', b'"time":7')
    assert check(disk).breaks == [Break(name, 3, 3, "entry 3 or the one before it was changed")]


def test_a_line_that_is_no_entry_is_told_without_a_number() -> None:
    disk = written("test", "test")
    [name] = disk.names()
    disk.files[name].now.extend(b"nonsense\n")
    assert check(disk).breaks == [Break(name, 4, None, "no entry of a journal")]


def test_a_hash_that_was_noted_down_is_found_or_not() -> None:
    disk = written("test", "test")
    noted = [passage.line.head.hash for passage in passages(disk)]
    assert all(check(disk, one).holds for one in noted)
    assert not check(disk, "0" * 64).holds
    assert not check(disk).holds


@pytest.mark.parametrize(("more", "unended"), [({"ended": False}, [4]), ({"ended": True}, []), ({}, [])])
def test_the_run_before_a_start_after_a_bad_end_is_told(more: dict[str, bool], unended: list[int]) -> None:
    assert check(written("boot", run=5, **more)).unended == unended
    assert check(written("test", run=5, **more)).unended == []
