"""H3: a command that comes twice is carried out once, over restarts too."""

from gateway.core.attempts import Attempt, Attempts, key
from gateway.core.once import KEEP, Once
from gateway.tag import Cause, Outcome, Verdict

DONE = Outcome(verdict=Verdict.CONFIRMED, sent=1)
WHAT = "content"
REFUSED = Outcome(verdict=Verdict.REFUSED, cause=Cause.OUT_OF_RANGE)


def test_h3_duplicates_wait_for_the_first_ones_outcome_and_later_ones_get_it_at_once() -> None:
    once = Once()
    assert once.first(("mqtt", "7"), WHAT, (1, 10))
    assert not once.first(("mqtt", "7"), WHAT, (1, 11))
    assert once.outcome(("mqtt", "7")) is None
    assert once.finish(("mqtt", "7"), DONE, 0.0, 5.0) == [(1, 11)]
    assert not once.first(("mqtt", "7"), WHAT, (2, 12))
    assert once.outcome(("mqtt", "7")) == DONE


def test_h3_the_same_id_by_another_way_in_is_another_command() -> None:
    once = Once()
    assert once.first(("mqtt", "7"), WHAT, (1, 1))
    assert once.first(("cli", "7"), WHAT, (2, 1))


def test_h3_an_id_is_remembered_for_its_time_whatever_comes() -> None:
    once = Once()
    once.first(("mqtt", "long"), WHAT, (1, 1))
    for n in range(KEEP - 1):
        assert once.room(float(n) / KEEP)
        once.first(("mqtt", str(n)), WHAT, (1, n))
        once.finish(("mqtt", str(n)), DONE, float(n) / KEEP, 8.0)
    once.first(("mqtt", "one too many"), WHAT, (1, 1))
    assert not once.room(79.9), "the oldest is 79.9 s old; it was to live for 8 s"
    assert not once.first(("mqtt", "0"), WHAT, (1, 1))
    assert once.room(80.0)
    assert once.first(("mqtt", "0"), WHAT, (1, 1)), "the oldest was forgotten"
    assert not once.first(("mqtt", "long"), WHAT, (1, 2)), "what is under way is never forgotten"


def test_h3_a_flood_of_refused_commands_pushes_out_nothing_that_was_sent() -> None:
    once = Once()
    once.first(("mqtt", "sent"), WHAT, (1, 1))
    once.finish(("mqtt", "sent"), DONE, 0.0, 5.0)
    for n in range(2 * KEEP):
        once.first(("mqtt", str(n)), WHAT, (1, n))
        once.finish(("mqtt", str(n)), REFUSED, 0.0, 5.0)
    assert once.room(1.0)
    assert not once.first(("mqtt", "sent"), WHAT, (1, 2))
    assert once.first(("mqtt", "0"), WHAT, (1, 2)), "memory is bounded"


def test_h3_ids_of_earlier_runs_are_known_and_what_had_no_outcome_is_unknown() -> None:
    once = Once()
    sent = {key("mqtt", "done"): Attempt(at=1.0, outcome=DONE), key("mqtt", "open"): Attempt(at=2.0)}
    unsent = {key("mqtt", "refused"): Attempt(at=1.5, outcome=REFUSED)}
    once.restore(Attempts(sent=sent, unsent=unsent), 10.0)
    assert once.outcome(("mqtt", "done")) == DONE
    assert once.outcome(("mqtt", "refused")) == REFUSED
    unknown = once.outcome(("mqtt", "open"))
    assert unknown is not None
    assert unknown.verdict is Verdict.UNKNOWN
    assert not once.first(("mqtt", "open"), WHAT, (1, 1))


def test_h3_an_id_is_another_command_only_after_a_while() -> None:
    once, way = Once(), ("mqtt", "7")
    once.first(way, WHAT, (1, 1))
    assert not once.used_otherwise(way, WHAT, 900.0)
    assert not once.first(way, WHAT, (1, 2)), "it is under way"
    once.finish(way, DONE, 900.0, 5.0)
    assert not once.used_otherwise(way, WHAT, 959.9)
    assert not once.first(way, WHAT, (1, 3))
    assert not once.used_otherwise(way, WHAT, 960.0)
    assert once.first(way, WHAT, (1, 4))


def test_h3_something_else_under_an_id_that_is_remembered_is_no_repetition() -> None:
    once, way = Once(), ("mqtt", "7")
    once.first(way, WHAT, (1, 1))
    assert once.used_otherwise(way, "something else", 0.0)
    once.finish(way, DONE, 0.0, 5.0)
    assert once.used_otherwise(way, "something else", 59.9)
    assert not once.used_otherwise(way, "something else", 60.0)


def test_h3_the_time_of_an_id_without_outcome_begins_with_the_restart() -> None:
    once, way = Once(), ("mqtt", "open")
    once.restore(Attempts(sent={key(*way): Attempt(at=2.0, content=WHAT)}), 1000.0)
    assert not once.used_otherwise(way, WHAT, 1059.9)
    assert not once.first(way, WHAT, (1, 1))
