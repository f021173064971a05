"""Is a command meant now? It must prove it, because brokers and clients keep and repeat messages.

The proof is the gateway's present epoch (works whatever the clocks show), or an end that lies close
ahead: ``exp`` in the payload or MQTT 5's message expiry (work for someone with ``mosquitto_pub`` and a
clock). Whatever is given is checked. STOP needs no proof; the caller does not ask here.
"""

from __future__ import annotations

from gateway.bridge.api import DEFAULT_TTL, TOO_LATE
from gateway.northbound.mqtt.message import Incoming
from gateway.northbound.mqtt.request import MalformedError, RejectedError, Request, refused
from gateway.tag import Cause, Outcome, Verdict

HORIZON = 60.0
"""Seconds: an end further ahead than this proves nothing."""


def time_to_live(incoming: Incoming, request: Request) -> float:
    """Seconds from its arrival that the command may wait for the wire.

    Raises:
        RejectedError: if the command is not fresh.
    """
    if request.epoch is not None and request.epoch != incoming.epoch:
        reason = "made for another connection of the gateway (its status topic has the present epoch)"
        raise RejectedError(refused(Cause.WRONG_EPOCH, reason), request.id)
    left = _time_left(incoming, request)
    if left is not None and left <= 0:
        late = Outcome(verdict=Verdict.EXPIRED, cause=Cause.EXPIRED, reason=TOO_LATE)
        raise RejectedError(late, request.id)
    if request.epoch is None:
        _check_near(left, request.id)
    return DEFAULT_TTL if left is None else min(left, DEFAULT_TTL)


def _check_near(left: float | None, id: str | int | None) -> None:
    """Without an epoch, the end alone is the proof."""
    if left is None:
        raise MalformedError("neither epoch nor exp: nothing shows that the command is meant now", id)
    if left > HORIZON:
        raise MalformedError(f"exp is more than {HORIZON:g} s ahead, which needs an epoch beside it", id)


def _time_left(incoming: Incoming, request: Request) -> float | None:
    """Seconds to the nearer end of those given, None without any."""
    ends = []
    if (expires := request.expires) is not None:
        ends.append((expires - incoming.arrived.wall) / 1e9)
    if incoming.expiry is not None:
        ends.append(float(incoming.expiry))
    return min(ends, default=None)
