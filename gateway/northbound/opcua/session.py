"""A client's session. Reads and writes go to the core, subscriptions are its own, its token is unguessable.

asyncua numbers its tokens upwards, so that anyone could take a session over.
"""

from __future__ import annotations

import asyncio
import secrets
from typing import TYPE_CHECKING, Any, cast

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.server.internal_session import InternalSession

from gateway.northbound.opcua import plain
from gateway.northbound.opcua.certificates import check_uri
from gateway.northbound.opcua.login import Client
from gateway.northbound.opcua.request import ChannelView, current
from gateway.northbound.opcua.subscriptions import Subscriptions
from gateway.tag import Origin

if TYPE_CHECKING:
    from gateway.northbound.opcua.engine import Engine

TOKEN_BYTES = 32
MOST_OPERATIONS = 10_000
"""Items in one request; `engine` tells clients so."""


class Session(InternalSession):
    """One client's session."""

    iserver: Engine
    subscription_service: Subscriptions
    user: Client

    def __init__(self, engine: Engine, name: str, channel: ChannelView) -> None:
        service = Subscriptions(engine.sources, engine)
        super().__init__(engine, engine.aspace, service, name, user=Client(), external=False)
        self.auth_token = plain.node_id(secrets.token_bytes(TOKEN_BYTES), 1)
        self.label = secrets.token_hex(8)
        """Names the session to the core (leases, journal); tells nothing of the token."""
        self.channel = channel
        self.connected = True
        """Its channel is there."""
        self.client_certificate = channel.client_certificate
        self.external = True
        engine.register_external_session(self)

    async def create_session(
        self, params: ua.CreateSessionParameters, sockname: tuple[str, int] | None = None
    ) -> ua.CreateSessionResult:
        try:
            self._check_channel(params)
            return await super().create_session(params, sockname)
        except BaseException:
            await self.close_session()
            raise

    def _check_channel(self, params: ua.CreateSessionParameters) -> None:
        # asyncua opens a channel without security even where none is offered, and checks no certificate
        # when CreateSession names none.
        if not self.iserver.offers(self.channel.policy_uri, self.channel.mode):
            raise ServiceError(ua.StatusCodes.BadSecurityPolicyRejected)
        if self.client_certificate is None or self.channel.mode is ua.MessageSecurityMode.None_:
            return
        if params.ClientCertificate != self.client_certificate:
            raise ServiceError(ua.StatusCodes.BadCertificateInvalid)
        check_uri(self.client_certificate, cast("str", params.ClientDescription.ApplicationUri))

    async def log_in(self, params: ua.ActivateSessionParameters, channel: ChannelView) -> None:
        """Find out who asks for activation; a session that moves to another channel keeps its user.

        Raises:
            ServiceError: if the client is not let in. Nothing has changed then.
        """
        nonce = self.nonce or b""
        gate, key = self.iserver.gate, self.iserver.private_key
        client = await gate.admit(params.UserIdentityToken, nonce, channel, key)
        if self.is_activated() and channel is not self.channel and client.name != self.user.name:
            raise ServiceError(ua.StatusCodes.BadUserAccessDenied)
        self.user = client

    async def close_session(self, delete_subs: bool = True) -> None:
        """Close, with all subscriptions: nobody could take them over. Its leases end with it."""
        self.iserver.keeper.ended(self)
        await super().close_session(True)

    async def read(self, params: ua.ReadParameters) -> list[ua.DataValue]:
        _check_count(params.NodesToRead)
        return await self.iserver.reader.read(params, self.user, current.get().patience)

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        _check_count(params.NodesToWrite)
        patience = current.get().patience
        origin = self.origin(len(params.NodesToWrite))
        return await asyncio.gather(*(self._write(item, origin, patience) for item in params.NodesToWrite))

    async def _write(self, item: ua.WriteValue, origin: Origin, patience: float | None) -> ua.StatusCode:
        asker = self.iserver.asker
        write = asker.write if item.NodeId in self.aspace else asker.write_missing
        status: ua.StatusCode = await write(item, origin, patience)
        return status

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        _check_count(params)
        patience = current.get().patience
        asker, origin = self.iserver.asker, self.origin(len(params))
        return await asyncio.gather(*(asker.call(item, origin, patience) for item in params))

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        _check_count(params.ItemsToCreate)
        results = await super().create_monitored_items(params)
        await self.iserver.demands.settle()
        for result in results:
            self._revise(params.SubscriptionId, result.MonitoredItemId, result)
        return results

    async def modify_monitored_items(
        self, params: ua.ModifyMonitoredItemsParameters
    ) -> list[ua.MonitoredItemModifyResult]:
        _check_count(params.ItemsToModify)
        results = await super().modify_monitored_items(params)
        await self.iserver.demands.settle()
        for item, result in zip(params.ItemsToModify, results, strict=True):
            self._revise(params.SubscriptionId, item.MonitoredItemId, result)
        return results

    def _revise(self, subscription: Any, item: Any, result: Any) -> None:
        """Tell the sampling interval that the plan can hold."""
        if not result.StatusCode.is_good():
            return
        interval = self.subscription_service.revised(int(subscription), int(item))
        if interval is not None:
            result.RevisedSamplingInterval = interval

    def origin(self, together: int = 1) -> Origin:
        """Who this is, for the core; ``together``: how many writes or calls came in the same request."""
        return Origin(
            through="opcua",
            who=self.user.name or "anonymous",
            role=self.user.rights,
            session=self.label,
            address=self.channel.peer,
            authenticated=not self.user.anonymous,
            together=together,
        )


def _check_count(items: list[Any] | None) -> None:
    if not items:
        raise ServiceError(ua.StatusCodes.BadNothingToDo)
    if len(items) > MOST_OPERATIONS:
        raise ServiceError(ua.StatusCodes.BadTooManyOperations)
