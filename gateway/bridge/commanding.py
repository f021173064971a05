"""Who may command a drive: what the bridge tells of it, and what may be done about it."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

import msgspec

from gateway.tag import Origin, Role


class ControlInfo(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The site's rules about who may command a drive: ``control`` of the site file."""

    lease: str = "session"
    ttl: float = 10.0
    on_expiry: str = ""
    takeover: Role = Role.ENGINEER


class ControlState(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, tag="control"):
    """Who may command a drive changed. The first states come right after the watch.

    ``phase`` is ``free``, ``held``, ``awaited`` (the holder was cut off and may return) or ``open`` (given up
    while the motor may move: anybody may acquire it). The lease ends at ``until`` (wall-clock nanoseconds, 0
    for a free one) unless it is renewed, and then ``then`` happens: ``stop``, ``hold``, ``setpoint: x``, or
    nothing.
    """

    drive: str
    phase: str = "free"
    holder: Origin | None = None
    until: int = 0
    then: str = ""
    void: str = ""
    """Why the lease must be acquired by name before anything is commanded; empty: it need not."""
    maintenance: str = ""
    """Why everything but a stop is refused: who switched it on, and his reason; empty: it is not."""
    ramps: Mapping[str, float] = {}
    """Setpoints that are on their way, and where to."""


class LeaseAct(StrEnum):
    """What a client may do about the lease of a drive."""

    ACQUIRE = "acquire"
    RENEW = "renew"
    RELEASE = "release"
    TAKE = "take"
    """From whoever holds it; the site says which role may."""
