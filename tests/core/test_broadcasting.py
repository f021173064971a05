"""H18: commands to all drives of a line, byte by byte; confirmed by reading each drive."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from gateway.bridge.api import LeaseAct
from gateway.mapping.site import Control, LossDemand, Pace, Site, StartGroup
from gateway.mapping.specialise import specialise
from gateway.simulator.faults import DropReply
from gateway.simulator.happening import Trip
from gateway.tag import Cause, Origin, Outcome, Role, Value, Verdict
from tests.core.world import ENGINEER, OPERATOR, World, make_site, site_of
from tests.simulator.master import crc

LINE = "_north"
ADMIN = Origin(through="test", who="ada", role=Role.ADMIN)


def site_with(
    count: int = 3, *, role: Role | None = Role.ENGINEER, tops: tuple[int, ...] = (60, 60, 60), **drive: Any
) -> Site:
    """A line of so many S2000: pump-1 at unit 1 ..., each with its highest frequency."""
    site = site_of("s2000", e1_04=Fraction(60), h1_02=Fraction(1))
    [line] = site.lines
    [first] = line.drives
    control = Control(lease="off")
    drives = []
    for n in range(count):
        settings = {**first.settings, "e1_04": Fraction(tops[n])}
        profile = specialise(first.profile, settings)
        drives.append(
            replace(
                first,
                name=f"pump-{n + 1}",
                unit=n + 1,
                settings=settings,
                profile=profile,
                **{"control": control, **drive},
            )
        )
    return replace(site, lines=(replace(line, drives=tuple(drives), broadcast=role),))


def world_of(count: int = 3, **more: Any) -> World:
    world = World(site_with(count, **more), acceleration=0.5, deceleration=0.5)
    world.run(1.5)
    return world


def to_all(world: World) -> list[str]:
    """The frames to unit 0, without their check bytes, which are right."""
    frames = [bytes.fromhex(text) for _, text in world.wire if text.startswith("00 ")]
    assert all(frame[-2:] == crc(frame[:-2]) for frame in frames)
    return [frame[:-2].hex(" ").upper() for frame in frames]


def command(world: World, name: str, origin: Origin = ENGINEER, **args: Value) -> Outcome:
    return world.command(name, origin=origin, drive=LINE, **args)


def is_refused(outcome: Outcome, cause: Cause, *words: str) -> bool:
    refused = (outcome.verdict, outcome.cause) == (Verdict.REFUSED, cause)
    return refused and all(word in outcome.reason for word in words)


def test_run_stop_and_reverse_byte_by_byte_in_the_layout_and_the_unit_of_a_broadcast() -> None:
    world = world_of()
    for name, args in (
        ("run_forward_all", {"frequency": 50.0}),
        ("run_reverse_all", {"frequency": 100.0}),
        ("stop_all", {}),
    ):
        assert command(world, name, **args).verdict is Verdict.CONFIRMED, name
    assert to_all(world) == [
        "00 10 00 01 00 02 04 00 01 3A 98",
        "00 10 00 01 00 02 04 00 03 75 30",
        "00 10 00 01 00 01 02 00 00",
    ]
    assert not any(drive.state.running for drive in world.drives.values())


def test_every_drive_follows_in_its_own_hertz() -> None:
    world = world_of(tops=(60, 50, 400))
    assert command(world, "run_forward_all", frequency=50.0).verdict is Verdict.CONFIRMED
    world.run(5.0)
    assert [round(drive.state.frequency) for drive in world.drives.values()] == [30, 25, 200]


def test_a_reset_to_all_is_a_pulse_that_keeps_the_run_bit() -> None:
    world = world_of()
    command(world, "run_reverse_all", frequency=50.0)
    for drive in world.drives.values():
        drive.post(Trip("fault_oc"))
    world.run(1.0)
    assert command(world, "reset_fault_all").verdict is Verdict.CONFIRMED
    pulse, rest = to_all(world)[-2:]
    assert (pulse, rest) == ("00 10 00 01 00 01 02 00 23", "00 10 00 01 00 01 02 00 03")
    times = [at for at, text in world.wire if text.startswith("00 ")]
    assert 0.2 <= times[-1] - times[-2] < 0.5


def test_a_reset_to_all_starts_nobody_who_was_stopped() -> None:
    world = world_of()
    command(world, "run_forward_all", frequency=50.0)
    command(world, "stop_all")
    for drive in world.drives.values():
        drive.post(Trip("fault_oc"))
    world.run(1.0)
    assert command(world, "reset_fault_all").verdict is Verdict.CONFIRMED
    assert to_all(world)[-2:] == ["00 10 00 01 00 01 02 00 20", "00 10 00 01 00 01 02 00 00"]


def test_a_reset_to_all_is_refused_while_it_would_stop_or_start_one_of_them() -> None:
    world = world_of()
    assert world.command("run_forward", drive="pump-2", frequency=30.0).verdict is Verdict.CONFIRMED
    outcome = command(world, "reset_fault_all")
    assert is_refused(outcome, Cause.PRECONDITION, "pump-1: stop", "pump-2: run_forward")
    assert to_all(world) == []
    assert world.drives["pump-2"].state.running


def test_h18_the_pause_after_a_broadcast_is_kept() -> None:
    world = world_of()
    world.watch({"pump-1.running": 0.05})
    command(world, "run_forward_all", frequency=50.0)
    [frame] = [f for f in world.simulated.log if f.data[0] == 0]
    after = min(f.start for f in world.simulated.log if f.start > frame.end)
    assert after - frame.end >= 0.1


def test_h18_the_outcome_names_the_drives_that_did_not_follow() -> None:
    world = world_of()
    heard = world.drives["pump-2"].handle
    world.drives["pump-2"].handle = lambda adu, now: None if adu[0] == 0 else heard(adu, now)  # type: ignore[method-assign]
    outcome = command(world, "run_forward_all", frequency=50.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.FAILED, Cause.NOT_PROVED)
    assert "pump-2 still shows running: false" in outcome.reason
    assert "pump-1" not in outcome.reason


def test_a_drive_that_falls_silent_leaves_the_outcome_unknown() -> None:
    world = world_of()
    asked = world.ask_command("run_forward_all", drive=LINE, origin=ENGINEER, frequency=50.0)
    world.until(lambda: to_all(world) or None, 5.0)
    world.drives["pump-3"].faults.inject(DropReply(), times=None)
    outcome = world.until(asked, 30.0)
    assert outcome.verdict is Verdict.UNKNOWN
    assert "pump-3 has not shown running: true" in outcome.reason


def test_h20_who_misses_a_stop_to_all_gets_one_of_his_own() -> None:
    world = world_of()
    command(world, "run_forward_all", frequency=50.0)
    world.run(2.0)
    heard = world.drives["pump-3"].handle
    world.drives["pump-3"].handle = lambda adu, now: None if adu[0] == 0 else heard(adu, now)  # type: ignore[method-assign]
    outcome = command(world, "stop_all", origin=OPERATOR)
    assert outcome.verdict is Verdict.CONFIRMED
    assert to_all(world)[-1] == "00 10 00 01 00 01 02 00 00"
    own = [text for text in world.sent() if not text.startswith("00 ")]
    assert [text[:20] for text in own] == ["03 10 00 00 00 01 02"]
    assert not any(drive.state.running for drive in world.drives.values())


def test_h20_a_dead_drive_holds_up_nobodys_stop() -> None:
    world = world_of()
    command(world, "run_forward_all", frequency=50.0)
    world.drives["pump-1"].connected = False
    asked = world.ask_command("stop_all", drive=LINE, origin=OPERATOR)
    world.run(8.0)
    assert not world.drives["pump-2"].state.running
    assert not world.drives["pump-3"].state.running
    outcome = world.until(asked, 60.0)
    assert outcome.verdict is Verdict.UNKNOWN
    assert "pump-1" in outcome.reason
    assert "pump-2" not in outcome.reason
    assert world.command("run_forward", drive="pump-2", frequency=10.0).verdict is Verdict.CONFIRMED
    world.drives["pump-1"].connected = True
    world.run(20.0)
    assert not world.drives["pump-1"].state.running


def test_h20_a_stop_to_all_overtakes_what_is_under_way_on_any_of_them() -> None:
    world = world_of()
    world.command("run_forward", drive="pump-1", frequency=30.0)
    waiting = [world.ask_write(f"pump-{1 + n % 3}.terminal_3", n % 2 == 0, OPERATOR) for n in range(300)]
    asked = world.now
    stop = world.ask_command("stop_all", drive=LINE, origin=OPERATOR)
    world.until(lambda: to_all(world) or None, 5.0)
    [at] = [at for at, text in world.wire if text.startswith("00 ")]
    assert at - asked < 0.3, "the transaction on the wire, no more"
    assert world.until(stop, 60.0).verdict is Verdict.CONFIRMED
    assert None not in [outcome() for outcome in waiting]


def test_a_stop_of_one_drive_ends_a_run_of_all_that_was_not_sent() -> None:
    world = world_of()
    blocking = world.ask_command("run_reverse", drive="pump-1", frequency=30.0)
    run = world.ask_command("run_forward_all", drive=LINE, origin=ENGINEER, frequency=50.0)
    stop = world.ask_command("stop", drive="pump-2")
    assert world.until(run, 60.0).verdict is Verdict.SUPERSEDED
    assert world.until(stop, 60.0).verdict is Verdict.CONFIRMED
    assert world.until(blocking, 60.0).verdict is Verdict.CONFIRMED
    assert to_all(world) == []


def test_a_command_to_all_waits_for_what_is_under_way_on_each_and_they_for_it() -> None:
    world = world_of()
    asked: list[Any] = [world.ask_write("pump-3.terminal_3", True, OPERATOR)]
    asked.append(world.ask_command("run_forward_all", drive=LINE, origin=ENGINEER, frequency=50.0))
    asked.append(world.ask_write("pump-1.terminal_3", True, OPERATOR))
    asked.append(world.ask_write("pump-3.terminal_3", False, OPERATOR))
    assert [world.until(one, 60.0).verdict for one in asked] == [Verdict.CONFIRMED] * 4
    assert [text[:2] for text in world.sent()] == ["03", "00", "01", "03"]
    assert all(drive.state.running for drive in world.drives.values()), "no terminal drops the run"


@pytest.mark.parametrize("percent", [100.1, -0.1])
def test_t2_beyond_what_the_layout_takes(percent: float) -> None:
    world = world_of()
    assert is_refused(command(world, "run_forward_all", frequency=percent), Cause.OUT_OF_RANGE)
    assert to_all(world) == []


def test_t2_what_the_site_allows_for_one_drive_holds_for_all() -> None:
    world = world_of(ranges={"frequency_command": (Fraction(0), Fraction(50))})
    outcome = command(world, "run_forward_all", frequency=90.0)
    assert is_refused(outcome, Cause.OUT_OF_RANGE, "pump-1", "frequency_command = 54 is outside 0..50 Hz")
    assert command(world, "run_forward_all", frequency=80.0).verdict is Verdict.CONFIRMED
    assert len(to_all(world)) == 1


def test_t3_a_drive_that_has_to_be_taken_along_slowly_is_not_commanded_with_all() -> None:
    world = world_of(limits={"frequency_command": Pace(slew=Fraction(5))})
    assert is_refused(command(world, "run_forward_all", frequency=50.0), Cause.PRECONDITION, "slew")


def test_drives_that_start_one_after_another_do_not_start_together() -> None:
    site = replace(site_with(), starts=(StartGroup("pumps", ("pump-1", "pump-2"), 5.0),))
    world = World(site)
    world.run(1.5)
    assert is_refused(command(world, "run_forward_all", frequency=50.0), Cause.PRECONDITION, "pump-1")


def test_h18_it_is_off_until_the_site_says_who_may() -> None:
    world = world_of(role=None)
    outcome = command(world, "run_forward_all", origin=ADMIN, frequency=50.0)
    assert is_refused(outcome, Cause.UNKNOWN_COMMAND, "broadcast in the site file")
    assert to_all(world) == []


def test_e1_it_takes_the_right_that_the_site_names_and_a_stop_an_operators() -> None:
    world = world_of()
    assert is_refused(command(world, "run_forward_all", origin=OPERATOR, frequency=50.0), Cause.NO_RIGHTS)
    assert to_all(world) == []
    assert command(world, "stop_all", origin=OPERATOR).verdict is Verdict.CONFIRMED


def test_h18_drives_that_understand_something_else_by_it_are_never_sent_it() -> None:
    mixed = site_with(2)
    teco = make_site(1, first_unit=9).lines[0].drives[0]
    [line] = mixed.lines
    world = World(replace(mixed, lines=(replace(line, drives=(*line.drives, teco)),)))
    world.run(1.0)
    outcome = command(world, "run_forward_all", origin=ADMIN, frequency=50.0)
    assert is_refused(outcome, Cause.UNKNOWN_COMMAND, "do not all understand the same")
    assert to_all(world) == []


def test_what_speaks_against_one_drive_speaks_against_all() -> None:
    silent = world_of()
    silent.drives["pump-2"].connected = False
    silent.run(10.0)
    outcome = command(silent, "run_forward_all", frequency=50.0)
    assert (outcome.verdict, outcome.cause) == (Verdict.FAILED, Cause.NO_ANSWER)
    assert to_all(silent) == []
    runs_on = world_of(comm_loss=LossDemand("stop"))
    outcome = command(runs_on, "run_forward_all", frequency=50.0)
    assert is_refused(outcome, Cause.PRECONDITION, "pump-1", "f5_05 is without_detection")
    assert to_all(runs_on) == []


def test_a_drive_that_takes_its_commands_elsewhere_is_named() -> None:
    site = site_with()
    [line] = site.lines
    second = line.drives[1]
    elsewhere = replace(second, settings={**second.settings, "c1_02": Fraction(1)})
    drives = (line.drives[0], elsewhere, line.drives[2])
    world = World(replace(site, lines=(replace(line, drives=drives),)))
    world.run(1.5)
    outcome = command(world, "run_forward_all", frequency=50.0)
    assert is_refused(outcome, Cause.PRECONDITION, "pump-2", "c1_02: serial")


def test_h12_it_takes_the_leases_of_all_of_them() -> None:
    control = Control(lease="session", ttl=60.0, on_expiry="hold")
    world = world_of(control=control)
    other = Origin(through="test", who="olga", role=Role.OPERATOR)
    assert world.lease(LeaseAct.ACQUIRE, other, "pump-2").verdict is Verdict.CONFIRMED
    outcome = command(world, "run_forward_all", frequency=50.0)
    assert is_refused(outcome, Cause.LEASE, "pump-2", "olga")
    assert to_all(world) == []
    assert world.lease(LeaseAct.RELEASE, other, "pump-2").verdict is Verdict.CONFIRMED
    assert command(world, "run_forward_all", frequency=50.0).verdict is Verdict.CONFIRMED
    refused = world.write("pump-3.frequency_command", 10.0, other)
    assert is_refused(refused, Cause.LEASE, "erika")


def test_r1_intent_and_outcome_are_on_record() -> None:
    world = world_of()
    command(world, "run_forward_all", frequency=50.0)
    [intent] = [e for e in world.journal if e["kind"] == "intent"]
    assert (intent["unit"], intent["what"], intent["words"]) == (
        0,
        "_north.run_forward_all",
        ["0001H", "3A98H"],
    )
    assert intent["by"]["who"] == "erika"
    [sent] = [at for at, text in world.wire if text.startswith("00 ")]
    assert sent >= intent["at"] + world.journal_delay
    [outcome] = [e for e in world.journal if e["kind"] == "outcome"]
    assert outcome["outcome"]["verdict"] == "confirmed"


def test_healthy_drives_that_are_commanded_together_alarm_nobody() -> None:
    world = world_of()
    for name, args in (
        ("run_forward_all", {"frequency": 50.0}),
        ("run_reverse_all", {"frequency": 20.0}),
        ("stop_all", {}),
        ("run_forward_all", {"frequency": 80.0}),
    ):
        assert command(world, name, **args).verdict is Verdict.CONFIRMED
        world.run(12.0)
    assert world.command("stop", drive="pump-2").verdict is Verdict.CONFIRMED
    world.run(12.0)
    assert world.core.alarms.standing() == ()
