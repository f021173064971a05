"""The leases of all drives, and what happens when one ends. Pure.

One client at a time commands a drive. Whoever else asks is refused and told who holds it; a stop needs no
lease. When a lease ends and something under it may still move the motor, the site's ``on_expiry`` acts once
(a stop follows a setpoint that is not confirmed). Every change is in the journal, out of which a restart
takes the leases up again: each holder has one ``ttl`` to return (``safety.md`` H10, H11, H12).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, Protocol

from gateway.bridge.api import ControlState, LeaseAct
from gateway.core.agreed import Kept
from gateway.core.drive import Drive
from gateway.core.guard import refuse
from gateway.core.lease import Lease, Phase, of, shown
from gateway.tag import Cause, Instant, Origin, Outcome, Verdict

TELL_SHARE = 0.25
"""Clients hear of a renewal once it has moved the end by this share of the ttl."""


class Services(Protocol):
    """What leases need from the rest of the core."""

    def record(self, entry: dict[str, Any]) -> object:
        """Append to the journal."""

    def control_changed(self, drive: Drive) -> None:
        """Clients should hear who may command the drive."""

    def tell_event(self, drive: Drive, name: str, text: str) -> None:
        """Tell everybody that something happened."""

    def lost_lease(self, drive: Drive, former: Origin) -> None:
        """End what this client has under way on the drive."""

    def act(self, drive: Drive, action: str, why: str) -> None:
        """Carry out the action that follows the end of a lease; `Leases.acted` hears how it went."""


class Leases:
    """The leases of all drives. Drives without leases (``lease: off``) let everybody through."""

    def __init__(self, drives: Iterable[Drive], services: Services) -> None:
        self._drives = {drive.name: drive for drive in drives}
        self._services = services
        self._leases: dict[str, Lease] = {}
        self._told: dict[str, Lease] = {}
        self._due: set[str] = set()
        """Drives on which an action is begun and not confirmed."""
        self._now = Instant(0.0, 0)

    def moment(self, now: Instant) -> None:
        """The present moment."""
        self._now = now

    def get(self, drive: Drive) -> Lease:
        """The lease of a drive as it stands."""
        return self._leases.get(drive.name, Lease())

    # -- commands

    def check(self, drive: Drive, origin: Origin) -> None:
        """H12: whoever commands a drive must hold its lease, or be able to get it by commanding.

        Raises:
            Ended: if he cannot.
        """
        lease, control = self.get(drive), drive.config.control
        if control.lease == "off" or lease.is_held_by(origin):
            return
        self._check_available(drive, lease, origin)
        if lease.void:
            raise refuse(Cause.LEASE, f"{lease.void}; acquire the lease of {drive.name} before commanding it")
        if control.lease == "required" and not lease.is_awaiting(origin):
            raise refuse(Cause.LEASE, f"the lease of {drive.name} must be acquired before commanding it")

    def holds(self, drive: Drive, origin: Origin) -> bool:
        """True while this client may command: asked again when a frame is about to go."""
        lease = self.get(drive)
        return drive.config.control.lease == "off" or (
            lease.is_held_by(origin) and lease.expires > self._now.mono
        )

    def use(self, drive: Drive, origin: Origin, session: int, moves: bool, now: Instant) -> None:
        """A command that passed `check` was accepted: acquire or renew. ``moves``: it can move the motor."""
        self._now = now
        if drive.config.control.lease == "off":
            return
        lease = self.get(drive)
        if not lease.is_held_by(origin):
            did = "returned" if lease.is_awaiting(origin) else "acquired"
            self._hold(drive, origin, session, did, now.mono if moves else lease.moving)
            return
        began = moves and lease.moving is None
        moving = now.mono if moves else lease.moving
        self._leases[drive.name] = replace(
            lease, session=session, expires=self._end_from_now(drive), moving=moving
        )
        if began:
            self._note(drive, "commanded", origin)
        self._tell(drive)

    def started(self, drive: Drive, origin: Origin, at: float) -> None:
        """A run command of the holder left at ``at`` (monotonic): his lease counts from then, for the command
        may have waited for its turn since he asked (H10)."""
        lease, expires = self.get(drive), at + drive.config.control.ttl
        if lease.is_held_by(origin) and lease.expires < expires:
            self._leases[drive.name] = replace(lease, expires=expires)
            self._tell(drive)

    def stopping(self, drive: Drive, origin: Origin, now: Instant) -> None:
        """A stop needs no lease and takes none; that of its holder is renewed."""
        if self.get(drive).is_held_by(origin):
            self.use(drive, origin, self.get(drive).session, False, now)

    def stopped(self, drive: Drive, asked: float) -> None:
        """A stop that was asked then (monotonic) is confirmed: what was commanded before it moves nothing."""
        lease = self.get(drive)
        if drive.name in self._due:
            self._note(drive, "acted", None)
        if lease.moving is None or lease.moving > asked:
            return
        self._leases[drive.name] = replace(lease, moving=None)
        if lease.phase is Phase.OPEN:
            self._leases[drive.name] = Lease(void=lease.void)
        self._note(drive, "stopped", None)
        self._tell(drive)

    # -- leases by name

    def carry_out(
        self, act: LeaseAct, drive: Drive, origin: Origin, session: int, whom: str, now: Instant
    ) -> Outcome:
        """Acquire, renew, release or take the lease of a drive, as the client asks.

        Raises:
            Ended: if he may not.
        """
        self._now = now
        if drive.config.control.lease == "off":
            reason = f"{drive.name} needs no lease (control: {{lease: off}} in the site file)"
            return Outcome(verdict=Verdict.CONFIRMED, reason=reason)
        match act:
            case LeaseAct.ACQUIRE:
                reason = self._acquire(drive, origin, session)
            case LeaseAct.RENEW:
                reason = self._renew(drive, origin, session)
            case LeaseAct.RELEASE:
                reason = self._release(drive, origin)
            case LeaseAct.TAKE:
                reason = self._take(drive, origin, session, whom)
        return Outcome(verdict=Verdict.CONFIRMED, reason=reason)

    def _acquire(self, drive: Drive, origin: Origin, session: int) -> str:
        lease = self.get(drive)
        if lease.is_held_by(origin):
            return self._renew(drive, origin, session)
        self._check_available(drive, lease, origin)
        did = "returned" if lease.is_awaiting(origin) else "acquired"
        self._hold(drive, origin, session, did, lease.moving)
        return f"{drive.name} is yours for {drive.config.control.ttl:g} s, longer while it is renewed"

    def _renew(self, drive: Drive, origin: Origin, session: int) -> str:
        lease = self.get(drive)
        if lease.is_awaiting(origin):
            self._hold(drive, origin, session, "returned", lease.moving)
        elif lease.is_held_by(origin):
            expires = self._end_from_now(drive)
            self._leases[drive.name] = replace(lease, session=session, expires=expires)
            self._tell(drive)
        else:
            self._check_available(drive, lease, origin)
            raise refuse(Cause.LEASE, f"you do not hold the lease of {drive.name}; acquire it")
        return f"renewed for {drive.config.control.ttl:g} s"

    def _release(self, drive: Drive, origin: Origin) -> str:
        lease = self.get(drive)
        if not lease.is_held_by(origin) and not lease.is_awaiting(origin):
            self._check_available(drive, lease, origin)
            raise refuse(Cause.LEASE, f"you do not hold the lease of {drive.name}")
        if lease.moving is None:
            self._leases[drive.name] = Lease(void=lease.void)
            text = "released"
        else:
            expires = self._end_from_now(drive)
            self._leases[drive.name] = replace(lease, phase=Phase.OPEN, holder=None, expires=expires)
            text = f"released; unless somebody acquires it within {drive.config.control.ttl:g} s: "
            text += _in_words(drive)
        self._services.lost_lease(drive, origin)
        self._note(drive, "released", origin)
        self._tell(drive)
        return text

    def _take(self, drive: Drive, origin: Origin, session: int, whom: str) -> str:
        lease, former = self.get(drive), self.get(drive).holder
        if whom and (former is None or former.who != whom):
            held = f"is held by {shown(former)}" if former else "is free"
            raise refuse(Cause.LEASE, f"{drive.name} {held}; it was to be taken from {whom}")
        if not lease.is_guarded or lease.is_held_by(origin) or former is None:
            return self._acquire(drive, origin, session)
        self._services.lost_lease(drive, former)
        self._hold(drive, origin, session, "taken", lease.moving, former)
        text = f"{shown(origin)} took {drive.name} from {shown(former)}"
        self._services.tell_event(drive, "lease_taken", text)
        return text

    # -- clients that go

    def gone(self, origin: Origin, may_return: bool, now: Instant) -> None:
        """A client is gone: its connection broke, and it may return within the ttl; or its session ended,
        and with it every lease that it held."""
        self._now = now
        for drive in self._held_by(lambda lease: lease.is_held_by(origin)):
            if may_return:
                self._await(drive)
            else:
                self._end(drive, "lost")

    def left(self, session: int, now: Instant) -> None:
        """A bridge session is gone: its adapter died. Clients with sessions of their own have lost them and
        may return; others are known by their name, and nothing changes for them."""
        self._now = now
        for drive in self._held_by(lambda lease: lease.is_held_through(session)):
            self._await(drive)

    def void(self, drive: Drive, reason: str, now: Instant) -> None:
        """What was agreed with this drive is over (it restarted, or obeys somebody else): the lease ends
        without any action, and the next one must be acquired by name (H7, H8, H13)."""
        self._now = now
        former = self.get(drive).holder
        self._leases[drive.name] = Lease(void=reason)
        if former is not None:
            self._services.lost_lease(drive, former)
        self._note(drive, "void", former, reason)
        self._tell(drive)

    # -- time

    def tick(self, now: Instant) -> None:
        """End what has expired."""
        self._now = now
        for name, lease in list(self._leases.items()):
            if lease.phase is not Phase.FREE and lease.expires <= now.mono:
                self._end(self._drives[name], "expired")

    def wake(self) -> float | None:
        """When the next lease expires (monotonic)."""
        return min((x.expires for x in self._leases.values() if x.phase is not Phase.FREE), default=None)

    def acted(self, drive: Drive, outcome: Outcome) -> None:
        """What became of an action; one that is not confirmed is begun again after a restart."""
        if outcome.verdict is Verdict.CONFIRMED:
            if drive.name in self._due:
                self._note(drive, "acted", None, outcome.reason)
            return
        if outcome.verdict is Verdict.SUPERSEDED:
            return
        text = f"what follows the end of the lease of {drive.name} is not confirmed: {outcome.reason}"
        self._services.tell_event(drive, "lease_action_failed", text)

    # -- restart

    def restore(self, kept: Mapping[str, Kept], now: Instant) -> None:
        """Take up the leases of before the restart: each holder has one ttl to return."""
        self._now = now
        for name, was in kept.items():
            drive = self._drives.get(name)
            if drive is None or drive.config.control.lease == "off":
                continue
            moving = now.mono if was.moving else None
            phase = Phase(was.phase)
            if phase is Phase.FREE:
                self._leases[name] = Lease(void=was.void)
            else:
                phase = Phase.AWAITED if phase is Phase.HELD else phase
                self._leases[name] = Lease(
                    phase, was.holder, expires=self._end_from_now(drive), moving=moving, void=was.void
                )
            self._told[name] = self._leases[name]  # whoever joins is told how it stands
            if was.due:
                self._due.add(name)
                self._services.act(drive, was.due, f"the lease {of(was.by)}ended before the restart")

    # -- for those who look

    def state(self, drive: Drive, now: Instant) -> ControlState:
        """The lease as clients see it; the gateway's other rules about the drive are added elsewhere."""
        lease = self.get(drive)
        left = lease.expires - now.mono
        held = lease.phase is not Phase.FREE
        return ControlState(
            drive=drive.name,
            phase=lease.phase.value,
            holder=lease.holder,
            until=now.wall + round(left * 1e9) if held else 0,
            then=_action(drive) if held and lease.moving is not None else "",
            void=lease.void,
        )

    # -- changes

    def _check_available(self, drive: Drive, lease: Lease, origin: Origin) -> None:
        """Raises Ended if somebody else has it."""
        if lease.holder is None or lease.is_awaiting(origin) or lease.is_held_by(origin):
            return
        left = max(0.0, lease.expires - self._now.mono)
        may = "who was cut off and may return" if lease.phase is Phase.AWAITED else "unless he renews"
        raise refuse(
            Cause.LEASE,
            f"{drive.name} is held by {shown(lease.holder)}, for {left:.0f} s {may}; "
            f"stop is always allowed, {drive.config.control.takeover} may take the lease",
        )

    def _hold(
        self,
        drive: Drive,
        origin: Origin,
        session: int,
        did: str,
        moving: float | None,
        former: Origin | None = None,
    ) -> None:
        expires = self._end_from_now(drive)
        self._leases[drive.name] = Lease(Phase.HELD, origin, session, expires, moving)
        self._note(drive, did, origin, f"from {shown(former)}" if former else "")
        self._tell(drive)

    def _await(self, drive: Drive) -> None:
        lease = self.get(drive)
        expires = min(lease.expires, self._end_from_now(drive))
        self._leases[drive.name] = replace(lease, phase=Phase.AWAITED, expires=expires)
        self._note(drive, "awaited", lease.holder)
        self._tell(drive)

    def _end(self, drive: Drive, did: str) -> None:
        """A lease is over because nobody renewed it: what it left behind is made good, once."""
        lease = self.get(drive)
        action = _action(drive) if lease.moving is not None else ""
        self._leases[drive.name] = Lease(void=lease.void)
        self._note(drive, did, lease.holder, due=action if action != "hold" else "")
        if lease.holder is not None:
            self._services.lost_lease(drive, lease.holder)
        text = f"the lease {of(lease.holder)}is {did}"
        self._services.tell_event(
            drive,
            f"lease_{did}",
            f"{text}: {_in_words(drive)}" if action else f"{text}; it left nothing behind",
        )
        if action not in ("", "hold"):
            self._services.act(drive, action, text)
        self._tell(drive)

    def _note(self, drive: Drive, did: str, by: Origin | None, reason: str = "", due: str = "") -> None:
        lease = self.get(drive)
        (self._due.add if due else self._due.discard)(drive.name)
        entry: dict[str, Any] = {
            "kind": "lease",
            "drive": drive.name,
            "did": did,
            "by": by,
            "holder": lease.holder,
            "phase": lease.phase.value,
            "moving": lease.moving is not None,
            "void": lease.void,
            "due": due,
            "reason": reason,
        }
        self._services.record(entry)

    def _tell(self, drive: Drive) -> None:
        """Tell clients what changed; a renewal only now and then."""
        lease, told = self.get(drive), self._told.get(drive.name, Lease())
        apart = abs(lease.expires - told.expires) < TELL_SHARE * drive.config.control.ttl
        if apart and replace(lease, expires=0.0, session=0) == replace(told, expires=0.0, session=0):
            return
        self._told[drive.name] = lease
        self._services.control_changed(drive)

    def _held_by(self, which: Callable[[Lease], bool]) -> Iterator[Drive]:
        yield from [self._drives[name] for name, lease in self._leases.items() if which(lease)]

    def _end_from_now(self, drive: Drive) -> float:
        return self._now.mono + drive.config.control.ttl


def _action(drive: Drive) -> str:
    """What follows the end of a lease: ``stop``, ``hold`` or ``setpoint: x``."""
    return drive.config.control.on_expiry or "hold"


def _in_words(drive: Drive) -> str:
    action = _action(drive)
    if action == "stop":
        return f"{drive.name} is stopped"
    return f"{drive.name} goes on as it is" if action == "hold" else f"{drive.name} gets the {action}"
