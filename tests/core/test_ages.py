"""Which tags need a look because the read that brings them is late."""

from __future__ import annotations

from gateway.core.ages import Ages, Group


def ages() -> Ages:
    found = Ages()
    found.plan("fan-1", {(0x20, 5): Group(1.0, 0.0, ["a", "b"]), (0x31, 3): Group(10.0, 0.0, ["c"])})
    found.plan("fan-2", {(0x20, 5): Group(1.0, 0.0, ["d"])})
    return found


def test_what_is_read_in_time_needs_no_look() -> None:
    found = ages()
    assert list(found.late(2.0)) == []
    found.came("fan-1", 0x20, 5, 1.5)
    found.came("fan-2", 0x20, 5, 0.4)
    assert list(found.late(3.4)) == ["d"]
    assert list(found.late(3.6)) == ["a", "b", "d"]
    assert list(found.late(20.1)) == ["a", "b", "c", "d"]


def test_a_read_of_other_registers_brings_nothing() -> None:
    found = ages()
    found.came("fan-1", 0x20, 1, 2.0)
    assert list(found.late(2.1)) == ["a", "b", "d"]


def test_a_new_plan_of_a_drive_takes_the_place_of_its_old_one() -> None:
    found = ages()
    found.plan("fan-1", {(0x24, 1): Group(0.5, 2.0, ["a"])})
    assert list(found.late(2.1)) == ["d"]
    assert list(found.late(3.1)) == ["d", "a"]


def test_h17_a_read_older_than_what_was_told_before_is_late_by_its_own_age() -> None:
    """The line was lost and is back, which was told at 20; what is read then is known since 10 only."""
    found = Ages()
    found.plan("fan-1", {(0x20, 2): Group(2.0, 20.0, ["a", "b"])})
    assert list(found.late(21.0)) == []
    found.came("fan-1", 0x20, 2, 10.0)
    assert list(found.late(21.0)) == ["a", "b"]


def test_h17_a_tag_that_another_read_brought_is_late_by_the_age_of_that() -> None:
    found = Ages()
    found.plan("fan-1", {(0x20, 2): Group(2.0, 20.0, ["a", "b"]), (0x31, 1): Group(2.0, 20.0, ["c"])})
    found.came("fan-1", 0x20, 1, 10.0)
    found.older({"b"}, 10.0)
    assert list(found.late(21.0)) == ["a", "b"]
