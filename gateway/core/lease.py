"""The lease of one drive: who may command it, until when, and what he leaves behind when he goes. Pure.

A lease lives while it is renewed: by every command of its holder, by an explicit renewal, or by an adapter
that knows its client to be there. Reading renews nothing. ``safety.md`` H10 and H12.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from gateway.tag import Origin


class Phase(StrEnum):
    """What has become of a lease."""

    FREE = "free"
    """Nobody holds it."""
    HELD = "held"
    AWAITED = "awaited"
    """The holder's client is gone (a crash, a lost connection, a restart of the gateway); until the lease
    expires he may return, and nobody else may have it."""
    OPEN = "open"
    """Given up, but what was commanded under it may still move the motor: until it expires anybody may
    acquire it."""


@dataclass(frozen=True, slots=True)
class Lease:
    """``expires`` is monotonic; ``session`` the bridge session that the holder came through. ``moving`` is
    when something that can move the motor was commanded last (monotonic), None when nothing was or it was
    stopped since: then there is nothing to make good when the lease ends. ``void`` says why nobody may
    command the drive before he acquires the lease by name; empty: commands may."""

    phase: Phase = Phase.FREE
    holder: Origin | None = None
    session: int = 0
    expires: float = 0.0
    moving: float | None = None
    void: str = ""

    def is_held_by(self, origin: Origin) -> bool:
        """True for the holder himself."""
        return self.phase is Phase.HELD and self.holder is not None and same(self.holder, origin)

    def is_awaiting(self, origin: Origin) -> bool:
        """True for the holder who returns, also in a new session of the same user."""
        holder = self.holder
        if self.phase is not Phase.AWAITED or holder is None:
            return False
        return same(holder, origin) or (
            holder.authenticated
            and origin.authenticated
            and (holder.through, holder.who) == (origin.through, origin.who)
        )

    def is_held_through(self, session: int) -> bool:
        """True while a session of some client that came through this bridge session holds it."""
        return (
            self.phase is Phase.HELD and self.session == session and bool(self.holder and self.holder.session)
        )

    @property
    def is_guarded(self) -> bool:
        """True while nobody but the holder may have it."""
        return self.phase in (Phase.HELD, Phase.AWAITED)


def same(holder: Origin, origin: Origin) -> bool:
    """True when both are one client: one session where the way in has sessions, else one name at one
    address."""
    if holder.through != origin.through:
        return False
    if holder.session or origin.session:
        return holder.session == origin.session
    return (holder.who, holder.address) == (origin.who, origin.address)


def shown(origin: Origin) -> str:
    """A client for people: ``anna (opcua, 10.0.0.5)``."""
    return f"{origin.who} ({', '.join(part for part in (origin.through, origin.address) if part)})"


def of(holder: Origin | None) -> str:
    """``of anna (opcua, 10.0.0.5) `` in a sentence; empty where nobody holds it."""
    return f"of {shown(holder)} " if holder else ""
