"""Writes and commands through the whole core, on a simulated 7200GS and a virtual clock."""

from __future__ import annotations

import pytest

from gateway.core.events import PortLost
from gateway.simulator.faults import DropReply
from gateway.simulator.happening import Panel, PowerCycle, Trip
from gateway.tag import Cause, Origin, Role, Verdict
from tests.core.world import ENGINEER, OPERATOR, World, make_site

VIEWER = Origin(through="test", who="vera", role=Role.VIEWER)
STEP_1 = "05 10 00 01 00 02 04 00 01 17 70 78 87"
STEP_2 = "05 10 00 01 00 02 04 00 01 0B B8 71 D1"
STEP_3 = "05 10 00 01 00 02 04 00 03 0B B8 D0 11"
STEP_4 = "05 10 00 01 00 01 02 00 00 95 41"


@pytest.fixture
def world() -> World:
    world = World()
    world.run(1.0)
    return world


def test_the_four_steps_of_section_11_byte_for_byte(world: World) -> None:
    assert world.command("run_forward", frequency=60.0).verdict is Verdict.CONFIRMED
    assert world.command("run_forward", frequency=30.0).verdict is Verdict.CONFIRMED
    assert world.command("run_reverse", frequency=30.0).verdict is Verdict.CONFIRMED
    assert world.command("stop").verdict is Verdict.CONFIRMED
    assert world.sent() == [STEP_1, STEP_2, STEP_3, STEP_4]


def test_a_change_of_speed_is_a_write_of_its_register_alone_and_is_read_back(world: World) -> None:
    world.command("run_forward", frequency=60.0)
    outcome = world.write("fan-1.frequency_command", 45.5, OPERATOR)
    assert (outcome.verdict, outcome.value) == (Verdict.CONFIRMED, 45.5)
    assert world.sent()[-1].startswith("05 10 00 02 00 01 02 11 C6")
    [running] = world.read("fan-1.running")
    assert running.value is True


def test_writing_is_off_until_the_site_says_otherwise() -> None:
    world = World(make_site(writes=False))
    world.run(1.0)
    for outcome in (
        world.write("fan-1.frequency_command", 10.0),
        world.command("run_forward", frequency=10.0),
        world.command("stop"),
    ):
        assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.WRITES_DISABLED)
    assert world.sent() == []


@pytest.mark.parametrize(
    ("tag", "value", "cause"),
    [
        ("fan-1.frequency_command", 60.01, Cause.OUT_OF_RANGE),
        ("fan-1.frequency_command", -0.01, Cause.OUT_OF_RANGE),
        ("fan-1.frequency_command", float("nan"), Cause.OUT_OF_RANGE),
        ("fan-1.frequency_command", float("inf"), Cause.OUT_OF_RANGE),
        ("fan-1.frequency_command", 10**400, Cause.OUT_OF_RANGE),
        ("fan-1.frequency_command", True, Cause.WRONG_TYPE),
        ("fan-1.frequency_command", "fast", Cause.WRONG_TYPE),
        ("fan-1.frequency_command", None, Cause.WRONG_TYPE),
        ("fan-1.input_5", 1, Cause.WRONG_TYPE),
        ("fan-1.input_5", 1.0, Cause.WRONG_TYPE),
        ("fan-1.run", True, Cause.NOT_WRITABLE),
        ("fan-1.output_frequency", 10.0, Cause.NOT_WRITABLE),
        ("fan-1.warp", 9, Cause.UNKNOWN_TAG),
        ("fan-9.frequency_command", 9.0, Cause.UNKNOWN_TAG),
        ("frequency_command", 9.0, Cause.UNKNOWN_TAG),
    ],
)
def test_t1_t2_what_does_not_fit_is_refused_whole(
    world: World, tag: str, value: object, cause: Cause
) -> None:
    outcome = world.write(tag, value)  # type: ignore[arg-type]
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, cause)
    assert outcome.reason
    assert world.sent() == []


def test_what_only_commands_write_names_them(world: World) -> None:
    assert world.write("fan-1.run", True).reason == (
        "run is written by commands only: run_forward, run_reverse, stop"
    )
    assert (
        world.write("fan-1.fault_reset", True).reason
        == "fault_reset is written by commands only: reset_fault"
    )


@pytest.mark.parametrize(
    ("name", "args", "cause"),
    [
        ("run_forward", {}, Cause.WRONG_ARGUMENTS),
        ("run_forward", {"frequency": 10.0, "torque": 1.0}, Cause.WRONG_ARGUMENTS),
        ("run_forward", {"frequency": 61.0}, Cause.OUT_OF_RANGE),
        ("run_forward", {"frequency": "ten"}, Cause.WRONG_TYPE),
        ("explode", {}, Cause.UNKNOWN_COMMAND),
    ],
)
def test_commands_with_wrong_arguments_are_refused(
    world: World, name: str, args: dict[str, object], cause: Cause
) -> None:
    outcome = world.command(name, **args)  # type: ignore[arg-type]
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, cause)
    assert world.sent() == []


def test_h20_no_stop_is_refused_for_an_argument_too_much(world: World) -> None:
    assert world.command("stop", frequency=1.0).verdict is Verdict.CONFIRMED
    assert world.sent() == [STEP_4]


def test_e1_roles_and_the_ceiling_of_the_way_in(world: World) -> None:
    assert world.command("run_forward", origin=VIEWER, frequency=10.0).cause is Cause.NO_RIGHTS
    assert world.write("fan-1.frequency_command", 10.0, VIEWER).cause is Cause.NO_RIGHTS
    assert world.write("fan-1.run_source", "line", OPERATOR).cause is Cause.NO_RIGHTS
    below = world.join("mqtt", ceiling=Role.VIEWER)
    refused = world.until(world.ask_write("fan-1.frequency_command", 10.0, ENGINEER, session=below), 5.0)
    assert refused.cause is Cause.NO_RIGHTS
    assert world.sent() == []


def test_h13_a_run_is_refused_while_the_panel_has_control(world: World) -> None:
    assert world.write("fan-1.run_source", "operator_or_terminals").verdict is Verdict.CONFIRMED
    before = len(world.sent())
    outcome = world.command("run_forward", frequency=10.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.PRECONDITION)
    assert "run_source" in outcome.reason
    assert "operator_or_terminals" in outcome.reason
    assert len(world.sent()) == before


def test_parameters_are_locked_by_us_while_the_motor_runs(world: World) -> None:
    world.command("run_forward", frequency=10.0)
    before = len(world.sent())
    outcome = world.write("fan-1.run_source", "line")
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.PRECONDITION)
    assert len(world.sent()) == before


def test_the_drives_own_refusal_is_told_in_its_words(world: World) -> None:
    world.write("fan-1.run_source", "operator_or_terminals")
    world.drives["fan-1"].post(Panel(run=True))
    outcome = world.until(world.ask_write("fan-1.run_source", "line"), 10.0)
    if outcome.cause is Cause.DRIVE_REFUSED:
        assert outcome.code == 0x22
        assert outcome.drive_error == "locked"
        assert "22H" in outcome.reason
    else:
        assert outcome.cause is Cause.PRECONDITION


def test_bits_of_other_clients_in_the_control_word_are_kept(world: World) -> None:
    assert world.write("fan-1.input_5", True, OPERATOR).value is True
    assert world.write("fan-1.input_7", True, OPERATOR).value is True
    world.command("run_forward", frequency=20.0)
    world.write("fan-1.input_5", False, OPERATOR)
    [run, five, seven] = world.read("fan-1.run", "fan-1.input_5", "fan-1.input_7")
    assert (run.value, five.value, seven.value) == (True, False, True)


def test_the_image_begins_as_the_drives_own_word() -> None:
    world = World()
    world.run(1.0)
    world.write("fan-1.input_6", True, OPERATOR)
    world.core.drives[0].forget()
    world.write("fan-1.input_5", True, OPERATOR)
    [six] = world.read("fan-1.input_6")
    assert six.value is True


def test_a_fault_reset_is_a_pulse_that_keeps_the_run_bit(world: World) -> None:
    world.command("run_forward", frequency=20.0)
    world.drives["fan-1"].post(Trip("fault_overcurrent"))
    world.run(2.0)
    assert "fault_raised" in world.events() or world.read("fan-1.fault")[0].value is True
    before = len(world.sent())
    outcome = world.command("reset_fault")
    assert outcome.verdict is Verdict.CONFIRMED, outcome
    pulse, rest = world.sent()[before : before + 2]
    assert pulse.startswith("05 10 00 01 00 01 02 00 09")
    assert rest.startswith("05 10 00 01 00 01 02 00 01")
    times = [at for at, frame in world.wire if frame in (pulse, rest)]
    assert 0.2 <= times[-1] - times[-2] < 0.4
    assert world.read("fan-1.fault")[0].value is False


def test_h20_a_stop_overtakes_a_thousand_waiting_setpoints(world: World) -> None:
    world.command("run_forward", frequency=50.0)
    waiting = [world.ask_write("fan-1.input_5", n % 2 == 0, OPERATOR) for n in range(900)]
    asked = world.now
    stop = world.ask_command("stop")
    world.until(lambda: STEP_4 in world.sent() or None, 5.0)
    [at] = [at for at, frame in world.wire if frame == STEP_4]
    assert at - asked < 0.1, "only the transaction on the wire may be waited for"
    assert world.until(stop, 30.0).verdict is Verdict.CONFIRMED
    outcomes = [outcome() for outcome in waiting]
    assert {o.verdict for o in outcomes if o} <= {Verdict.SUPERSEDED, Verdict.CONFIRMED}
    assert None not in outcomes
    assert world.read("fan-1.running")[0].value is False


def test_a_stop_ends_a_run_that_is_not_proved_yet(world: World) -> None:
    run = world.ask_command("run_reverse", frequency=50.0)
    world.until(lambda: world.sent() or None, 5.0)
    stop = world.ask_command("stop")
    assert world.until(stop, 60.0).verdict is Verdict.CONFIRMED
    outcome = run()
    assert outcome is not None
    assert outcome.verdict is Verdict.SUPERSEDED
    world.run(2.0)
    assert world.read("fan-1.running")[0].value is False


def test_a_stream_of_setpoints_collapses_to_the_newest(world: World) -> None:
    asked = [world.ask_write("fan-1.frequency_command", float(n), OPERATOR) for n in range(40)]
    last = world.until(asked[-1], 5.0)
    assert (last.verdict, last.value) == (Verdict.CONFIRMED, 39.0)
    verdicts = [outcome().verdict for outcome in asked]  # type: ignore[union-attr]
    assert verdicts.count(Verdict.SUPERSEDED) >= 38
    assert len(world.sent()) <= 2


def test_h5_a_lost_reply_is_told_by_the_read_back_and_never_sent_again(world: World) -> None:
    world.write("fan-1.frequency_command", 10.0)
    world.drives["fan-1"].faults.inject(DropReply())
    before = len(world.sent())
    outcome = world.write("fan-1.frequency_command", 20.0)
    assert (outcome.verdict, outcome.value) == (Verdict.CONFIRMED, 20.0)
    assert "lost" in outcome.reason
    assert len(world.sent()) == before + 1


def test_h5_a_drive_that_goes_silent_leaves_the_outcome_unknown(world: World) -> None:
    outcome = world.ask_write("fan-1.frequency_command", 20.0)
    before = len(world.sent())
    world.until(lambda: len(world.sent()) > before or None, 5.0)
    world.drives["fan-1"].faults.mute()
    result = world.until(outcome, 30.0)
    assert result.verdict is Verdict.UNKNOWN
    assert len(world.sent()) == before + 1


def test_a_write_to_a_drive_that_is_known_to_be_away_fails_at_once(world: World) -> None:
    world.drives["fan-1"].faults.mute()
    world.run(10.0)
    outcome = world.write("fan-1.frequency_command", 20.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.FAILED, Cause.NO_ANSWER)
    assert world.sent() == []


def test_h20_a_stop_goes_out_even_to_a_drive_that_is_away(world: World) -> None:
    world.drives["fan-1"].faults.mute()
    world.run(10.0)
    stop = world.ask_command("stop")
    world.until(lambda: STEP_4 in world.sent() or None, 2.0)
    world.drives["fan-1"].faults.clear()
    assert world.until(stop, 60.0).verdict is Verdict.CONFIRMED


def test_a_command_that_waited_too_long_is_never_sent(world: World) -> None:
    waiting = [world.ask_write("fan-1.input_5", n % 2 == 0, OPERATOR, ttl=0.3) for n in range(100)]
    world.run(10.0)
    outcomes = [outcome() for outcome in waiting]
    assert outcomes[-1] is not None
    assert outcomes[-1].verdict is Verdict.EXPIRED
    confirmed = sum(o is not None and o.verdict is Verdict.CONFIRMED for o in outcomes)
    assert len(world.sent()) == confirmed
    assert world.write("fan-1.frequency_command", 20.0, ttl=0.0).verdict is Verdict.EXPIRED


def test_r1_the_intent_is_on_disk_before_the_first_byte() -> None:
    world = World(journal_delay=0.5)
    world.run(1.0)
    asked = world.now
    world.write("fan-1.frequency_command", 20.0)
    [intent] = [entry for entry in world.journal if entry["kind"] == "intent"]
    [at] = [at for at, frame in world.wire if frame.startswith("05 10")]
    assert intent["at"] >= asked
    assert at >= intent["at"] + 0.5
    assert intent["words"] == ["07D0H"]
    assert world.journal[-1]["outcome"]["verdict"] == "confirmed"


def test_r2_without_a_journal_everything_but_a_stop_is_refused() -> None:
    world = World()
    world.run(1.0)
    world.command("run_forward", frequency=10.0)
    world.journal_problem = "No space left on device"
    refused = world.write("fan-1.frequency_command", 20.0)
    assert (refused.verdict, refused.cause) == (Verdict.REFUSED, Cause.JOURNAL)
    assert "No space left" in refused.reason
    assert world.command("stop").verdict is Verdict.CONFIRMED


def test_a_stop_does_not_wait_for_the_journal() -> None:
    world = World(journal_delay=30.0)
    world.run(1.0)
    assert world.command("stop").verdict is Verdict.CONFIRMED
    assert world.now < 5.0


def test_h3_a_command_with_the_same_id_is_carried_out_once(world: World) -> None:
    first = world.ask_command("run_forward", key="a1", frequency=20.0)
    second = world.ask_command("run_forward", key="a1", frequency=20.0)
    outcome = world.until(first, 10.0)
    assert second() == outcome
    third = world.ask_command("run_forward", key="a1", frequency=20.0)
    assert third() == outcome
    assert len(world.sent()) == 1


def test_every_attempt_is_in_the_journal_refused_ones_too(world: World) -> None:
    world.write("fan-1.frequency_command", 99.0)
    world.write("fan-1.output_frequency", 1.0)
    world.write("fan-1.frequency_command", 9.0)
    outcomes = [e["outcome"]["verdict"] for e in world.journal if e["kind"] == "outcome"]
    assert outcomes == ["refused", "refused", "confirmed"]
    assert all(e["by"]["who"] == "erika" for e in world.journal if e["kind"] != "boot")


def test_a_failed_proof_says_what_the_drive_shows(world: World) -> None:
    world.drives["fan-1"].post(Trip("fault_overheat"))
    world.run(1.0)
    outcome = world.command("run_forward", frequency=20.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.FAILED, Cause.NOT_PROVED)
    assert "running: false" in outcome.reason


def test_h20_a_stop_is_sent_on_until_the_drive_answers_however_long_that_takes(world: World) -> None:
    world.command("run_forward", frequency=50.0)
    world.drives["fan-1"].connected = False
    stop = world.ask_command("stop")
    outcome = world.until(stop, 40.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.UNKNOWN, Cause.NO_ANSWER)
    world.run(300.0)
    sent = len([frame for frame in world.sent() if frame == STEP_4])
    assert 45 < sent < 80, "again and again, but not all the time"
    world.drives["fan-1"].connected = True
    world.run(10.0)
    assert world.read("fan-1.running")[0].value is False
    assert world.write("fan-1.frequency_command", 20.0).verdict is Verdict.CONFIRMED


def test_nothing_else_is_taken_while_a_stop_is_not_answered(world: World) -> None:
    world.drives["fan-1"].faults.mute()
    stop = world.ask_command("stop")
    world.until(stop, 40.0)
    world.drives["fan-1"].faults.clear()
    refused = world.command("run_forward", frequency=20.0)
    assert refused.verdict is not Verdict.CONFIRMED
    world.run(10.0)
    assert world.read("fan-1.running")[0].value is False


def test_a_read_of_a_drive_that_is_away_says_so_at_once(world: World) -> None:
    world.drives["fan-1"].faults.mute()
    world.run(10.0)
    asked = world.now
    [sample] = world.read("fan-1.output_frequency")
    assert sample.value is None
    assert "does not answer" in sample.reason
    assert world.now - asked < 0.1


def test_a_fault_of_ours_leaves_nobody_waiting(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise KeyError("oops")

    with monkeypatch.context() as patch:
        patch.setattr("gateway.core.drive.Drive.compose", broken)
        outcome = world.write("fan-1.frequency_command", 20.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.FAILED, Cause.INTERNAL)
    assert "oops" in outcome.reason
    assert world.write("fan-1.frequency_command", 20.0).verdict is Verdict.CONFIRMED, "the lane is free again"


@pytest.mark.parametrize("touch", ["input_6", "reset_fault"])
def test_h7_a_bit_written_after_an_unnoticed_restart_does_not_start_the_motor(
    world: World, touch: str
) -> None:
    world.command("run_forward", frequency=20.0)
    world.drives["fan-1"].post(PowerCycle())
    world.run(0.5)
    if touch == "reset_fault":
        world.command("reset_fault")
    else:
        world.write("fan-1.input_6", True, OPERATOR)
    world.run(3.0)
    [run, running] = world.read("fan-1.run", "fan-1.running")
    assert (run.value, running.value) == (False, False)


def test_h20_a_stop_that_is_refused_as_busy_is_repeated(world: World) -> None:
    world.command("run_forward", frequency=50.0)
    drive = world.drives["fan-1"]
    refusing = [True]
    model = drive.handle

    def busy(adu: bytes, now: float) -> bytes | None:
        if refusing[0] and adu[1] == 0x10:
            return bytes.fromhex("05 90 06 8D C3")
        return model(adu, now)

    drive.handle = busy  # type: ignore[method-assign]
    stop = world.ask_command("stop")
    world.run(6.0)
    assert stop() is None
    refusing[0] = False
    assert world.until(stop, 60.0).verdict is Verdict.CONFIRMED


def test_h20_a_stop_asked_while_the_port_is_gone_is_sent_when_it_is_back(world: World) -> None:
    world.command("run_forward", frequency=50.0)
    world.port_problem = "unplugged"
    world.feed(PortLost("north", "unplugged"))
    stop = world.ask_command("stop")
    outcome = world.until(stop, 1.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.FAILED, Cause.LINE_DOWN)
    world.run(20.0)
    world.port_problem = ""
    world.wire.clear()
    world.run(20.0)
    assert STEP_4 in world.sent()
    assert world.read("fan-1.running")[0].value is False


def test_h20_a_stop_that_is_acknowledged_and_not_obeyed_is_sent_again(world: World) -> None:
    world.command("run_forward", frequency=50.0)
    drive = world.drives["fan-1"]
    deaf = [True]
    model = drive.handle

    def acknowledge(adu: bytes, now: float) -> bytes | None:
        if deaf[0] and adu[1] == 0x10:
            return bytes.fromhex("05 10 00 01 00 01 51 8D")
        return model(adu, now)

    drive.handle = acknowledge  # type: ignore[method-assign]
    stop = world.ask_command("stop")
    outcome = world.until(stop, 25.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.FAILED, Cause.NOT_PROVED)
    assert len([frame for frame in world.sent() if frame == STEP_4]) > 8
    deaf[0] = False
    world.run(10.0)
    assert world.read("fan-1.running")[0].value is False


def test_a_stop_brings_nothing_along_of_a_write_that_it_kept_from_the_wire(world: World) -> None:
    """A bit that waits for its turn is in no frame, and so must not be in that of the stop."""
    world.watch({f"fan-1.{name}": 0.01 for name in ("running", "output_frequency", "fault_overheat")})
    world.run(1.0)
    fault = world.ask_write("fan-1.external_fault", True, ENGINEER)

    def waiting() -> bool:
        intents = [entry["at"] for entry in world.journal if entry["kind"] == "intent"]
        return bool(intents) and world.now >= intents[0] + world.journal_delay

    world.until(waiting, 2.0)
    assert world.sent() == []
    world.command("stop")
    outcome = fault()
    assert outcome is not None
    assert outcome.verdict is Verdict.SUPERSEDED
    assert world.sent() == [STEP_4]
