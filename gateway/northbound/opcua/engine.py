"""asyncua's server with our sessions, channels and bounds in it."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Coroutine
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.crypto import security_policies
from asyncua.crypto.permission_rules import User
from asyncua.server import Server
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession

from gateway.northbound.opcua.asking import Asker
from gateway.northbound.opcua.certificates import Trust
from gateway.northbound.opcua.demands import Demands
from gateway.northbound.opcua.keeper import Keeper
from gateway.northbound.opcua.login import Gate
from gateway.northbound.opcua.reading import Reader
from gateway.northbound.opcua.request import current
from gateway.northbound.opcua.session import Session
from gateway.northbound.opcua.settings import Security
from gateway.northbound.opcua.subscriptions import Sources
from gateway.northbound.opcua.transport import Limits, Listener

MOST_CONNECTIONS = 200
MOST_SESSIONS = 100
HALF_OPEN_SECONDS = 15.0
"""A connection that has not logged in by then is closed."""
SESSION_MILLISECONDS = (1_000.0, 60_000.0)
"""Shortest and longest session timeout: so long the demands of a vanished client live on."""
LONGEST_QUEUE = 1_000
"""Values in the queue of one monitored item."""

_POLICIES: dict[Security, list[ua.SecurityPolicyType]] = {
    Security.NONE: [ua.SecurityPolicyType.NoSecurity],
    Security.SIGN: [
        ua.SecurityPolicyType.Basic256Sha256_Sign,
        ua.SecurityPolicyType.Aes128Sha256RsaOaep_Sign,
        ua.SecurityPolicyType.Aes256Sha256RsaPss_Sign,
    ],
    Security.SIGN_AND_ENCRYPT: [
        ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
        ua.SecurityPolicyType.Aes128Sha256RsaOaep_SignAndEncrypt,
        ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
    ],
}


class Engine(InternalServer):
    """What all sessions share. The parts are put in by `server` before anybody can connect."""

    gate: Gate
    trust: Trust
    sources: Sources
    demands: Demands
    reader: Reader
    asker: Asker
    keeper: Keeper

    def __init__(self) -> None:
        super().__init__()
        # `Session.log_in` finds out who the client is; asyncua's manager lets any "admin" in.
        self.user_manager: Any = None
        self.allow_remote_admin = False
        self.min_session_timeout_ms, self.max_session_timeout_ms = SESSION_MILLISECONDS
        self.max_connections = MOST_CONNECTIONS
        self.max_pending_activation_seconds = HALF_OPEN_SECONDS
        self.max_monitored_item_queue_size = LONGEST_QUEUE
        self._tasks: set[asyncio.Task[Any]] = set()

    def create_session(self, name: str, user: User | None = None, external: bool = False) -> InternalSession:
        if len(self._external_sessions) >= MOST_SESSIONS:
            raise ServiceError(ua.StatusCodes.BadTooManySessions)
        return Session(self, name, current.get().channel)

    def living(self) -> dict[str, Session]:
        """Sessions whose client is there, by label."""
        sessions = (s for s in self._external_sessions.values() if isinstance(s, Session))
        return {s.label: s for s in sessions if s.connected and s.is_activated()}

    def offers(self, policy_uri: str, mode: ua.MessageSecurityMode) -> bool:
        """True when some endpoint of ours has this security."""
        return any(end.SecurityPolicyUri == policy_uri and end.SecurityMode == mode for end in self.endpoints)

    def register_server(self, server: Any, conf: Any = None) -> None:
        """We are no discovery server."""
        raise ServiceError(ua.StatusCodes.BadServiceUnsupported)

    def spawn(self, work: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
        """Serve a request beside others; whatever is under way at the end is cancelled."""
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def stop(self) -> None:
        """Close all sessions and stop. asyncua would wait for its clock's next second."""
        for task in self._tasks:
            task.cancel()
        for session in list(self._external_sessions.values()):
            await session.close_session()
        if self.time_task is not None:
            self.time_task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self.time_task
            self.time_task = None
        await super().stop()


class OpcUaServer(Server):
    """The server: endpoints and a listener around the engine."""

    iserver: Engine

    def __init__(self, engine: Engine, security: tuple[Security, ...], *, anonymous: bool) -> None:
        super().__init__(iserver=engine)
        self.application_type = ua.ApplicationType.Server
        self.limits = Limits()
        self.set_security_policy([policy for name in security for policy in _POLICIES[name]])
        tokens = [ua.UserNameIdentityToken, ua.AnonymousIdentityToken]
        self.set_identity_tokens(tokens if anonymous else tokens[:1])

    async def start(self) -> None:
        await self._setup_server_nodes()
        self._protect_passwords()
        await self.iserver.start()
        try:
            host, port = self._get_bind_socket_info()
            self.bserver = Listener(self.iserver, host or "", port or 0, self.limits)
            self.bserver.set_policies(self._policies)
            await self.bserver.start()
        except BaseException:
            await self.iserver.stop()
            raise

    async def stop(self) -> None:
        # That we stop ends no lease: clients may return when we are back.
        self.iserver.keeper.rest()
        await super().stop()

    def _protect_passwords(self) -> None:
        """Passwords are encrypted even on a channel that is not; asyncua would let them go in the clear
        where no encrypting endpoint is offered."""
        for endpoint in self.iserver.endpoints:
            for policy in endpoint.UserIdentityTokens:
                if (
                    policy.TokenType == ua.UserTokenType.UserName
                    and endpoint.SecurityMode == ua.MessageSecurityMode.None_
                ):
                    policy.SecurityPolicyUri = security_policies.SecurityPolicyBasic256Sha256.URI
