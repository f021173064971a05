"""H5: what is told of a write whose reply was lost, and of the next ones, whose replies are in doubt."""

from __future__ import annotations

import pytest

from gateway.simulator.faults import DropReply
from gateway.simulator.happening import Trip
from gateway.tag import Cause, Outcome, Verdict
from tests.core.test_ending import PULSED, RELEASED, pulsing
from tests.core.test_rules_of_documents import answers, framed
from tests.core.world import World


@pytest.fixture
def world() -> World:
    world = World()
    world.run(1.0)
    return world


def reset_with_a_lost_reply(world: World) -> Outcome:
    outcome = pulsing(world)
    world.drives["fan-1"].faults.inject(DropReply())
    found: Outcome = world.until(outcome, 60.0)
    return found


def test_h5_the_end_of_a_pulse_whose_reply_is_in_doubt_is_read_and_not_sent_again_and_again(
    world: World,
) -> None:
    world.drives["fan-1"].post(Trip("fault_overcurrent"))
    outcome = reset_with_a_lost_reply(world)
    assert (outcome.verdict, outcome.reason) == (
        Verdict.CONFIRMED,
        "the reply was lost; the drive shows that it was done",
    )
    assert [frame[:26] for frame in world.sent()] == [PULSED, RELEASED]
    assert world.read("fan-1.fault")[0].value is False


def test_h5_a_lost_pulse_that_the_drive_does_not_show_is_unknown_and_not_repeated(world: World) -> None:
    """The overvoltage is still there, as far as anybody can tell."""
    pulsed = pulsing(world)
    world.drives["fan-1"].faults.inject(DropReply())
    world.run(0.1)
    world.drives["fan-1"].post(Trip("fault_overcurrent"))
    outcome = world.until(pulsed, 60.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.UNKNOWN, Cause.NO_ANSWER)
    assert "sent (the drive did not answer), but the drive did not show" in outcome.reason
    assert [frame[:26] for frame in world.sent()] == [PULSED, RELEASED]


def test_h5_a_pulse_that_cannot_be_taken_back_is_no_success(world: World) -> None:
    """Its end is sent a few times, further and further apart, and then it is told."""
    pulsed = pulsing(world)
    world.run(0.1)
    world.drives["fan-1"].faults.mute()
    outcome = world.until(pulsed, 60.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.UNKNOWN, Cause.NO_ANSWER)
    assert outcome.reason.startswith("the pulse was given, and it is not known whether it was taken back: ")
    assert sum(frame.startswith(RELEASED) for frame in world.sent()) <= 8
    world.drives["fan-1"].faults.clear()
    world.run(20.0)
    assert world.write("fan-1.input_5", True).verdict is Verdict.CONFIRMED
    assert world.drives["fan-1"].registers[1] & 8 == 0, "the next write of the word ends it"


def test_h5_a_pulse_is_taken_back_although_the_word_could_not_be_read_first(world: World) -> None:
    pulsed = pulsing(world)
    world.run(0.1)
    world.drives["fan-1"].faults.mute()
    world.run(4.5)
    world.drives["fan-1"].faults.clear()
    assert world.until(pulsed, 60.0).verdict is Verdict.CONFIRMED
    assert world.drives["fan-1"].registers[1] & 8 == 0


def test_r2_a_pulse_is_taken_back_although_the_journal_fails_meanwhile(world: World) -> None:
    pulsed = pulsing(world)
    world.journal_problem = "No space left on device"
    assert world.until(pulsed, 60.0).verdict is Verdict.CONFIRMED
    assert world.drives["fan-1"].registers[1] & 8 == 0
    world.journal_problem = ""
    world.run(2.0)
    assert sum(entry["kind"] == "intent" for entry in world.journal) == len(world.sent())


def test_h5_a_refusal_soon_after_a_lost_reply_is_told_as_what_it_may_be(world: World) -> None:
    """It may be the answer to the write before, so nothing is concluded but what is read back."""
    first = world.ask_write("fan-1.frequency_command", 20.0)
    world.until(lambda: world.sent() or None, 5.0)
    world.drives["fan-1"].faults.inject(DropReply())
    assert world.until(first, 10.0).reason == "the reply was lost; read back"
    answers(world.drives["fan-1"], framed(5, 0x90, 0x22))
    outcome = world.write("fan-1.frequency_command", 30.0)
    assert outcome.verdict is Verdict.FAILED
    assert outcome.reason.startswith("the drive answered 22H locked: ")
    assert (
        "(perhaps to an earlier request, whose answer had not come), and frequency_command" in outcome.reason
    )
    assert outcome.reason.endswith("shows 20: it was not done")
    world.run(20.0)
    assert world.write("fan-1.frequency_command", 30.0).cause is Cause.DRIVE_REFUSED
