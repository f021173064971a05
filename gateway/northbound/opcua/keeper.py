"""Keeps the leases of living sessions, and tells the core when a session is not living any more.

A session holds its leases for as long as its client is there: while its connection stands and it is not
closed or timed out. The core is told of each renewal, so that a lease ends by itself if this process hangs.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import structlog

from gateway.bridge.api import Bridge, BridgeError, ControlState, LeaseAct
from gateway.tag import Origin, Verdict

if TYPE_CHECKING:
    from gateway.northbound.opcua.session import Session

_log = structlog.get_logger(__name__)

SHARE = 0.25
"""A lease is renewed after this share of its ttl."""
SHORTEST = 0.1
"""Seconds between two rounds."""


class Keeper:
    """The leases of all sessions of this server."""

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        self._held: dict[str, str] = {}
        """By drive, the label of the session that holds its lease."""
        self._telling: set[asyncio.Task[None]] = set()
        self._resting = False
        controls = [drive.control for drive in bridge.catalogue.drives if drive.control.lease != "off"]
        self._pause = max(SHORTEST, SHARE * min((c.ttl for c in controls), default=60.0))

    def learn(self, state: ControlState) -> None:
        """The core tells who holds a lease."""
        holder = state.holder
        if holder is not None and holder.through == "opcua" and state.phase in ("held", "awaited"):
            self._held[state.drive] = holder.session
        else:
            self._held.pop(state.drive, None)

    async def run(self, living: Callable[[], Mapping[str, Session]]) -> None:
        """Renew, again and again, until cancelled.

        Raises:
            BridgeError: when the core is gone.
        """
        while True:
            await asyncio.sleep(self._pause)
            sessions = living()
            for drive, label in list(self._held.items()):
                if (session := sessions.get(label)) is not None:
                    await self._renew(drive, session.origin())

    async def _renew(self, drive: str, origin: Origin) -> None:
        outcome = await self._bridge.lease(drive, LeaseAct.RENEW, origin)
        if outcome.verdict is not Verdict.CONFIRMED:
            _log.warning("lease not renewed", drive=drive, user=origin.who, reason=outcome.reason)

    def ended(self, session: Session) -> None:
        """A session was closed, or timed out."""
        self._tell(session, may_return=False)

    def cut_off(self, session: Session) -> None:
        """The connection of a session is gone; its client may be back."""
        session.connected = False
        self._tell(session, may_return=True)

    def rest(self) -> None:
        """From now on sessions end because the server does."""
        self._resting = True

    def _tell(self, session: Session, *, may_return: bool) -> None:
        if self._resting or session.user.anonymous:
            return
        task = asyncio.get_running_loop().create_task(self._gone(session.origin(), may_return))
        self._telling.add(task)
        task.add_done_callback(self._telling.discard)

    async def _gone(self, origin: Origin, may_return: bool) -> None:
        try:
            await self._bridge.gone(origin, may_return)
        except BridgeError as error:
            _log.debug("the core did not hear that a session ended", reason=str(error))
