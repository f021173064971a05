"""The OPC UA adapter: a bridge below, OPC UA clients above."""

from __future__ import annotations

import asyncio
import contextlib
import gc
from collections.abc import AsyncIterator
from datetime import UTC, datetime

import structlog
from asyncua import ua

from gateway.bridge.api import (
    Batch,
    Bridge,
    BridgeError,
    Catalogue,
    ControlState,
    DriveState,
    Periods,
    Replaced,
    Update,
)
from gateway.northbound.opcua.asking import Asker
from gateway.northbound.opcua.certificates import Own, Trust
from gateway.northbound.opcua.demands import Demands
from gateway.northbound.opcua.engine import Engine, OpcUaServer
from gateway.northbound.opcua.health import service_level
from gateway.northbound.opcua.keeper import Keeper
from gateway.northbound.opcua.live import Live
from gateway.northbound.opcua.login import Gate
from gateway.northbound.opcua.names import TYPES_URI, application_uri, instance_uri
from gateway.northbound.opcua.plain import data_value, node_id
from gateway.northbound.opcua.reading import Reader
from gateway.northbound.opcua.settings import Settings, read_settings
from gateway.northbound.opcua.space import build_space
from gateway.northbound.opcua.subscriptions import Sources
from gateway.users import UsersFile

_log = structlog.get_logger(__name__)

_SERVICE_LEVEL = node_id(ua.ObjectIds.Server_ServiceLevel)
_ENABLED_FLAG = node_id(ua.ObjectIds.Server_ServerDiagnostics_EnabledFlag)
_REDUNDANCY = node_id(ua.ObjectIds.Server_ServerRedundancy_RedundancySupport)


class Adapter:
    """A running OPC UA server on a bridge."""

    def __init__(self, bridge: Bridge, engine: Engine, server: OpcUaServer, live: Live) -> None:
        self._bridge = bridge
        self._engine = engine
        self._server = server
        self._live = live
        self._down: set[str] = set()

    @property
    def url(self) -> str:
        """Where clients connect, with the port that was really bound."""
        listener = self._server.bserver
        port = listener.port if listener is not None else self._server.endpoint.port
        return f"opc.tcp://{self._server.endpoint.hostname}:{port}"

    async def follow(self) -> None:
        """Show what the core tells, until it tells no more.

        Raises:
            BridgeError: when the core is gone, or has a new configuration: this address space is over.
        """
        async for update in self._bridge.updates():
            await self._show(update)
        raise BridgeError("the core went away")

    async def keep_demands(self) -> None:
        """Tell the core what monitored items want, until cancelled.

        Raises:
            BridgeError: when the core is gone.
        """
        await self._engine.demands.run()

    async def keep_leases(self) -> None:
        """Renew the leases of living sessions, until cancelled."""
        await self._engine.keeper.run(self._engine.living)

    async def _show(self, update: Update) -> None:
        match update:
            case Batch():
                await self._publish(update)
            case Periods():
                self._engine.demands.replan(update.periods)
            case DriveState():
                await self._rate(update)
            case ControlState():
                self._engine.keeper.learn(update)
            case Replaced():
                raise BridgeError(f"the configuration was replaced by generation {update.generation}")

    async def _publish(self, batch: Batch) -> None:
        for sample in batch.samples:
            if self._engine.demands.watched(sample.tag):  # others were withdrawn while this was on its way
                await self._live.publish(sample)

    async def _rate(self, state: DriveState) -> None:
        (self._down.discard if state.up else self._down.add)(state.drive)
        level = service_level(len(self._bridge.catalogue.drives), len(self._down))
        await _write(self._engine, _SERVICE_LEVEL, level, ua.VariantType.Byte)


async def serve(bridge: Bridge, stop: asyncio.Event) -> None:
    """Serve OPC UA clients until ``stop`` is set.

    Raises:
        SettingsError: if the section cannot be used.
        OSError: if the endpoint cannot be listened on.
        BridgeError: if the core goes away or has a new configuration; start the process anew.
    """
    async with listening(bridge) as adapter:
        _log.info("listening", url=adapter.url)
        parts = (adapter.follow(), adapter.keep_demands(), adapter.keep_leases(), _until(stop))
        work = [asyncio.create_task(part) for part in parts]
        try:
            done, _ = await asyncio.wait(work, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            for task in work:
                task.cancel()
            await asyncio.gather(*work, return_exceptions=True)


async def _until(stop: asyncio.Event) -> None:
    await stop.wait()


@contextlib.asynccontextmanager
async def listening(bridge: Bridge) -> AsyncIterator[Adapter]:
    """A server that accepts connections; `serve` keeps it supplied.

    Raises:
        SettingsError, OSError: as `serve`.
    """
    settings = read_settings(bridge.section)
    engine = Engine()
    server = OpcUaServer(engine, settings.security, anonymous=settings.anonymous)
    live = await _prepare(engine, server, settings, bridge)
    await server.start()
    try:
        yield Adapter(bridge, engine, server, live)
    finally:
        await server.stop()


async def _prepare(engine: Engine, server: OpcUaServer, settings: Settings, bridge: Bridge) -> Live:
    """Build the address space and put the parts into the engine."""
    catalogue = bridge.catalogue
    await _introduce(server, settings, catalogue)
    await _certify(engine, server, settings, catalogue)
    model = build_space(engine.aspace, catalogue)
    live = Live(engine.aspace, model)
    engine.demands = Demands(bridge, live)
    engine.sources = Sources(engine.aspace, model, engine.demands, dict(catalogue.rates))
    engine.reader = Reader(engine.aspace, model, bridge, engine.demands, live)
    engine.asker = Asker(bridge, model)
    engine.keeper = Keeper(bridge)
    users = UsersFile(settings.users_file) if settings.users_file is not None else None
    engine.gate = Gate(users, anonymous=settings.anonymous)
    # Tens of thousands of nodes live as long as the process; the collector need not visit them again.
    gc.collect()
    gc.freeze()
    return live


async def _introduce(server: OpcUaServer, settings: Settings, catalogue: Catalogue) -> None:
    """Names, namespaces and what the Server object tells."""
    await server.init()
    server.set_endpoint(settings.url)
    server.set_server_name(f"{catalogue.site} {catalogue.gateway}")
    await server.set_application_uri(application_uri(catalogue.site, catalogue.gateway))
    for uri in (instance_uri(catalogue.site), TYPES_URI):
        await server.register_namespace(uri)
    await server.set_build_info(
        "urn:gateway", "gateway", "drive gateway", catalogue.version, "", datetime.now(UTC)
    )
    await _write(server.iserver, _ENABLED_FLAG, False, ua.VariantType.Boolean)
    await _write(server.iserver, _REDUNDANCY, ua.RedundancySupport.None_, ua.VariantType.Int32)


async def _certify(engine: Engine, server: OpcUaServer, settings: Settings, catalogue: Catalogue) -> None:
    uri = application_uri(catalogue.site, catalogue.gateway)
    own = await asyncio.to_thread(Own, settings.certificates, uri, settings.host)
    await server.load_certificate(own.certificate)
    await server.load_private_key(own.key)
    engine.trust = Trust(settings.certificates)


async def _write(engine: Engine, node: ua.NodeId, value: object, kind: ua.VariantType) -> None:
    now = datetime.now(UTC)
    await engine.write_attribute_value(
        node, data_value(ua.Variant(value, kind), ua.StatusCodes.Good, now, now)
    )
