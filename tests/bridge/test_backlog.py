"""What waits for a watcher is bounded and keeps the latest."""

from gateway.bridge.api import Batch, DriveState, Happened, Periods
from gateway.bridge.backlog import MAX_BATCHES, MAX_EVENTS, Backlog
from gateway.tag import Event, Quality, Sample


def sample(tag: str, value: int) -> Sample:
    return Sample(tag, value, Quality.GOOD, value)


def drain(backlog: Backlog) -> list[object]:
    found = []
    while (update := backlog.take()) is not None:
        found.append(update)
    return found


def test_a_watcher_that_keeps_up_gets_every_batch_apart() -> None:
    backlog = Backlog()
    batches = [Batch(n, (sample("a", n),)) for n in range(MAX_BATCHES)]
    for batch in batches:
        backlog.put(batch)
    assert drain(backlog) == batches


def test_a_watcher_that_falls_behind_gets_the_latest_of_each_tag_and_the_count_of_the_rest() -> None:
    backlog = Backlog()
    for n in range(10_000):
        backlog.put(Batch(n, (sample("a", n), sample(f"b{n % 7}", n))))
    left = drain(backlog)
    assert len(left) <= MAX_BATCHES + 1
    latest = {s.tag: s.value for batch in left for s in batch.samples}
    assert latest == {"a": 9999} | {f"b{n % 7}": n for n in range(9993, 10_000)}
    assert sum(len(batch.samples) + batch.skipped for batch in left) == 20_000


def test_drive_states_come_before_samples_and_only_the_last_of_each_drive() -> None:
    backlog = Backlog()
    backlog.put(Batch(1, (sample("a", 1),)))
    backlog.put(DriveState("fan-1", True, 1))
    backlog.put(DriveState("fan-1", False, 2, "silent"))
    assert drain(backlog) == [DriveState("fan-1", False, 2, "silent"), Batch(1, (sample("a", 1),))]


def test_periods_are_merged_and_events_bounded() -> None:
    backlog = Backlog()
    backlog.put(Periods({"a": 1.0}))
    backlog.put(Periods({"a": 2.0, "b": 3.0}))
    for n in range(MAX_EVENTS + 10):
        backlog.put(Happened(Event(time=n, drive="fan-1", name="fault_raised", text="")))
    periods, *events = drain(backlog)
    assert periods == Periods({"a": 2.0, "b": 3.0})
    assert [e.event.time for e in events] == list(range(10, MAX_EVENTS + 10))
