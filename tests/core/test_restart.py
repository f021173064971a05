"""What the gateway remembers over a restart (H3, R1): a second world takes up the journal of a first one."""

from __future__ import annotations

import pytest

import tests.core.world as world_
from gateway.tag import Cause, Verdict
from tests.core.world import World


def test_h3_a_duplicate_after_a_restart_gets_the_first_ones_outcome() -> None:
    first = World()
    outcome = first.command("run_forward", key="a1", frequency=20.0)
    refused = first.write("fan-1.frequency_command", 99.0, key="a2")
    second = World(memory=first.memory())
    assert second.ask_command("run_forward", key="a1", frequency=20.0)() == outcome
    assert second.ask_write("fan-1.frequency_command", 99.0, key="a2")() == refused
    assert second.sent() == []


def test_h3_what_was_on_record_and_has_no_outcome_is_unknown_and_never_sent_again() -> None:
    first = World()
    first.run(1.0)
    first.ask_command("run_forward", key="a1", frequency=20.0)
    first.until(lambda: [e for e in first.journal if e["kind"] == "intent"] or None, 5.0)
    second = World(memory=first.memory())
    again = second.command("run_forward", key="a1", frequency=20.0)
    assert (again.verdict, again.cause) == (Verdict.UNKNOWN, Cause.SHUTTING_DOWN)
    second.run(5.0)
    assert second.sent() == []
    [closed] = [entry for entry in second.journal if entry["kind"] == "outcome"]
    [intent] = [entry for entry in first.journal if entry["kind"] == "intent"]
    assert (closed["ask"], closed["what"], closed["by"]) == (intent["ask"], intent["what"], intent["by"])
    assert closed["outcome"]["verdict"] == "unknown"
    third = World(memory=second.memory())
    assert [entry["kind"] for entry in third.journal] == ["boot"], "it has its outcome now"


def test_r1_asks_are_counted_through_all_runs() -> None:
    first = World()
    first.write("fan-1.frequency_command", 10.0)
    first.write("fan-1.frequency_command", 99.0)
    second = World(memory=first.memory())
    second.write("fan-1.frequency_command", 11.0)
    asks = [entry["ask"] for entry in (*first.journal, *second.journal) if entry["kind"] == "outcome"]
    assert asks == [1, 2, 3]


def test_r1_a_run_knows_whether_the_one_before_it_ended_in_good_order() -> None:
    first = World()
    first.run(5.0)
    second = World(memory=first.memory())
    boots = [world.journal[0] for world in (first, second)]
    assert [(boot["kind"], boot["run"], boot["ended"]) for boot in boots] == [
        ("boot", 1, True),
        ("boot", 2, False),
    ]


@pytest.mark.parametrize(
    ("turnaround", "away"), [(0.02, 1.0), (0.1, 0.1), (0.2, 0.2), (0.3, 0.3), (0.5, 0.5)]
)
def test_h11_what_is_on_the_wire_when_the_gateway_is_killed_costs_the_drive_no_patience(
    turnaround: float, away: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first request after the restart may meet the answer to the last one before it, and is lost then.
    The next one comes before the drive, which heard nothing for a second before that, stops by itself."""
    monkeypatch.setattr(world_, "RESTART_SECONDS", away)
    world = World(turnaround=turnaround)
    world.watch({"fan-1.output_frequency": 1.0})
    world.run(1.0)
    assert world.command("run_forward", frequency=20.0).verdict is Verdict.CONFIRMED
    world.run(5.0)
    before = len(world.wire)
    world.until(lambda: len(world.wire) > before, 5.0)
    world.restart()
    world.watch({"fan-1.output_frequency": 1.0})
    world.run(10.0)
    assert world.drives["fan-1"].state.running
    assert not world.drives["fan-1"].state.communication_lost
    assert world.states() == [("fan-1", True)]
