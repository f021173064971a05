"""The cheapest reads, against brute force; stretching; promised ages."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from time import process_time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.line.elastic import CAPACITY, MOST, factors_for, fit
from gateway.line.interface import Plan, UnitFacts, Want
from gateway.line.plan import best_drafts, make_drafts, make_plan
from gateway.line.requests import may_read
from gateway.mapping.profile import Table
from tests.line.bench import CHARACTER, SILENCE, Bench, FakeUnit, facts, seeded


def cost(unit: int, count: int) -> float:
    return (13 + 2 * count) * CHARACTER + 0.005 + SILENCE


def plan_of(*wants: Want, **unit) -> Plan:
    return make_plan(wants, {5: facts(**unit)}, cost)


def spans(plan: Plan) -> list[tuple[int, int, float]]:
    return sorted((block.address, block.count, block.period) for block in plan.blocks)


def test_seventeen_registers_of_a_7200gs_in_four_reads() -> None:
    addresses = [*range(0x20, 0x25), *range(0x27, 0x2E), *range(0x31, 0x34), 1, 2]
    plan = plan_of(*(Want(5, a, 1, 10.0) for a in addresses))
    assert spans(plan) == [(0x01, 2, 10.0), (0x20, 5, 10.0), (0x27, 7, 10.0), (0x31, 3, 10.0)]


def test_holes_are_never_read_but_gaps_may_be_bridged() -> None:
    wants = [Want(5, 0x24, 1, 10.0), Want(5, 0x27, 1, 10.0)]
    assert len(plan_of(*wants).blocks) == 2
    assert spans(plan_of(*wants, bridge=True)) == [(0x24, 4, 10.0)]
    assert len(plan_of(*wants, bridge=True, holes=((0x25, 0x26),)).blocks) == 2


def test_a_gap_is_read_only_where_that_is_cheaper() -> None:
    far = {"readable": ((0x00, 0x7F),), "read_max": 125}
    assert len(plan_of(Want(5, 0, 1, 10.0), Want(5, 10, 1, 10.0), **far).blocks) == 1
    assert len(plan_of(Want(5, 0, 1, 10.0), Want(5, 20, 1, 10.0), **far).blocks) == 2


def test_slow_wants_ride_along() -> None:
    plan = plan_of(Want(5, 0x20, 1, 0.2), Want(5, 0x24, 1, 0.2), Want(5, 0x23, 1, 30.0))
    assert spans(plan) == [(0x20, 5, 0.2)]
    assert plan.period(5, 0x23, 1) == 0.2


def test_a_neighbour_joins_a_faster_block_where_that_saves_line_time() -> None:
    assert spans(plan_of(Want(5, 0x24, 1, 0.5), Want(5, 0x23, 1, 1.0))) == [(0x23, 2, 0.5)]
    assert len(plan_of(Want(5, 0x24, 1, 0.5), Want(5, 0x23, 1, 30.0)).blocks) == 2


def test_h15_values_of_two_registers_are_never_cut() -> None:
    wants = [Want(5, a, 2, 10.0) for a in range(0, 12, 2)]
    plan = plan_of(*wants, readable=((0, 20),), read_max=5)
    for want in wants:
        assert plan.period(5, want.address, 2) == 10.0


def test_tables_are_read_apart() -> None:
    wants = [Want(5, 0x20, 1, 1.0), Want(5, 0x21, 1, 1.0, table=Table.INPUT)]
    plan = plan_of(*wants, functions=(3, 4))
    assert {(block.table, block.address) for block in plan.blocks} == {
        (Table.HOLDING, 0x20),
        (Table.INPUT, 0x21),
    }
    assert plan.period(5, 0x20, 1, Table.INPUT) is None


def partitions(items: list[Want]) -> Iterator[list[list[Want]]]:
    if not items:
        yield []
        return
    first, *rest = items
    for part in partitions(rest):
        yield [[first], *part]
        for i, group in enumerate(part):
            yield [*part[:i], [first, *group], *part[i + 1 :]]


def cheapest(wants: list[Want], unit: UnitFacts) -> float:
    """The least load of the line, over every way to share the wants among blocks."""
    best = float("inf")
    for partition in partitions(wants):
        total = 0.0
        for group in partition:
            first = min(want.address for want in group)
            count = max(want.address + want.count for want in group) - first
            often = min(want.period for want in group)
            total += cost(5, count) / often if may_read(unit, first, count) else float("inf")
        best = min(best, total)
    return best


units = st.builds(
    lambda split, top, bridge, most, hole: facts(
        readable=((0, split), (split + 3, top)), bridge=bridge, read_max=most, holes=((hole, hole),)
    ),
    st.integers(4, 14),
    st.integers(30, 45),
    st.booleans(),
    st.integers(3, 40),
    st.integers(0, 45),
)


periods = st.sampled_from([0.2, 0.3, 1.0, 30.0])


@st.composite
def apart(draw: st.DrawFn) -> list[Want]:
    """Wants of several periods; some for part of the registers of another that is wanted as often."""
    wants: list[Want] = []
    address = 0
    for gap, count in draw(
        st.lists(st.tuples(st.integers(0, 12), st.integers(1, 3)), min_size=1, max_size=5)
    ):
        address += gap
        wants.append(Want(5, address, count, draw(periods)))
        if len(wants) < 7 and draw(st.integers(0, 4)) == 0:
            slower = draw(periods.filter(lambda period, wants=wants: period >= wants[-1].period))
            wants.append(Want(5, address, draw(st.integers(1, count)), slower))
        address += count
    return draw(st.permutations(wants))


@settings(max_examples=400, deadline=None)
@given(units, apart())
def test_the_plan_is_as_cheap_as_brute_force(unit: UnitFacts, wants: list[Want]) -> None:
    legal = [want for want in wants if may_read(unit, want.address, want.count)]
    drafts = make_drafts(legal, {5: unit}, cost)
    assert sum(draft.load for draft in drafts) == pytest.approx(cheapest(legal, unit) if legal else 0.0)


def test_a_slow_block_reaches_across_a_fast_one() -> None:
    wants = [Want(5, 0x20, 1, 10.0), Want(5, 0x22, 1, 0.2), Want(5, 0x24, 1, 10.0)]
    assert spans(plan_of(*wants)) == [(0x20, 5, 10.0), (0x22, 1, 0.2)]


@pytest.mark.parametrize("registers", [16, 125])
def test_two_thousand_wants_are_planned_at_once(registers: int) -> None:
    """The core plans in its loop. The processor's time is measured, with much room for a slow machine: this
    is done in some 30 ms; a search whose time grows with the cube of the blocks would take minutes."""
    draw = seeded(7)
    unit = facts(readable=((0, 0x1FFF),), read_max=registers, bridge=True)
    rates = [draw.choice([0.2, 1.0, 30.0]) for _ in range(25) for _ in range(10)]
    wants = [Want(u, 2 * n, 1, rates[n - n % 10]) for u in range(1, 9) for n in range(250)]
    units_ = {u: replace(unit, unit=u) for u in range(1, 9)}
    began = process_time()
    plan = make_plan(wants, units_, cost)
    assert process_time() - began < 1.0
    assert plan.stretch > 1
    began = process_time()
    make_plan([*wants, Want(3, 501, 1, 0.2)], units_, cost)  # a changed demand concerns its own unit only
    assert process_time() - began < 0.5


@settings(max_examples=150, deadline=None)
@given(units, st.data())
def test_every_want_is_met_within_the_drives_limits(unit: UnitFacts, data: st.DataObject) -> None:
    one = st.builds(
        lambda a, c, p, r: Want(5, a, c, p, r),
        st.integers(0, 40),
        st.integers(1, 3),
        st.sampled_from([0.1, 0.2, 1.0, 30.0]),
        st.integers(0, 2),
    )
    legal = one.filter(lambda want: may_read(unit, want.address, want.count))
    wants = data.draw(st.lists(legal, max_size=25))
    plan = make_plan(wants, {5: unit}, cost)
    for block in plan.blocks:
        assert may_read(unit, block.address, block.count)
        assert block.worst_age >= block.period
    for want in wants:
        period = plan.period(5, want.address, want.count)
        assert period is not None
        assert period <= want.period * plan.stretch * 1.000001
    assert plan.load <= CAPACITY + 1e-9
    if plan.stretch == 1:
        assert all(plan.period(5, w.address, w.count) <= w.period for w in wants)  # type: ignore[operator]


def test_rank_0_stretches_last() -> None:
    wants = [Want(u, 0x20, 5, 0.2, 0) for u in (1, 2, 3)] + [Want(u, 0x31, 3, 0.2, 2) for u in (1, 2, 3, 4)]
    plan = make_plan(wants, {u: facts(u) for u in (1, 2, 3, 4)}, cost)
    fast = {block.period for block in plan.blocks if block.address == 0x20}
    slow = {block.period for block in plan.blocks if block.address == 0x31}
    assert fast == {0.2}
    assert min(slow) > 0.2
    assert plan.stretch == pytest.approx(max(slow) / 0.2)
    assert plan.load == pytest.approx(CAPACITY)


ranked = st.builds(
    lambda unit, address, at: Want(unit, address, 1, (0.05, 0.3, 0.5, 2.0)[at], (0, 1, 1, 2)[at]),
    st.integers(1, 6),
    st.integers(0, 40),
    st.integers(0, 3),
)
"""Classes as the core makes them: the slower, the higher the rank; two classes of one rank."""


@settings(max_examples=200, deadline=None)
@given(st.lists(ranked, min_size=1, max_size=60))
def test_fast_classes_stretch_last_and_none_more_than_is_needed(wants: list[Want]) -> None:
    known = {u: facts(u, readable=((0, 63),), bridge=True) for u in range(1, 7)}
    drafts = best_drafts(wants, known, cost)
    factors = factors_for(drafts)
    by_rank = [factors[rank] for rank in sorted(factors)]
    assert all(fast <= slow + 1e-9 for fast, slow in pairwise(by_rank))
    for fast, slow in pairwise(by_rank):
        assert fast <= 1 + 1e-9 or slow >= MOST - 1e-9  # the slower class has given all that it has to give
    for draft, block in zip(drafts, fit(drafts).blocks, strict=True):
        assert block.period == pytest.approx(draft.period * factors[draft.rank])  # alike within a rank
    load = sum(draft.load / factors[draft.rank] for draft in drafts)
    assert load == pytest.approx(CAPACITY) if max(by_rank) > 1 else load <= CAPACITY + 1e-9


@settings(max_examples=100, deadline=None)
@given(st.lists(ranked, min_size=20, max_size=60))
def test_blocks_for_stretched_periods_let_the_fast_class_give_way_less(wants: list[Want]) -> None:
    known = {u: facts(u, readable=((0, 63),), bridge=True) for u in range(1, 7)}
    plain = factors_for(make_drafts(wants, known, cost))
    best = factors_for(best_drafts(wants, known, cost))
    assert [best.get(r, 1.0) for r in (0, 1, 2)] <= [plain.get(r, 1.0) for r in (0, 1, 2)]
    plan = make_plan(wants, known, cost)
    for want in wants:
        period = plan.period(want.unit, want.address, want.count)
        assert period is not None
        # a class that comes along with the others entirely gives way no more than the last of them has to
        assert period <= want.period * best.get(want.rank, max(best.values())) * (1 + 1e-9)


def test_a_slow_value_leaves_the_fast_block_when_it_may_come_later() -> None:
    """0021H comes along with 0024H every 300 ms for less than a read of its own every second; where that is
    stretched to 10 s, it would make the fast block longer for nothing."""
    wants = [Want(u, a, 1, p, r) for u in range(1, 11) for a, p, r in ((0x21, 1.0, 2), (0x24, 0.3, 0))]
    known = {u: facts(u) for u in range(1, 11)}
    assert {block.count for block in make_drafts(wants, known, cost)} == {4}
    assert {block.count for block in make_plan(wants, known, cost).blocks} == {1}


def test_hopeless_demands_stretch_everything() -> None:
    wants = [Want(u, 0x20, 5, 0.001, u % 3) for u in range(1, 32)]
    plan = make_plan(wants, {u: facts(u) for u in range(1, 32)}, cost)
    assert plan.load == pytest.approx(CAPACITY)
    order = [block.period for rank in (0, 1, 2) for block in plan.blocks if block.unit % 3 == rank]
    assert all(a <= b + 1e-9 for a, b in pairwise(order))


def test_thirty_one_drives_at_2400_baud_cannot_be_fed_within_two_seconds() -> None:
    slow = lambda unit, count: (13 + 2 * count) * 11 / 2400 + 0.02 + 3.5 * 11 / 2400  # noqa: E731
    wants = [Want(u, 0x20, 5, 2.0) for u in range(1, 32)]
    plan = make_plan(wants, {u: facts(u) for u in range(1, 32)}, slow)
    assert plan.stretch > 2


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.tuples(st.integers(1, 4), st.sampled_from([0x01, 0x20, 0x27, 0x31])), max_size=10), st.data()
)
def test_promised_ages_hold_in_virtual_time(places: list[tuple[int, int]], data: st.DataObject) -> None:
    periods = st.sampled_from([0.1, 0.15, 0.3, 1.0])
    promised_ages_hold([Want(u, a, 2, data.draw(periods), data.draw(st.integers(0, 2))) for u, a in places])


@pytest.mark.parametrize("slow", [1.0, 3.0])
def test_promised_ages_hold_on_a_line_that_stretches_periods(slow: float) -> None:
    fast = [Want(u, 0x01, 2, 0.1, rank) for u, rank in ((1, 0), (2, 2))]
    more = [Want(1, 0x20, 2, 0.15, 0), Want(3, 0x01, 2, 0.3, 2), Want(4, 0x01, 2, 0.3, 2)]
    promised_ages_hold([*fast, *more, Want(1, 0x27, 2, slow, 0), Want(1, 0x31, 2, slow, 0)])


def test_what_once_disturbed_a_full_line_breaks_no_promise_for_good() -> None:
    """The line listens a moment behind the first answer of each unit; what was lost by that stayed lost."""
    fast = [
        Want(u, a, 2, 0.1, rank) for u, a, rank in ((3, 0x27, 0), (3, 0x20, 0), (1, 0x01, 0), (3, 0x01, 2))
    ]
    slow = [Want(u, 0x01, 2, 1.0, 0) for u in (2, 3, 4)]
    promised_ages_hold([*fast, *slow, Want(1, 0x20, 2, 1.0, 1), Want(1, 0x27, 2, 0.15, 2)])


def promised_ages_hold(wants: list[Want]) -> None:
    bench = Bench([facts(u) for u in range(1, 5)], [FakeUnit(u) for u in range(1, 5)]).start(*wants)
    bench.run(20)
    plan = bench.line.plan
    longest = max((block.period for block in plan.blocks), default=0.0)
    start = bench.now
    bench.run(15 + 3 * longest)
    assert bench.line.plan is plan
    for block in plan.blocks:
        ends = [
            at
            for at, a in bench.log
            if at > start - 5
            and getattr(a, "words", None) is not None
            and (a.unit, a.address) == (block.unit, block.address)
        ]
        assert len(ends) >= 3
        # from when a value was on the wire until its successor is complete
        assert max(b - a for a, b in pairwise(ends)) + block.cost <= block.worst_age + 1e-6
