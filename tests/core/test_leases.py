"""Leases by themselves: who may command, what ends a lease, and that its end is made good once (H10, H12)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.bridge.api import LeaseAct
from gateway.core.agreed import Agreed
from gateway.core.drive import Drive
from gateway.core.guard import Ended
from gateway.core.lease import Phase
from gateway.core.leases import Leases
from gateway.mapping.site import Control, LeaseMode
from gateway.tag import Cause, Instant, Origin, Outcome, Role, Verdict
from tests.core.world import make_site

ANNA = Origin(through="opcua", who="anna", role=Role.OPERATOR, session="s1")
ANNA_AGAIN = Origin(through="opcua", who="anna", role=Role.OPERATOR, session="s2")
BOB = Origin(through="mqtt", who="bob", role=Role.OPERATOR, address="mqtt://b:1883", authenticated=False)
ERIKA = Origin(through="cli", who="erika", role=Role.ENGINEER)
TTL = 10.0


@dataclass
class Desk:
    """Leases of one drive, with everything that they ask of the rest of the core."""

    mode: LeaseMode = "session"
    on_expiry: str = "stop"
    now: float = 100.0
    journal: list[dict[str, Any]] = field(default_factory=list)
    events: list[str] = field(default_factory=list)
    acted: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        config = make_site().drives[0]
        self.drive = Drive(replace(config, control=Control(self.mode, TTL, self.on_expiry)))
        self.leases = Leases([self.drive], self)

    def record(self, entry: dict[str, Any]) -> None:
        self.journal.append(msgspec.to_builtins(entry))

    def control_changed(self, drive: Drive) -> None:
        self.leases.state(drive, self.instant)

    def tell_event(self, drive: Drive, name: str, text: str) -> None:
        self.events.append(name)

    def lost_lease(self, drive: Drive, former: Origin) -> None:
        self.lost.append(former.who)

    def act(self, drive: Drive, action: str, why: str) -> None:
        self.acted.append(action)

    @property
    def instant(self) -> Instant:
        return Instant(self.now, round(self.now * 1e9))

    def wait(self, seconds: float) -> None:
        """Let time pass, stopping at each moment that the leases ask for."""
        end = self.now + seconds
        while (wake := self.leases.wake()) is not None and wake <= end:
            self.now = max(self.now, wake)
            self.leases.tick(self.instant)
        self.now = end

    def command(self, who: Origin, session: int = 1, moves: bool = True) -> None:
        self.leases.check(self.drive, who)
        self.leases.use(self.drive, who, session, moves, self.instant)

    def ask(self, act: LeaseAct, who: Origin, session: int = 1, whom: str = "") -> Outcome:
        return self.leases.carry_out(act, self.drive, who, session, whom, self.instant)

    def refused(self, who: Origin) -> str:
        with pytest.raises(Ended) as ended:
            self.command(who)
        assert ended.value.outcome.cause is Cause.LEASE
        return ended.value.outcome.reason

    def phase(self) -> Phase:
        return self.leases.get(self.drive).phase

    def restarted(self) -> Desk:
        """The same after a crash and a restart, by what the journal remembers."""
        memory = Agreed()
        for entry in self.journal:
            memory.fold(entry)
        memory = msgspec.json.decode(msgspec.json.encode(memory), type=Agreed)
        again = Desk(self.mode, self.on_expiry, now=1.0, journal=list(self.journal))
        again.leases.restore(memory.leases, again.instant)
        return again


def test_h12_the_first_command_takes_the_lease_and_others_are_told_who_has_it() -> None:
    desk = Desk()
    desk.command(ANNA)
    reason = desk.refused(BOB)
    assert "anna (opcua)" in reason and "stop is always allowed" in reason
    desk.command(ANNA)


def test_required_means_acquired_by_name() -> None:
    desk = Desk(mode="required")
    assert "acquired" in desk.refused(ANNA)
    desk.ask(LeaseAct.ACQUIRE, ANNA)
    desk.command(ANNA)


def test_off_lets_everybody_through() -> None:
    desk = Desk(mode="off")
    for who in (ANNA, BOB, ERIKA):
        desk.command(who)
        assert desk.ask(LeaseAct.ACQUIRE, who).verdict is Verdict.CONFIRMED
        assert desk.leases.holds(desk.drive, who)
    desk.wait(10 * TTL)
    assert not desk.acted and not desk.journal


@pytest.mark.parametrize("action", ["stop", "setpoint: 20"])
def test_h10_a_client_that_dies_is_followed_by_the_action_once(action: str) -> None:
    desk = Desk(on_expiry=action)
    desk.command(ANNA)
    desk.wait(TTL - 0.1)
    assert not desk.acted
    desk.wait(0.1)
    assert (desk.acted, desk.lost, desk.events) == ([action], ["anna"], ["lease_expired"])
    desk.wait(10 * TTL)
    assert desk.acted == [action]
    desk.command(BOB)


def test_h10_hold_does_nothing_and_says_so() -> None:
    desk = Desk(on_expiry="hold")
    desk.command(ANNA)
    desk.wait(TTL)
    assert (desk.acted, desk.events) == ([], ["lease_expired"])


def test_h10_a_lease_under_which_nothing_moved_ends_without_action() -> None:
    desk = Desk()
    desk.command(ANNA, moves=False)
    desk.ask(LeaseAct.RENEW, ANNA)
    desk.wait(TTL)
    assert not desk.acted
    assert desk.events == ["lease_expired"]


def test_h10_what_was_stopped_is_not_stopped_again() -> None:
    desk = Desk()
    desk.command(ANNA)
    desk.leases.stopped(desk.drive, asked=desk.now)
    desk.wait(TTL)
    assert not desk.acted


def test_h10_a_run_asked_after_the_stop_is_made_good() -> None:
    desk = Desk()
    desk.command(ANNA)
    asked = desk.now
    desk.wait(1.0)
    desk.command(ANNA)
    desk.leases.stopped(desk.drive, asked)
    desk.wait(TTL)
    assert desk.acted == ["stop"]


def test_a_session_that_ends_loses_its_lease_at_once() -> None:
    desk = Desk()
    desk.command(ANNA)
    desk.leases.gone(ANNA_AGAIN, may_return=False, now=desk.instant)
    assert not desk.acted, "another session of the same user"
    desk.leases.gone(ANNA, may_return=False, now=desk.instant)
    assert (desk.acted, desk.events) == (["stop"], ["lease_lost"])


@pytest.mark.parametrize("how", ["connection", "adapter"])
def test_a_client_that_is_cut_off_may_return_in_time(how: str) -> None:
    desk = Desk()
    desk.command(ANNA, session=3)
    if how == "connection":
        desk.leases.gone(ANNA, may_return=True, now=desk.instant)
    else:
        desk.leases.left(3, desk.instant)
    desk.wait(TTL / 2)
    assert "may return" in desk.refused(BOB)
    desk.command(ANNA_AGAIN, session=4)
    desk.wait(TTL - 0.1)
    assert not desk.acted
    desk.wait(0.1)
    assert desk.acted == ["stop"]


def test_a_client_that_mqtt_cannot_tell_apart_does_not_return_under_another_broker() -> None:
    desk = Desk()
    desk.command(BOB)
    desk.leases.left(1, desk.instant)
    desk.refused(replace_address(BOB, "mqtt://other:1883"))


def replace_address(origin: Origin, address: str) -> Origin:
    return msgspec.structs.replace(origin, address=address)


def test_released_the_drive_is_anybodys_and_the_countdown_runs_on() -> None:
    desk = Desk()
    desk.command(ANNA)
    assert "fan-1 is stopped" in desk.ask(LeaseAct.RELEASE, ANNA).reason
    desk.wait(TTL / 2)
    desk.command(BOB, moves=False)
    desk.wait(TTL - 0.1)
    assert not desk.acted
    desk.wait(0.1)
    assert desk.acted == ["stop"], "what anna left running is bob's now"


def test_released_after_a_stop_it_is_simply_free() -> None:
    desk = Desk()
    desk.command(ANNA)
    desk.leases.stopped(desk.drive, asked=desk.now)
    desk.ask(LeaseAct.RELEASE, ANNA)
    assert desk.phase() is Phase.FREE
    assert desk.leases.wake() is None


def test_taking_over_is_told_and_the_old_holder_may_do_nothing_more() -> None:
    desk = Desk()
    desk.command(ANNA)
    with pytest.raises(Ended):
        desk.ask(LeaseAct.TAKE, ERIKA, whom="bob")
    assert desk.ask(LeaseAct.TAKE, ERIKA, whom="anna").verdict is Verdict.CONFIRMED
    assert (desk.lost, desk.events) == (["anna"], ["lease_taken"])
    assert "erika (cli)" in desk.refused(ANNA)
    desk.wait(TTL)
    assert desk.acted == ["stop"], "what anna started is erika's now"


def test_renewing_and_releasing_are_the_holders() -> None:
    desk = Desk()
    for act in (LeaseAct.RENEW, LeaseAct.RELEASE):
        with pytest.raises(Ended):
            desk.ask(act, BOB)
    desk.command(ANNA)
    for act in (LeaseAct.RENEW, LeaseAct.RELEASE, LeaseAct.ACQUIRE):
        with pytest.raises(Ended):
            desk.ask(act, BOB)
    assert desk.leases.get(desk.drive).is_held_by(ANNA)


def test_h7_h13_a_void_lease_must_be_acquired_by_name() -> None:
    desk = Desk()
    desk.command(ANNA)
    desk.leases.void(desk.drive, "fan-1 was restarted", desk.instant)
    assert desk.lost == ["anna"]
    assert "fan-1 was restarted" in desk.refused(ANNA)
    assert "fan-1 was restarted" in desk.restarted().refused(ANNA)
    desk.ask(LeaseAct.ACQUIRE, ANNA)
    desk.command(ANNA)
    desk.wait(TTL)
    assert desk.acted == ["stop"]


def test_h11_after_a_restart_the_holder_has_one_ttl_to_return() -> None:
    desk = Desk()
    desk.command(ANNA)
    desk.wait(TTL - 1)
    back = desk.restarted()
    back.wait(TTL - 0.1)
    assert not back.acted
    back.command(ANNA_AGAIN, moves=False)
    back.wait(TTL - 0.1)
    assert not back.acted
    gone = desk.restarted()
    gone.refused(BOB)
    gone.wait(TTL)
    assert gone.acted == ["stop"]


def test_h11_a_restart_finishes_an_action_that_nothing_confirmed() -> None:
    desk = Desk()
    desk.command(ANNA)
    desk.wait(TTL)
    assert desk.restarted().acted == ["stop"]
    desk.leases.acted(desk.drive, Outcome(verdict=Verdict.UNKNOWN))
    assert desk.restarted().acted == ["stop"]
    desk.leases.acted(desk.drive, Outcome(verdict=Verdict.CONFIRMED))
    assert desk.restarted().acted == []


def test_h11_a_restart_acts_on_nothing_else() -> None:
    for do in (lambda desk: None, lambda desk: desk.command(ANNA, moves=False)):
        desk = Desk()
        do(desk)
        again = desk.restarted()
        again.wait(3 * TTL)
        assert not again.acted


CLIENTS = st.sampled_from([ANNA, ANNA_AGAIN, BOB, ERIKA])
HAPPENINGS = st.lists(
    st.one_of(
        st.tuples(st.just("wait"), st.floats(0.1, 1.5 * TTL)),
        st.tuples(st.just("command"), CLIENTS),
        st.tuples(st.just("look"), CLIENTS),
        st.tuples(st.sampled_from(list(LeaseAct)), CLIENTS),
        st.tuples(st.just("gone"), CLIENTS),
        st.tuples(st.just("cut off"), CLIENTS),
        st.tuples(st.just("restart"), st.none()),
    ),
    max_size=30,
)


@given(HAPPENINGS)
def test_h10_h12_whatever_happens_one_client_commands_and_no_motor_is_left_without_one(
    happenings: list[tuple[str, Any]],
) -> None:
    """After each thing that happens: whoever may command is alone, and while something was commanded that
    nobody stopped, a lease with an end stands behind it, or the action was taken."""
    desk, moving = Desk(), False
    for what, who in happenings:
        acts = len(desk.acted)
        accepted = happen(desk, what, who)
        if what == "restart":
            desk, acts = desk.restarted(), 0
        moving = (moving or (what == "command" and accepted)) and len(desk.acted) == acts
        assert sum(desk.leases.holds(desk.drive, who) for who in (ANNA, ANNA_AGAIN, BOB, ERIKA)) <= 1
        if moving:
            wake = desk.leases.wake()
            assert wake is not None and wake <= desk.now + TTL
        desk.acted = desk.acted[-1:]
    desk.wait(2 * TTL)
    assert desk.phase() is Phase.FREE


def happen(desk: Desk, what: str, who: Any) -> bool:
    """Do it; False if it was refused."""
    try:
        match what:
            case "wait":
                desk.wait(who)
            case "command":
                desk.command(who)
            case "look":
                desk.leases.check(desk.drive, who)
            case "gone" | "cut off":
                desk.leases.gone(who, what == "cut off", desk.instant)
            case LeaseAct():
                desk.ask(what, who)
    except Ended as ended:
        assert ended.outcome.cause is Cause.LEASE
        return False
    return True
