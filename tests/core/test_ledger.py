"""R1, R2: whatever fails and wherever it is torn, the files hold one chain, and all that was reported."""

from __future__ import annotations

import errno
import os
import resource
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.core.chain import Head, lines_of
from gateway.core.disk import Disk, Folder
from gateway.core.ledger import Ledger
from tests.core.faultydisk import FaultyDisk

ROTATE = 900
MANY = 10_000
OPERATIONS = ("", "sync", "sync folder", "append", "cut", "create", "stat", "open", "remove", "close")


def entry(number: int) -> dict[str, Any]:
    return {"kind": "test", "time": number, "mono": float(number), "lived": float(number), "text": "x" * 40}


def lines(disk: Disk) -> Iterator[tuple[str, dict[str, Any]]]:
    """Problem and entry of each line of all files, held against the line before it."""
    before: Head | None = None
    for name in disk.names():
        for line in lines_of(disk.read(name), before):
            yield line.problem, line.entry or {}
            before = line.head if line.entry is not None else before


def numbers_in(disk: Disk) -> list[int]:
    """The numbers of the test's entries, in the order in which they stand."""
    return [entry["time"] for _, entry in lines(disk) if entry.get("kind") == "test"]


def problems(disk: Disk) -> list[str]:
    return [problem for problem, _ in lines(disk) if problem]


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_r1_r2_any_sequence_of_failures_crashes_and_torn_writes_leaves_one_chain_and_loses_nothing(
    data: st.DataObject,
) -> None:
    disk = FaultyDisk()
    ledger = Ledger(disk, ROTATE, MANY)
    ledger.open()
    reported: list[int] = []
    number = 0
    for _ in range(data.draw(st.integers(1, 12), "steps")):
        disk.room = data.draw(st.none() | st.integers(0, 600), "room")
        bad = data.draw(
            st.sampled_from(["", "sync", "sync folder", "append", "cut", "create", "stat", "open"])
        )
        disk.fails = lambda operation, bad=bad: operation == bad  # type: ignore[misc]
        numbers = [number := number + 1 for _ in range(data.draw(st.integers(1, 3), "entries"))]
        try:
            ledger.write([entry(n) for n in numbers])
            reported += numbers
        except OSError:
            pass
        if data.draw(st.booleans(), "crash"):
            disk = disk.crash(
                lambda count: data.draw(st.integers(0, count), "kept"),
                data.draw(st.booleans(), "zeros"),
                lambda name: data.draw(st.booleans(), f"{name} listed"),
            )
            ledger = Ledger(disk, ROTATE, MANY)
            assert ledger.open().memory.runs.wall >= (reported[-1] if reported else 0)
    disk.room, disk.fails = None, lambda operation: False
    ledger.write([entry(number := number + 1)])
    assert problems(disk) == []
    written = numbers_in(disk)
    assert sorted(set(written)) == written, "in order, none twice"
    assert set(reported) <= set(written)
    assert Ledger(disk, ROTATE, MANY).open().memory.runs.wall == number


def filled(disk: Disk, count: int = 20, rotate: int = ROTATE) -> Ledger:
    ledger = Ledger(disk, rotate, MANY)
    ledger.open()
    for number in range(1, count + 1):
        ledger.write([entry(number)])
    return ledger


def test_files_begin_with_a_snapshot_and_the_oldest_go(tmp_path: Path) -> None:
    disk = Folder(tmp_path)
    ledger = Ledger(disk, ROTATE, 3)
    ledger.open()
    for number in range(1, 101):
        ledger.write([entry(number)])
    assert len(disk.names()) == 3
    firsts = [next(lines_of(disk.read(name))) for name in disk.names()]
    assert [line.entry["kind"] if line.entry else "" for line in firsts] == ["snapshot"] * 3
    assert problems(disk) == []
    assert max(len(disk.read(name)) for name in disk.names()) < ROTATE + 400
    assert Ledger(disk).open().memory.runs.wall == 100, "the newest file is enough"


def test_half_a_line_is_cut_off_and_told() -> None:
    disk = FaultyDisk()
    filled(disk)
    name = disk.names()[-1]
    del disk.files[name].now[-5:]
    ledger = Ledger(disk)
    found = ledger.open()
    assert found.memory.runs.wall == 19
    assert (found.broken, found.cut > 100) == ("", True)
    ledger.write([entry(21)])
    assert problems(disk) == []
    assert numbers_in(disk) == [*range(1, 20), 21]


def test_r1_a_changed_line_is_left_as_it_stands_and_a_new_file_is_begun() -> None:
    disk = FaultyDisk()
    filled(disk, 8)
    name = disk.names()[-1]
    changed = bytes(disk.files[name].now).replace(b'"lived":7.0', b'"lived":9.0')
    disk.files[name].now[:] = changed
    ledger = Ledger(disk)
    found = ledger.open()
    assert found.memory.runs.wall == 8, "what can be read is remembered"
    assert f"{name}:" in found.broken
    assert "changed" in found.broken
    ledger.write([entry(9)])
    assert bytes(disk.files[name].now) == changed
    assert len(problems(disk)) == 1
    assert numbers_in(disk) == list(range(1, 10))


@pytest.mark.parametrize("spoiled", ["removed", "emptied", "cut", "replaced"])
def test_r2_a_file_that_is_taken_away_while_it_is_written_is_noticed(tmp_path: Path, spoiled: str) -> None:
    disk = Folder(tmp_path)
    ledger = filled(disk, 3, MANY)
    path = tmp_path / disk.names()[-1]
    match spoiled:
        case "removed":
            path.unlink()
        case "emptied":
            os.truncate(path, 0)
        case "cut":
            os.truncate(path, path.stat().st_size - 10)
        case "replaced":
            content = path.read_bytes()
            path.unlink()
            path.write_bytes(content)
    with pytest.raises(OSError, match="somebody else"):
        ledger.write([entry(4)])
    ledger.write([entry(5)])
    assert Ledger(disk).open().memory.runs.wall == 5
    assert numbers_in(disk)[-1] == 5
    assert 4 not in numbers_in(disk)[-1:]


def test_r2_a_folder_that_is_gone_is_not_made_again_and_taken_up_when_it_is_back(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    ledger = filled(Folder(folder), 3, MANY)
    folder.rename(tmp_path / "elsewhere")
    for _ in range(2):
        with pytest.raises(OSError, match=r"somebody else|No such file"):
            ledger.write([entry(4)])
    assert not folder.exists()
    (tmp_path / "elsewhere").rename(folder)
    ledger.write([entry(5)])
    assert numbers_in(Folder(folder))[-1] == 5
    assert Ledger(Folder(folder)).open().memory.runs.wall == 5


def test_r2_a_file_that_may_not_grow(tmp_path: Path) -> None:
    """The kernel itself says no, in the middle of a line."""
    disk = Folder(tmp_path)
    ledger = filled(disk, 2, MANY)
    size = (tmp_path / disk.names()[-1]).stat().st_size
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    import signal

    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size + 30, hard))
        for number in (3, 4):
            with pytest.raises(OSError, match="File too large") as caught:
                ledger.write([entry(number)])
            assert caught.value.errno == errno.EFBIG
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
    ledger.write([entry(5)])
    assert problems(disk) == []
    assert numbers_in(disk) == [1, 2, 5]


def test_a_new_file_that_was_never_finished_is_removed() -> None:
    disk = FaultyDisk()
    filled(disk, 5)
    disk.create("journal-000000000999.jsonl").append(b'{"hash":"00')
    ledger = Ledger(disk)
    assert ledger.open().memory.runs.wall == 5
    ledger.write([entry(6)])
    assert problems(disk) == []
    assert "journal-000000000999.jsonl" not in disk.names()


def test_r1_a_newest_file_of_rubbish_is_kept_as_evidence() -> None:
    disk = FaultyDisk()
    filled(disk, 5)
    name = f"journal-{len(list(lines(disk))) + 1:012d}.jsonl"
    disk.create(name).append(b"rubbish\n" * 10)
    ledger = Ledger(disk)
    found = ledger.open()
    assert found.memory.runs.wall == 5
    assert name in found.broken
    ledger.write([entry(6)])
    assert bytes(disk.files[name].now) == b"rubbish\n" * 10
    assert Ledger(disk).open().memory.runs.wall == 6
