"""H3: what an id means to the core, over restarts too (the retry of an MQTT client has another end then)."""

from __future__ import annotations

from gateway.core.attempts import Attempts
from gateway.tag import Cause, Verdict
from tests.core.world import World

TAG = "fan-1.frequency_command"


def settled() -> World:
    world = World()
    world.run(2.0)
    return world


def test_h3_a_repetition_gets_the_first_ones_outcome_after_a_restart_too() -> None:
    world = settled()
    first = world.write(TAG, 30.0, key="7")
    assert first.verdict is Verdict.CONFIRMED
    frames = len(world.sent())
    world.run(20.0)
    assert world.write(TAG, 30.0, key="7") == first
    world.restart()
    world.run(20.0)
    assert world.write(TAG, 30.0, key="7") == first
    assert len(world.sent()) == frames


def test_h3_something_else_under_a_known_id_is_refused_and_on_record() -> None:
    world = settled()
    world.write(TAG, 30.0, key="7")
    frames = len(world.sent())
    for _ in range(2):
        other = world.write(TAG, 31.0, key="7")
        assert (other.verdict, other.cause) == (Verdict.REFUSED, Cause.DUPLICATE)
        assert "used a moment ago for something else" in other.reason
        assert world.write(TAG, 30.0, key="7").verdict is Verdict.CONFIRMED, "the first one is not forgotten"
        world.restart()
        world.run(2.0)
    assert len(world.sent()) == frames
    assert [e["wanted"] for e in world.journal if e["kind"] == "outcome"] == [30.0, 31.0, 31.0]


def test_h3_something_else_under_the_id_of_a_command_under_way_is_refused() -> None:
    world = settled()
    first = world.ask_write(TAG, 30.0, key="7")
    assert world.write(TAG, 31.0, key="7").cause is Cause.DUPLICATE
    assert world.until(first, 5.0).verdict is Verdict.CONFIRMED


def test_h3_somebody_who_always_gives_one_id_is_heard_again_after_a_minute() -> None:
    world = settled()
    world.write(TAG, 30.0, key="always")
    world.run(61.0)
    assert world.write(TAG, 31.0, key="always").verdict is Verdict.CONFIRMED
    world.restart()
    world.run(2.0)
    assert world.write(TAG, 31.0, key="always").verdict is Verdict.CONFIRMED
    assert len(world.sent()) == 2
    world.run(61.0)
    assert world.write(TAG, 31.0, key="always").reason == ""
    assert len(world.sent()) == 3


def test_h3_a_later_command_under_an_old_id_does_not_get_the_old_outcome_when_it_has_none() -> None:
    """The journal knows the id twice, the second time without outcome: the gateway was killed."""
    world = settled()
    world.write(TAG, 30.0, key="7")
    world.run(61.0)
    world.ask_write(TAG, 31.0, key="7")
    world.until(lambda: len(world.sent()) == 2, 5.0)
    world.restart()
    world.run(2.0)
    again = world.write(TAG, 31.0, key="7")
    assert (again.verdict, again.cause) == (Verdict.UNKNOWN, Cause.SHUTTING_DOWN)
    assert len(world.sent()) == 2


def test_h3_a_confirmation_in_words_is_part_of_the_content() -> None:
    """It is on record, too (R1)."""
    world = settled()
    world.write(TAG, 30.0, key="7")
    assert world.write(TAG, 30.0, key="7", confirm="it may break").cause is Cause.DUPLICATE
    assert [e.get("confirm") for e in world.journal if e["kind"] == "outcome"] == [None, "it may break"]


def test_ids_in_an_older_journal_have_no_content_and_are_repetitions() -> None:
    world = settled()
    world.write(TAG, 30.0, key="7")
    memory = world.memory()
    for attempt in memory.attempts.sent.values():
        attempt.content = ""
    assert isinstance(memory.attempts, Attempts)
    again = World(memory=memory)
    again.run(2.0)
    assert again.write(TAG, 30.0, key="7").verdict is Verdict.CONFIRMED
    assert not again.sent()
