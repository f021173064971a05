"""What the gateway remembers over a restart (H3, R1): a second world takes up the journal of a first one."""

from __future__ import annotations

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
