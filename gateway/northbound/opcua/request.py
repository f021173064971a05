"""The request that is being served: on which channel it came, and how long its sender will wait."""

from __future__ import annotations

from contextvars import ContextVar
from typing import NamedTuple, Protocol

from asyncua import ua

_SHARE = 0.9
"""Part of the client's patience after which it gets an answer, so that the answer still reaches it."""


class ChannelView(Protocol):
    """What sessions know of the secure channel that carries them."""

    @property
    def peer(self) -> str:
        """IP address of the client."""
        ...

    @property
    def client_certificate(self) -> bytes | None:
        """The DER certificate that the channel was opened with; None without security."""
        ...

    @property
    def policy_uri(self) -> str:
        """The security policy."""
        ...

    @property
    def mode(self) -> ua.MessageSecurityMode:
        """None, sign, or sign and encrypt."""
        ...

    def detach(self) -> None:
        """Another channel carries the session from now on."""
        ...


class Request(NamedTuple):
    """A request. ``patience`` is the seconds within which it must be answered; None: no bound."""

    channel: ChannelView
    patience: float | None


current: ContextVar[Request] = ContextVar("request")


def patience(timeout_hint: int) -> float | None:
    """Seconds that a request may take, from its TimeoutHint in milliseconds (0: not told)."""
    return timeout_hint / 1000 * _SHARE if timeout_hint > 0 else None
