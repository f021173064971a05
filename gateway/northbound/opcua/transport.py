"""TCP: bounds that hold before a message is complete, and our channels instead of asyncua's."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import structlog
from asyncua import ua
from asyncua.common.connection import TransportLimits
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol

from gateway.northbound.opcua.channel import Channel

if TYPE_CHECKING:
    from gateway.northbound.opcua.engine import Engine

_log = structlog.get_logger(__name__)

CHUNK = 65_535
LEAST_CHUNK = 8_192
"""OPC 10000-6 section 7.1.2.3: no buffer is smaller."""
MOST_CHUNKS = 64
_SIZE_END = 8
"""The size of a chunk is in bytes 4 to 8 of its header."""


class Limits(TransportLimits):
    """Sizes that a connection may use."""

    def __init__(self) -> None:
        super().__init__(CHUNK, CHUNK, MOST_CHUNKS, MOST_CHUNKS * CHUNK)

    def create_acknowledge_and_set_limits(self, msg: ua.Hello) -> ua.Acknowledge:
        if min(msg.ReceiveBufferSize, msg.SendBufferSize) < LEAST_CHUNK:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadTcpNotEnoughResources)
        return super().create_acknowledge_and_set_limits(msg)


class Connection(OPCUAProtocol):
    """One TCP connection."""

    iserver: Engine

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if self.processor is not None:
            self.processor = Channel(self.iserver, transport, self.limits)
            self.processor.set_policies(self.policies)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        # What is left is an unfinished chunk; asyncua would buffer whatever size it announces.
        announced = int.from_bytes(self._buffer[4:_SIZE_END], "little")
        if len(self._buffer) >= _SIZE_END and announced > CHUNK and self.transport is not None:
            _log.warning("chunk too large", address=self.peer_name, announced=announced)
            self._buffer = b""
            self.transport.abort()

    def connection_lost(self, ex: BaseException | None) -> None:
        if self.transport is not None:  # asyncua forgets that it may have refused the connection
            super().connection_lost(ex)


class Listener(BinaryServer):
    """Accepts connections."""

    def _make_protocol(self) -> OPCUAProtocol:
        return Connection(self.iserver, self._policies, self.clients, self.closing_tasks, self.limits)

    def bound(self) -> tuple[Any, int]:
        """The address that is really listened on."""
        return self.hostname, self.port
