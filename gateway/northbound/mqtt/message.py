"""Messages on their way out and in."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from gateway.tag import Instant


class Lane(IntEnum):
    """What goes first when there is no room for everything."""

    ANSWER = 0
    """Answers to commands, and events: each one counts."""
    STATE = 1
    """Retained topics: only the latest of each topic counts."""
    DATA = 2
    """Values as they are read: while the broker is away, only the latest of each topic is kept."""


@dataclass(frozen=True, slots=True)
class Message:
    """A message for the broker, always sent with QoS 1. ``correlation`` is MQTT 5's Correlation Data."""

    topic: str
    payload: bytes
    lane: Lane
    correlation: bytes | None = None

    @property
    def retain(self) -> bool:
        """True when the broker is to keep it for those who subscribe later."""
        return self.lane is Lane.STATE


@dataclass(frozen=True, slots=True, kw_only=True)
class Incoming:
    """A message from the broker.

    ``epoch`` is that of the connection it came through. ``expiry`` is what is left of MQTT 5's Message
    Expiry Interval, in seconds.
    """

    topic: str
    payload: bytes
    retain: bool
    epoch: str
    arrived: Instant
    expiry: int | None = None
    response_topic: str | None = None
    correlation: bytes | None = None
