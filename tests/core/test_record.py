"""R1, R2, H22: what is on record, and what happens while nothing can be."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bridge.messages import AskHealth, HealthIs, TurnedAway
from gateway.core.events import Asked, Ticked
from gateway.tag import Cause, Instant, Origin, Outcome, Quality, Role, Verdict
from tests.core.world import ENGINEER, OPERATOR, World, site_of

WRITES = {0x05, 0x06, 0x0F, 0x10}
Frame = tuple[int, int, tuple[int, ...]]


def on_wire(world: World) -> Counter[Frame]:
    """Unit, address and words of every write frame on the wire, taken apart here by hand."""
    frames: Counter[Frame] = Counter()
    for _, text in world.wire:
        data = bytes.fromhex(text)
        if data[1] in WRITES:
            payload = data[7:-2] if data[1] == 0x10 else data[4:6]
            words = tuple(int.from_bytes(payload[i : i + 2]) for i in range(0, len(payload), 2))
            frames[data[0], int.from_bytes(data[2:4]), words] += 1
    return frames


def on_record(world: World) -> Counter[Frame]:
    """The same by the journal: every intent but those that were taken back."""
    intents: dict[tuple[int, int], Frame] = {}
    for entry in world.journal:
        if entry["kind"] == "intent":
            words = tuple(int(word[:-1], 16) for word in entry["words"])
            frame = (entry["unit"], int(entry["address"][:-1], 16), words)
            assert intents.setdefault((entry["ask"], entry["frame"]), frame) is frame, "a number given twice"
        elif entry["kind"] == "unsent":
            del intents[entry["ask"], entry["frame"]]
    return Counter(intents.values())


POINTS = {
    "teco-7200gs": ["frequency_command", "input_6", "s_curve", "stop_method"],
    "s2000": ["frequency_command", "access_level", "preset_frequency_1", "terminal_5"],
    "shihlin-sl3": ["frequency_command", "frequency_stored", "operation_mode"],
}
STEPS = ("write", "write", "command", "wait", "mute", "heal", "disk")
COMMANDS = ("run_forward", "stop", "reset_fault")


@settings(max_examples=25, deadline=None)
@given(st.sampled_from(sorted(POINTS)), st.data())
def test_r1_as_many_intents_as_write_frames_whatever_happens(profile: str, data: st.DataObject) -> None:
    world = World(site_of(profile), journal_delay=data.draw(st.sampled_from([0.0, 0.002, 0.3])))
    world.run(1.0)
    drive = world.drives["drive-1"]
    for _ in range(data.draw(st.integers(1, 12), "steps")):
        step = data.draw(st.sampled_from(STEPS), "step")
        match step:
            case "write":
                point = data.draw(st.sampled_from(POINTS[profile]), "point")
                world.ask_write(f"drive-1.{point}", data.draw(st.integers(0, 3), "value"), ENGINEER, ttl=2.0)
            case "command":
                name = data.draw(st.sampled_from(COMMANDS), "command")
                args: dict[str, Any] = {"frequency": 10.0} if name == "run_forward" else {}
                world.ask_command(name, "drive-1", OPERATOR, **args)
            case "wait":
                world.run(data.draw(st.sampled_from([0.01, 0.2, 3.0]), "seconds"))
            case "mute":
                drive.faults.mute()
            case "heal":
                drive.faults.clear()
            case "disk":
                world.journal_problem = "" if world.journal_problem else "disk full"
    drive.faults.clear()
    world.journal_problem = ""
    world.run(120.0)
    assert on_record(world) == on_wire(world)
    asked = {entry["ask"] for entry in world.journal if entry["kind"] == "intent" and "outcome" not in entry}
    outcomes = Counter(entry["ask"] for entry in world.journal if entry["kind"] == "outcome")
    assert asked <= set(outcomes)
    assert set(outcomes.values()) <= {1}


def test_r1_a_selector_is_on_record_too() -> None:
    world = World(site_of("shihlin-sl3"))
    [sample] = world.read("drive-1.selected_value_5")
    assert sample.quality is Quality.GOOD
    assert on_record(world) == on_wire(world) != Counter()


def test_r1_an_entry_tells_who_through_what_old_new_raw_and_when() -> None:
    world = World()
    who = Origin(through="opcua", who="anna", role=Role.OPERATOR, session="s7", address="10.0.0.7:4711")
    world.write("fan-1.frequency_command", 12.5)
    world.run(1.0)
    world.write("fan-1.frequency_command", 30.0, who, key="k1")
    [_, intent] = [entry for entry in world.journal if entry["kind"] == "intent"]
    [_, outcome] = [entry for entry in world.journal if entry["kind"] == "outcome"]
    for entry in (intent, outcome):
        assert entry["by"] == {
            "through": "opcua",
            "who": "anna",
            "role": "operator",
            "session": "s7",
            "address": "10.0.0.7:4711",
        }
        assert (entry["what"], entry["wanted"], entry["id"]) == ("fan-1.frequency_command", 30.0, "k1")
        assert (entry["boot"], entry["mono"] > 1.0, entry["time"] > 0) == ("boot", True, True)
    assert intent["old"] == {"frequency_command": 12.5}
    assert intent["new"] == {"frequency_command": 30.0}
    assert (intent["line"], intent["drive"], intent["unit"]) == ("north", "fan-1", 5)
    assert (intent["address"], intent["words"]) == ("0002H", ["0BB8H"])
    assert (outcome["outcome"]["verdict"], outcome["outcome"]["value"]) == ("confirmed", 30.0)


@pytest.fixture
def full() -> World:
    """A running motor, and a disk that is full."""
    world = World()
    world.run(1.0)
    outcome = world.command("run_forward", frequency=50.0)
    assert outcome.verdict is Verdict.CONFIRMED, outcome
    world.journal_problem = "No space left on device"
    assert world.write("fan-1.frequency_command", 20.0).cause is Cause.JOURNAL
    return world


def test_r2_a_setpoint_of_zero_is_carried_out_and_on_record_later(full: World) -> None:
    before = len(full.journal)
    assert full.write("fan-1.frequency_command", 0.0).verdict is Verdict.CONFIRMED
    for value in (0.01, 60.0):
        assert full.write("fan-1.frequency_command", value).cause is Cause.JOURNAL
    assert full.command("run_forward", frequency=0.0).cause is Cause.JOURNAL
    assert full.write("fan-1.stop_method", 0).cause is Cause.JOURNAL
    assert len(full.journal) == before
    full.journal_problem = ""
    full.run(3.0)
    assert on_record(full) == on_wire(full)
    told = [entry["outcome"]["verdict"] for entry in full.journal if entry["kind"] == "outcome"]
    assert told == ["confirmed", "refused", "confirmed", *["refused"] * 4]


def test_r2_zero_is_lower_only_where_a_motor_turns_by_it() -> None:
    """An analog output at zero may be half of what it was, or the most that it ever meant."""
    world = World(site_of("s2000"))
    world.run(2.0)
    assert world.write("drive-1.analog_output_1", -5.0).verdict is Verdict.CONFIRMED
    world.journal_problem = "No space left on device"
    assert world.write("drive-1.analog_output_1", 0.0).cause is Cause.JOURNAL


def test_r2_a_stop_is_carried_out_and_on_record_later(full: World) -> None:
    assert full.command("stop").verdict is Verdict.CONFIRMED
    assert full.read("fan-1.running")[0].value is False
    full.journal_problem = ""
    full.run(3.0)
    assert on_record(full) == on_wire(full)


def health(world: World) -> str:
    world.feed(Asked(world.session, AskHealth(999)))
    return [m.health.journal for m in world.told[world.session] if isinstance(m, HealthIs)][-1]


def test_r2_it_recovers_by_itself(full: World) -> None:
    assert "No space left" in health(full)
    full.run(10.0)
    assert "No space left" in health(full)
    full.journal_problem = ""
    full.run(2.0)
    assert health(full) == ""
    assert full.write("fan-1.frequency_command", 20.0).verdict is Verdict.CONFIRMED
    assert full.events() == ["alarm_raised", "alarm_cleared"]


def test_r2_a_disk_that_hangs_is_as_bad_as_a_full_one() -> None:
    world = World(journal_delay=60.0)
    world.run(1.0)
    outcome = world.ask_write("fan-1.frequency_command", 20.0)
    zero = world.ask_write("fan-1.frequency_command", 0.0)
    superseded = world.until(outcome, 1.0)
    assert superseded.verdict is Verdict.SUPERSEDED
    assert world.until(zero, 2.0).verdict is Verdict.CONFIRMED
    refused = world.write("fan-1.frequency_command", 20.0)
    assert (refused.verdict, refused.cause) == (Verdict.REFUSED, Cause.JOURNAL)
    assert "has not answered" in health(world)
    assert len(world.sent()) == 1
    world.journal_delay = 0.002
    world.run(70.0)
    assert health(world) == ""
    assert world.write("fan-1.frequency_command", 20.0).verdict is Verdict.CONFIRMED
    assert on_record(world) == on_wire(world)


def jumps(world: World) -> list[Any]:
    return [entry["jump"] for entry in world.journal if entry["kind"] == "clock"]


@pytest.mark.parametrize(("seconds", "told"), [(0.5, []), (90.0, [90.0]), (-3600.0, [-3600.0])])
def test_h22_a_clock_that_was_set_is_on_record_and_moves_no_interval(
    seconds: float, told: list[float]
) -> None:
    world = World()
    world.run(1.0)
    outcome = world.ask_command("run_forward", frequency=20.0, ttl=5.0)
    wall = world.instant

    def moved() -> Instant:
        return Instant(wall().mono, wall().wall + int(seconds * 1e9))

    world.instant = moved  # type: ignore[method-assign]
    assert world.until(outcome, 10.0).verdict is Verdict.CONFIRMED
    world.run(5.0)
    assert jumps(world) == told
    mono = [entry["mono"] for entry in world.journal]
    lived = [entry["lived"] for entry in world.journal]
    assert lived == pytest.approx(mono, abs=0.001)


def test_h22_a_clock_that_is_led_slowly_is_no_jump() -> None:
    world = World()
    for second in range(1, 200):
        world.core.step(Ticked(), Instant(float(second), round(second * 1.4 * 10**9)))
    assert jumps(world) == []


def turned(world: World) -> list[dict[str, Any]]:
    return [entry for entry in world.journal if entry["kind"] == "turned away"]


def test_r1_what_an_adapter_turned_away_is_on_record() -> None:
    world = World()
    outcome = Outcome(verdict=Verdict.REFUSED, cause=Cause.RETAINED, reason="retained")
    world.feed(Asked(world.session, TurnedAway(0, "fan-1.run_forward", "{" * 5000, OPERATOR, outcome)))
    [entry] = turned(world)
    assert (entry["what"], entry["by"]["who"], entry["client"]) == ("fan-1.run_forward", "otto", "test")
    assert entry["outcome"] == {"verdict": "refused", "cause": "retained", "reason": "retained"}
    assert len(entry["wanted"]) == 200


def test_d2_a_flood_of_them_does_not_wash_everything_else_out_of_the_journal() -> None:
    world = World()
    flood, other = world.join("flood"), world.join("other")
    outcome = Outcome(verdict=Verdict.REFUSED, cause=Cause.MALFORMED, reason="malformed")
    attempt = TurnedAway(0, "fan-1.stop", None, OPERATOR, outcome)
    for _ in range(10_000):
        world.feed(Asked(flood, attempt))
    world.feed(Asked(other, attempt))
    assert len(turned(world)) == 201, "200 of the flood, and the other one"
    world.run(1.0)
    world.feed(Asked(flood, attempt))
    assert turned(world)[-1]["passed_over"] == 9_800
