"""A secure channel and the requests on it.

Where asyncua serves the requests of a connection one after another, reads, writes and calls overlap here,
so that a write that waits for its drive holds nothing up. Each request must carry the token of the
channel's session, and a session moves to another channel only after everything about it was checked.
"""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, cast

import structlog
from asyncua import ua
from asyncua.common.utils import Buffer, ServiceError
from asyncua.crypto.uacrypto import InvalidSignature
from asyncua.server.uaprocessor import UaProcessor
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary, uatcp_to_binary

from gateway.northbound.opcua import plain
from gateway.northbound.opcua.plain import node_id
from gateway.northbound.opcua.request import Request, current, patience
from gateway.northbound.opcua.session import Session

if TYPE_CHECKING:
    from gateway.northbound.opcua.engine import Engine

_log = structlog.get_logger(__name__)

_CREATE = node_id(ua.ObjectIds.CreateSessionRequest_Encoding_DefaultBinary)
_ACTIVATE = node_id(ua.ObjectIds.ActivateSessionRequest_Encoding_DefaultBinary)
_SESSIONLESS = {
    _CREATE,
    _ACTIVATE,
    node_id(ua.ObjectIds.FindServersRequest_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.GetEndpointsRequest_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.RegisterServerRequest_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.RegisterServer2Request_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.CloseSecureChannelRequest_Encoding_DefaultBinary),
}

_UNSERVED = {
    node_id(ua.ObjectIds.BrowseNextRequest_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.QueryFirstRequest_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.QueryNextRequest_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.HistoryReadRequest_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.HistoryUpdateRequest_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.SetTriggeringRequest_Encoding_DefaultBinary),
    node_id(ua.ObjectIds.CancelRequest_Encoding_DefaultBinary),
}
"""asyncua would blame the user's rights, or say of a history that it does not keep that it is empty."""

_OVERLAPPING = {
    node_id(ua.ObjectIds.ReadRequest_Encoding_DefaultBinary): 64,
    node_id(ua.ObjectIds.WriteRequest_Encoding_DefaultBinary): 64,
    node_id(ua.ObjectIds.CallRequest_Encoding_DefaultBinary): 256,
}
"""Services that wait for the core, and how many of each may be under way on one channel. Calls have more
room, and of their own, so that a stop is not turned away because of anything else."""


class Channel(UaProcessor):
    """One secure channel; asyncua's ``session`` is the session it carries."""

    iserver: Engine
    session: Session | None

    def __init__(self, engine: Engine, transport: Any, limits: Any) -> None:
        super().__init__(engine, transport, limits)
        self._under_way: Counter[ua.NodeId] = Counter()

    @property
    def peer(self) -> str:
        return str(self.name[0]) if self.name else ""

    @property
    def client_certificate(self) -> bytes | None:
        return self._connection.security_policy.peer_certificate or None

    @property
    def policy_uri(self) -> str:
        return self._connection.security_policy.URI

    @property
    def mode(self) -> ua.MessageSecurityMode:
        return self._connection.security_policy.Mode

    def detach(self) -> None:
        self.session = None
        self._publish_requests.clear()

    async def process(self, header: Any, body: Buffer) -> bool:
        """Deal with one chunk; False closes the connection, as it does for anything malformed."""
        try:
            if header.MessageType == ua.MessageType.SecureMessage and not self._connection.is_open():
                raise ServiceError(ua.StatusCodes.BadTcpMessageTypeInvalid)
            return bool(await super().process(header, body))
        except Exception as error:
            self._say_goodbye(error)
            return False

    def open_secure_channel(self, algohdr: Any, seqhdr: Any, body: Buffer) -> None:
        if self.mode is not ua.MessageSecurityMode.None_:
            self.iserver.trust.check(self.client_certificate or b"", datetime.now(UTC))
        super().open_secure_channel(algohdr, seqhdr, body)

    async def process_message(self, seqhdr: Any, body: Buffer) -> bool:
        kind = nodeid_from_binary(body.copy())
        limit = _OVERLAPPING.get(kind)
        if limit is None:
            return bool(await super().process_message(seqhdr, body))
        if self._under_way[kind] >= limit:
            return self._refuse(seqhdr, body)
        self._under_way[kind] += 1
        task = self.iserver.spawn(super().process_message(seqhdr, body))
        task.add_done_callback(lambda _: self._under_way.subtract((kind,)))
        return True

    def send_response(self, requesthandle: Any, seqhdr: Any, response: Any, msgtype: Any = None) -> None:
        if self._transport.is_closing():
            return
        kind = ua.MessageType.SecureMessage if msgtype is None else msgtype
        super().send_response(requesthandle, seqhdr, response, kind)

    async def close(self) -> None:
        if self.session is not None:
            self.iserver.keeper.cut_off(self.session)
        # Else a lost connection's waiting requests would swallow what a new one should get.
        self._publish_requests.clear()
        await super().close()

    async def _process_message(self, typeid: Any, requesthdr: Any, seqhdr: Any, body: Buffer) -> bool:
        current.set(Request(self, patience(int(requesthdr.TimeoutHint))))
        if typeid == _ACTIVATE:
            return await self._activate(requesthdr, seqhdr, body)
        if typeid == _CREATE and self._is_live(self.session):
            raise ServiceError(ua.StatusCodes.BadTooManySessions)
        if typeid not in _SESSIONLESS and not self._is_ours(requesthdr.AuthenticationToken):
            raise ServiceError(ua.StatusCodes.BadSessionIdInvalid)
        if typeid in _UNSERVED:
            raise ServiceError(ua.StatusCodes.BadServiceUnsupported)
        return bool(await super()._process_message(typeid, requesthdr, seqhdr, body))

    def _refuse(self, seqhdr: Any, body: Buffer) -> bool:
        nodeid_from_binary(body)
        header = struct_from_binary(ua.RequestHeader, body)
        response = ua.ServiceFault()
        response.ResponseHeader.ServiceResult = plain.status(ua.StatusCodes.BadTooManyOperations)
        self.send_response(header.RequestHandle, seqhdr, response)
        return True

    def _is_ours(self, token: ua.NodeId) -> bool:
        return self.session is not None and self.session.auth_token == token

    @staticmethod
    def _is_live(session: Session | None) -> bool:
        return session is not None and session.state.name != "Closed"

    async def _activate(self, requesthdr: Any, seqhdr: Any, body: Buffer) -> bool:
        params = struct_from_binary(ua.ActivateSessionParameters, body)
        session = self._session_for(requesthdr.AuthenticationToken)
        self._check_signature(session, params)
        await session.log_in(params, self)
        # asyncua's own check of the user is switched off in `engine`; `log_in` has done it.
        result = session.activate_session(params, self.client_certificate)
        self._carry(session)
        response = ua.ActivateSessionResponse()
        response.Parameters = result
        self.send_response(requesthdr.RequestHandle, seqhdr, response)
        return True

    def _session_for(self, token: ua.NodeId) -> Session:
        """The session to activate: ours, or one that another channel carried under the same certificate."""
        if self._is_ours(token) and self.session is not None:
            return self.session
        session = self.iserver.lookup_external_session(token)
        if not isinstance(session, Session) or self._is_live(self.session) or not session.is_activated():
            raise ServiceError(ua.StatusCodes.BadSessionIdInvalid)
        if session.client_certificate != self.client_certificate:
            raise ServiceError(ua.StatusCodes.BadSecurityChecksFailed)
        return session

    def _check_signature(self, session: Session, params: ua.ActivateSessionParameters) -> None:
        policy: Any = self._connection.security_policy
        signed = (policy.host_certificate or b"") + (session.nonce or b"")
        try:
            policy.asymmetric_cryptography.verify(signed, params.ClientSignature.Signature)
        except InvalidSignature as error:
            raise ServiceError(ua.StatusCodes.BadApplicationSignatureInvalid) from error

    def _carry(self, session: Session) -> None:
        """From now on this channel carries the session and its notifications."""
        if session.channel is not self:
            session.channel.detach()
        session.channel, self.session, self._closing = self, session, False
        session.connected = True
        for subscription in session.subscription_service.subscriptions.values():
            subscription.pub_result_callback = self.forward_publish_response
            subscription.pub_request_callback = cast("Any", self.get_publish_request)

    def _should_close_session_on_transport_loss(self) -> bool:
        if self.session is None:
            return False
        return not self.session.is_activated() or not self.session.subscription_service.subscriptions

    def _say_goodbye(self, error: Exception) -> None:
        code = getattr(error, "code", None) or ua.StatusCodes.BadTcpInternalError
        _log.warning("connection refused", address=self.peer, reason=str(plain.status(code).name or error))
        message = ua.ErrorMessage(plain.status(code), cast("Any", ""))
        self._transport.write(uatcp_to_binary(cast("Any", ua.MessageType.Error), message))
