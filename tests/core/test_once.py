"""H3: a command that comes twice is carried out once."""

from gateway.core.once import KEEP, Once
from gateway.tag import Outcome, Verdict

DONE = Outcome(verdict=Verdict.CONFIRMED)


def test_duplicates_wait_for_the_first_ones_outcome_and_later_ones_get_it_at_once() -> None:
    once = Once()
    assert once.first(("mqtt", "7"), (1, 10))
    assert not once.first(("mqtt", "7"), (1, 11))
    assert once.outcome(("mqtt", "7")) is None
    assert once.finish(("mqtt", "7"), DONE) == [(1, 11)]
    assert not once.first(("mqtt", "7"), (2, 12))
    assert once.outcome(("mqtt", "7")) == DONE


def test_the_same_id_by_another_way_in_is_another_command() -> None:
    once = Once()
    assert once.first(("mqtt", "7"), (1, 1))
    assert once.first(("cli", "7"), (2, 1))


def test_memory_is_bounded_and_what_is_under_way_is_never_forgotten() -> None:
    once = Once()
    once.first(("mqtt", "long"), (1, 1))
    for n in range(KEEP + 5):
        once.first(("mqtt", str(n)), (1, n))
        once.finish(("mqtt", str(n)), DONE)
    assert once.first(("mqtt", "0"), (1, 1)), "the oldest was forgotten"
    assert not once.first(("mqtt", "long"), (1, 2))
