"""One decision at a time: order, deadlines, phase, and nobody starves."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.line.interface import Block, Job, Plan, Priority, Read, Transmit, Want, Write
from gateway.line.schedule import Due, Probe, Schedule, Waiting, settle
from tests.line.bench import Bench, FakeUnit, facts

NEVER_DOWN = lambda unit: -math.inf  # noqa: E731


def plan(*blocks: Block, stretch: float = 1.0) -> Plan:
    return Plan(blocks, sum(block.cost / block.period for block in blocks), stretch)


def block(unit: int, period: float, cost: float = 0.03) -> Block:
    return Block(unit, 0x20, 5, period, cost, 2 * period)


def write(
    job_id: int, priority: Priority = Priority.COMMAND, unit: int = 1, deadline: float | None = None
) -> Job:
    return Job(job_id, Write(unit, 2, (job_id,)), priority, deadline)


def schedule_of(*blocks: Block) -> Schedule:
    schedule = Schedule()
    schedule.replan(plan(*blocks), 0.0, 0.0)
    return schedule


def test_order_of_the_four_classes() -> None:
    schedule = schedule_of(block(1, 1.0))
    for job in (write(1, Priority.PROBE), write(2), write(3, Priority.STOP)):
        schedule.ask(job, 0.0)
    seen = []
    for _ in range(4):
        choice = schedule.choose(0.0, NEVER_DOWN)
        if isinstance(choice, Waiting):
            seen.append(choice.job.priority.name)
            schedule.withdraw(choice.job.id)
        elif isinstance(choice, Due):
            seen.append("due")
            settle(choice, 0.0)
    assert seen == ["STOP", "COMMAND", "due", "PROBE"]
    assert schedule.choose(0.0, NEVER_DOWN) is None


def test_h20_stops_of_a_sick_unit_keep_no_other_stop_waiting() -> None:
    """Found by a world in a box (`python -m tests.prove`)."""
    schedule = schedule_of()
    for job in range(4):
        schedule.ask(write(job, Priority.STOP, unit=1), 0.0)
    schedule.ask(write(9, Priority.STOP, unit=2), 0.5)
    order = []
    for _ in range(3):
        choice = schedule.choose(1.0, NEVER_DOWN)
        assert isinstance(choice, Waiting)
        order.append(choice.unit)
        schedule.withdraw(choice.job.id)
        schedule.spent(choice, 1.0)
    assert order == [1, 2, 1]


def test_h20_a_changed_demand_sends_nothing_before_what_may_be_asked_with_it() -> None:
    """Found by a world in a box (`python -m tests.prove`): the end of a proof let a read go before a stop."""
    bench = Bench([facts(functions=(3, 16))], [FakeUnit(functions=(3, 16))]).start(Want(5, 0x20, 1, 10.0))
    bench.run(2.0)
    actions = bench.line.demand([Want(5, 0x20, 2, 10.0)], bench.now)
    assert not [action for action in actions if isinstance(action, Transmit)]
    actions = bench.line.ask(Job(1, Write(5, 2, (0,)), Priority.STOP), bench.now)
    [sent] = [action for action in actions if isinstance(action, Transmit)]
    assert sent.data[1] == 0x10


def test_the_earliest_deadline_goes_first() -> None:
    schedule = schedule_of(block(1, 5.0), block(2, 0.2), block(3, 1.0))
    order = []
    for _ in range(3):
        due = schedule.choose(0.0, NEVER_DOWN)
        assert isinstance(due, Due)
        order.append(due.unit)
        settle(due, 0.0)
    assert order == [2, 3, 1]


def test_phase_is_kept_and_missed_periods_are_left_out() -> None:
    due = Due(block(1, 1.0), 10.0, 1.0)
    settle(due, 10.03)
    assert due.at == 11.0
    settle(due, 12.4)
    assert due.at == 12.0, "one read is made up for"
    settle(due, 17.3)
    assert due.at == 17.0, "more are not"


def test_a_stop_goes_to_a_unit_that_is_down_and_nothing_else_does() -> None:
    schedule = schedule_of(block(1, 1.0))
    schedule.ask(write(1), 0.0)
    schedule.ask(Job(2, Read(1, 2, 1), Priority.READ), 0.0)
    down = lambda unit: math.inf  # noqa: E731
    assert schedule.choose(0.0, down) is None
    assert schedule.wake(-math.inf, down) == math.inf
    schedule.ask(write(3, Priority.STOP), 0.0)
    choice = schedule.choose(0.0, down)
    assert isinstance(choice, Waiting)
    assert choice.job.id == 3
    assert schedule.wake(-math.inf, down) == -math.inf


def test_jobs_expire_at_their_deadline() -> None:
    schedule = schedule_of()
    schedule.ask(write(1, deadline=5.0), 0.0)
    schedule.ask(write(2), 0.0)
    assert schedule.wake(-math.inf, lambda unit: math.inf) == 5.0
    assert schedule.expired(4.999) == []
    assert [job.id for job in schedule.expired(5.0)] == [1]
    assert [job.id for job in schedule.drain()] == [2]


def test_a_probe_waits_for_reads_but_not_for_ever() -> None:
    schedule = schedule_of(block(1, 0.1))
    assert isinstance(schedule.choose(0.0, NEVER_DOWN, Probe(9, 0.0)), Due)
    for due in schedule._reads:
        due.at = 0.7
    assert isinstance(schedule.choose(0.6, NEVER_DOWN, Probe(9, 0.0)), Probe)
    assert schedule.choose(0.6, NEVER_DOWN, Probe(9, 0.61)) is None
    assert isinstance(schedule.choose(0.75, NEVER_DOWN, Probe(9, 0.0)), Probe)


def test_a_new_plan_keeps_phases() -> None:
    schedule = schedule_of(block(1, 1.0), block(2, 1.0))
    due = schedule.choose(0.0, NEVER_DOWN)
    assert isinstance(due, Due)
    settle(due, 0.0)
    schedule.replan(plan(block(1, 1.0), block(3, 1.0)), 0.0, 0.5)
    assert schedule.choose(0.5, NEVER_DOWN).unit == 3
    assert {entry.unit: entry.at for entry in schedule._reads} == {1: 1.0, 3: 0.5}


def test_a_shorter_period_counts_at_once() -> None:
    schedule = schedule_of(block(1, 30.0))
    settle(schedule._reads[0], 0.0)
    schedule.replan(plan(block(1, 0.2)), 0.0, 1.0)
    assert schedule._reads[0].at == 1.2


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.05, 3.0), st.floats(0.01, 0.08)), min_size=1, max_size=12),
    st.lists(st.floats(0.0, 20.0), max_size=40),
)
def test_nobody_starves_and_writes_wait_a_bounded_time(
    reads: list[tuple[float, float]], asked: list[float]
) -> None:
    blocks = [block(u, period, cost) for u, (period, cost) in enumerate(reads, 1)]
    load = sum(b.cost / b.period for b in blocks)
    stretch = max(1.0, load / 0.97)
    blocks = [Block(b.unit, 1, 1, b.period * stretch, b.cost, 0.0) for b in blocks]
    schedule = Schedule()
    stretched = plan(*blocks, stretch=stretch)
    schedule.replan(stretched, stretched.load, 0.0)
    pending = sorted(asked)
    now, served, waits = 0.0, dict.fromkeys(range(1, len(blocks) + 1), 0.0), []
    longest = max(b.cost for b in blocks)
    worst = dict.fromkeys(served, 0.0)
    while now < 25:
        while pending and pending[0] <= now:
            schedule.ask(write(len(pending)), pending.pop(0))
        choice = schedule.choose(now, NEVER_DOWN)
        if choice is None:
            upcoming = [schedule.wake(-math.inf, NEVER_DOWN), *pending[:1]]
            now = max(now, min(upcoming))
            continue
        cost = 0.03 if isinstance(choice, Waiting) else choice.block.cost
        now += cost
        schedule.spent(choice, cost)
        if isinstance(choice, Waiting):
            waits.append(now - choice.asked)
            schedule.withdraw(choice.job.id)
        else:
            worst[choice.unit] = max(worst[choice.unit], now - served[choice.unit])
            served[choice.unit] = now
            settle(choice, now)
    # one transaction on the wire; before each older write, as much reading as that write took and one more
    assert all(wait <= longest + (len(asked) + 1) * (0.03 + 0.03 + longest) for wait in waits)
    assert len(waits) == len(asked)
    writing = 0.03 * len(asked)
    for b in blocks:
        assert worst[b.unit] <= 2 * b.period + sum(x.cost for x in blocks) + 2 * writing + 0.1


def test_nothing_is_due_before_the_floor() -> None:
    schedule = schedule_of(block(1, 10.0), block(2, 20.0))
    assert schedule.wake(3.0, NEVER_DOWN) == 3.0
    while isinstance(due := schedule.choose(0.0, NEVER_DOWN), Due):
        settle(due, 0.0)
    assert schedule.wake(3.0, NEVER_DOWN) == 10.0
    assert schedule.wake(15.0, NEVER_DOWN) == 15.0
