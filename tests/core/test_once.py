"""H3: a command that comes twice is carried out once, over restarts too."""

from gateway.core.attempts import Attempt, Attempts, key
from gateway.core.once import KEEP, Once
from gateway.tag import Cause, Outcome, Verdict

DONE = Outcome(verdict=Verdict.CONFIRMED, sent=1)
REFUSED = Outcome(verdict=Verdict.REFUSED, cause=Cause.OUT_OF_RANGE)


def test_h3_duplicates_wait_for_the_first_ones_outcome_and_later_ones_get_it_at_once() -> None:
    once = Once()
    assert once.first(("mqtt", "7"), (1, 10))
    assert not once.first(("mqtt", "7"), (1, 11))
    assert once.outcome(("mqtt", "7")) is None
    assert once.finish(("mqtt", "7"), DONE, 0.0, 5.0) == [(1, 11)]
    assert not once.first(("mqtt", "7"), (2, 12))
    assert once.outcome(("mqtt", "7")) == DONE


def test_h3_the_same_id_by_another_way_in_is_another_command() -> None:
    once = Once()
    assert once.first(("mqtt", "7"), (1, 1))
    assert once.first(("cli", "7"), (2, 1))


def test_h3_an_id_is_remembered_for_ten_times_its_time_to_live_whatever_comes() -> None:
    once = Once()
    once.first(("mqtt", "long"), (1, 1))
    for n in range(KEEP - 1):
        assert once.room(float(n) / KEEP)
        once.first(("mqtt", str(n)), (1, n))
        once.finish(("mqtt", str(n)), DONE, float(n) / KEEP, 5.0)
    once.first(("mqtt", "one too many"), (1, 1))
    assert not once.room(49.9), "the oldest is 49.9 s old; it was to live for 5 s"
    assert not once.first(("mqtt", "0"), (1, 1))
    assert once.room(50.0)
    assert once.first(("mqtt", "0"), (1, 1)), "the oldest was forgotten"
    assert not once.first(("mqtt", "long"), (1, 2)), "what is under way is never forgotten"


def test_h3_a_flood_of_refused_commands_pushes_out_nothing_that_was_sent() -> None:
    once = Once()
    once.first(("mqtt", "sent"), (1, 1))
    once.finish(("mqtt", "sent"), DONE, 0.0, 5.0)
    for n in range(2 * KEEP):
        once.first(("mqtt", str(n)), (1, n))
        once.finish(("mqtt", str(n)), REFUSED, 0.0, 5.0)
    assert once.room(1.0)
    assert not once.first(("mqtt", "sent"), (1, 2))
    assert once.first(("mqtt", "0"), (1, 2)), "memory is bounded"


def test_h3_ids_of_earlier_runs_are_known_and_what_had_no_outcome_is_unknown() -> None:
    once = Once()
    sent = {key("mqtt", "done"): Attempt(at=1.0, outcome=DONE), key("mqtt", "open"): Attempt(at=2.0)}
    once.restore(Attempts(sent=sent, unsent={key("mqtt", "refused"): Attempt(at=1.5, outcome=REFUSED)}))
    assert once.outcome(("mqtt", "done")) == DONE
    assert once.outcome(("mqtt", "refused")) == REFUSED
    unknown = once.outcome(("mqtt", "open"))
    assert unknown is not None
    assert unknown.verdict is Verdict.UNKNOWN
    assert not once.first(("mqtt", "open"), (1, 1))
