"""Demands come, change and go with their clients."""

from hypothesis import given
from hypothesis import strategies as st

from gateway.core.demands import Demands


def test_the_shortest_period_counts_and_its_end_gives_way_to_the_next() -> None:
    demands = Demands()
    assert demands.change(1, {"a": 1.0})
    assert demands.change(2, {"a": 0.2})
    assert not demands.change(3, {"a": 5.0})
    assert demands.period("a") == 0.2
    assert demands.leave(2)
    assert demands.period("a") == 1.0
    assert set(demands.sessions("a")) == {1, 3}


def test_the_cores_own_wants_are_nobody_to_tell() -> None:
    demands = Demands()
    demands.change("core", {"a": 1.0})
    assert demands.sessions("a") == ()
    assert dict(demands.tags_of("a")) == {"a": 1.0}


changes = st.lists(
    st.tuples(
        st.integers(1, 4),
        st.one_of(st.none(), st.dictionaries(st.sampled_from("abc"), st.none() | st.floats(0.01, 10))),
    )
)


@given(changes)
def test_demands_are_exactly_what_the_clients_last_said(
    steps: list[tuple[int, dict[str, float | None] | None]],
) -> None:
    demands = Demands()
    model: dict[int, dict[str, float]] = {}
    for client, wants in steps:
        before = {tag: demands.period(tag) for tag in "abc"}
        if wants is None:
            changed = demands.leave(client)
            model.pop(client, None)
        else:
            changed = demands.change(client, wants)
            mine = model.setdefault(client, {})
            for tag, period in wants.items():
                mine.pop(tag, None)
                if period is not None:
                    mine[tag] = period
        assert set(changed) == {tag for tag in "abc" if demands.period(tag) != before[tag]}
    for tag in "abc":
        assert demands.period(tag) == min((m[tag] for m in model.values() if tag in m), default=None)
        assert set(demands.sessions(tag)) == {client for client, m in model.items() if tag in m}
    for tag in "abc":
        assert dict(demands.tags_of(tag)) == ({tag: demands.period(tag)} if demands.period(tag) else {})
