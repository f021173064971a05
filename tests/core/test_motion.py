"""H7, H8: a frame that writes a terminal or gives a pulse never starts a motor that stands, and never stops
one that was commanded to run. What the gateway cannot know it does not write."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from gateway.mapping.profile import Access, Profile
from gateway.mapping.site import Site
from gateway.simulator.happening import Trip
from gateway.tag import Cause, Outcome, Verdict
from tests.core.test_broadcasting import command, to_all, world_of
from tests.core.world import OPERATOR, World, make_site, site_of
from tests.simulator.master import framed

PUMP = "drive-1"


def sl3() -> World:
    world = World(site_of("shihlin-sl3"))
    world.run(1.0)
    assert world.command("take_control", drive=PUMP).verdict is Verdict.CONFIRMED
    return world


def run(world: World, name: str = "run_forward") -> None:
    assert world.command(name, drive=PUMP, frequency=20.0).verdict is Verdict.CONFIRMED


def words(world: World) -> list[str]:
    """What was written to 1001H, in order."""
    return [text[12:17] for text in world.sent("06") if text.startswith("01 06 10 01")]


def switch(world: World, name: str = "input_rl", on: bool = True) -> Outcome:
    return world.write(f"{PUMP}.{name}", on, OPERATOR)


def another_master_writes(world: World, word: int) -> None:
    """Another master writes 1001H, unseen."""
    adu = framed(1, 0x06, 0x10, 0x01, word >> 8, word & 0xFF)
    assert world.drives[PUMP].handle(adu, world.now) is not None


def is_refused(outcome: Outcome, *said: str) -> bool:
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.PRECONDITION), outcome
    return all(word in outcome.reason for word in said)


def test_a_switch_keeps_the_run_of_a_motor_that_runs() -> None:
    world = sl3()
    run(world, "run_reverse")
    assert switch(world).verdict is Verdict.CONFIRMED
    assert words(world)[-1] == "00 0C"


def test_a_switch_starts_no_motor_that_another_master_stopped() -> None:
    world = sl3()
    run(world)
    another_master_writes(world, 0)
    world.run(5.0)
    assert not world.drives[PUMP].state.running
    assert switch(world).verdict is Verdict.CONFIRMED
    assert words(world)[-1] == "00 08"
    world.run(3.0)
    assert not world.drives[PUMP].state.running


def test_a_switch_says_stop_to_a_drive_that_has_tripped() -> None:
    world = sl3()
    run(world)
    world.drives[PUMP].post(Trip("overcurrent"))
    world.run(5.0)
    assert switch(world).verdict is Verdict.CONFIRMED
    assert words(world)[-1] == "00 08"


def test_a_switch_does_not_start_again_a_motor_that_slows_down() -> None:
    world = World(site_of("shihlin-sl3"), deceleration=20.0)
    world.run(1.0)
    world.command("take_control", drive=PUMP)
    run(world)
    world.run(3.0)
    stop = world.ask_command("stop", drive=PUMP)
    world.until(lambda: "00 00" in words(world) or None, 5.0)
    world.run(0.3)
    assert world.drives[PUMP].state.running
    assert switch(world).verdict is Verdict.CONFIRMED
    assert words(world)[-1] == "00 08"
    assert world.until(stop, 60.0).verdict is Verdict.CONFIRMED


def test_a_switch_is_refused_while_a_run_is_not_shown_yet() -> None:
    world = World(site_of("shihlin-sl3"))
    world.run(1.0)
    world.command("take_control", drive=PUMP)
    handle = world.drives[PUMP].handle
    stands = [False]

    def deaf(adu: bytes, now: float) -> bytes | None:
        """Takes the run, and does nothing."""
        return adu if stands[0] and adu[:4] == bytes((1, 6, 0x10, 1)) else handle(adu, now)

    world.drives[PUMP].handle = deaf  # type: ignore[method-assign]
    stands[0] = True
    assert world.command("run_forward", drive=PUMP, frequency=20.0).verdict is not Verdict.CONFIRMED
    assert is_refused(switch(world), "run_forward was commanded", "give it a stop")
    assert words(world) == ["00 02"]


def test_after_a_restart_of_the_gateway_a_motor_that_runs_is_not_stopped_by_a_switch() -> None:
    world = sl3()
    run(world)
    world.restart()
    world.run(2.0)
    before = words(world)
    assert is_refused(switch(world), "what it was commanded is not known", "run_forward")
    assert words(world) == before
    assert world.drives[PUMP].state.running
    run(world)
    assert switch(world).verdict is Verdict.CONFIRMED
    assert words(world)[-1] == "00 0A"


def test_after_a_restart_of_the_gateway_a_motor_that_stands_takes_its_switches() -> None:
    world = sl3()
    world.restart()
    world.run(2.0)
    assert switch(world).verdict is Verdict.CONFIRMED
    assert words(world)[-1] == "00 08"


def test_a_motor_that_somebody_else_started_is_not_stopped_by_a_switch() -> None:
    world = sl3()
    run(world)
    assert world.command("stop", drive=PUMP).verdict is Verdict.CONFIRMED
    another_master_writes(world, 2)
    world.run(2.0)
    assert world.drives[PUMP].state.running
    before = words(world)
    assert is_refused(switch(world), "stop was commanded last")
    assert words(world) == before


def test_a_switch_waits_for_a_look_at_the_motor() -> None:
    world = sl3()
    run(world)
    switch(world)
    frames = [text for _, text in world.wire]
    [written] = [n for n, text in enumerate(frames) if text.startswith("01 06 10 01 00 0A")]
    assert frames[written - 1].startswith("01 03 10 01 00 01")


# -- a control word that cannot be read, with a reset pulse in it: the tutorial's drive is such a one


def with_word_unreadable(profile: Profile) -> Profile:
    points = {
        name: replace(point, access=Access.WRITE) if point.address == 1 else point
        for name, point in profile.points.items()
    }
    return replace(profile, points=points)


def unreadable() -> World:
    site: Site = make_site()
    [line] = site.lines
    [drive] = line.drives
    other = replace(drive, profile=with_word_unreadable(drive.profile))
    world = World(replace(site, lines=(replace(line, drives=(other,)),)), twins=site)
    world.run(1.0)
    return world


def pulse(world: World) -> list[str]:
    outcome = world.command("reset_fault")
    assert outcome.verdict is Verdict.CONFIRMED, outcome
    return [text[21:26] for text in world.sent() if text.startswith("05 10 00 01")][-2:]


def test_a_reset_does_not_run_a_drive_that_tripped() -> None:
    world = unreadable()
    world.command("run_forward", frequency=20.0)
    world.drives["fan-1"].post(Trip("fault_overcurrent"))
    world.run(3.0)
    assert pulse(world) == ["00 08", "00 00"]


def test_a_reset_keeps_the_run_of_a_drive_that_runs() -> None:
    world = unreadable()
    world.command("run_reverse", frequency=20.0)
    world.run(1.0)
    assert pulse(world) == ["00 0B", "00 03"]


# -- commands to all


def registers_apart(world: World) -> None:
    """From now on 0000H of a drive shows what was written there, whatever was sent to all since."""
    for drive in world.drives.values():
        drive.handle = apart(drive.handle)  # type: ignore[method-assign]


def apart(heard: Callable[[bytes, float], bytes | None]) -> Callable[[bytes, float], bytes | None]:
    written = bytes(2)

    def handle(adu: bytes, now: float) -> bytes | None:
        nonlocal written
        answer = heard(adu, now)
        if answer is not None and adu[1:4] == b"\x10\x00\x00":
            written = adu[7:9]
        if answer is not None and adu[1:4] == b"\x03\x00\x00":
            return framed(*answer[:3], *written, *answer[5:-2])
        return answer

    return handle


@pytest.mark.parametrize("apart", [False, True])
def test_a_reset_to_all_keeps_the_run_bits_of_drives_that_run(apart: bool) -> None:
    world = world_of()
    if apart:
        registers_apart(world)
    command(world, "run_forward_all", frequency=50.0)
    assert command(world, "reset_fault_all").verdict is Verdict.CONFIRMED
    assert to_all(world)[-2:] == ["00 10 00 01 00 01 02 00 21", "00 10 00 01 00 01 02 00 01"]
    assert all(drive.state.running for drive in world.drives.values())


@pytest.mark.parametrize("apart", [False, True])
def test_a_terminal_after_a_stop_to_all_says_stop(apart: bool) -> None:
    world = world_of()
    if apart:
        registers_apart(world)
    assert world.command("run_forward", drive="pump-2", frequency=1.0).verdict is Verdict.CONFIRMED
    assert command(world, "stop_all").verdict is Verdict.CONFIRMED
    assert world.sent()[-1].startswith("00 "), "no stop of its own was needed"
    assert world.write("pump-2.terminal_6", True, OPERATOR).verdict is Verdict.CONFIRMED
    assert world.sent()[-1].startswith("02 10 00 00 00 01 02 00 20")
    assert not world.drives["pump-2"].state.running


def test_a_terminal_after_a_run_of_all_that_the_word_does_not_show_is_refused() -> None:
    world = world_of()
    registers_apart(world)
    command(world, "run_forward_all", frequency=50.0)
    before = world.sent()
    assert is_refused(world.write("pump-2.terminal_6", True, OPERATOR), "its command word says stop")
    assert world.sent() == before
    assert world.drives["pump-2"].state.running


def test_after_a_restart_a_word_that_says_run_starts_no_drive_that_stands() -> None:
    world = world_of()
    registers_apart(world)
    world.command("run_forward", drive="pump-2", frequency=1.0)
    command(world, "stop_all")
    world.restart()
    world.run(2.0)
    before = world.sent()
    assert is_refused(world.write("pump-2.terminal_6", True, OPERATOR), "run_forward", "stop")
    assert world.sent() == before
    assert world.command("stop", drive="pump-2").verdict is Verdict.CONFIRMED
    assert world.write("pump-2.terminal_6", True, OPERATOR).verdict is Verdict.CONFIRMED
    assert world.sent()[-1].startswith("02 10 00 00 00 01 02 00 20")
