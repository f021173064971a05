"""One adapter per process for all tests that leave it as they found it; others start their own."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator

import pytest
import pytest_asyncio
from asyncua.server.address_space import AddressSpace
from asyncua.server.internal_server import InternalServer

from gateway.northbound.opcua.certificates import Own
from tests.opcua import standard
from tests.opcua.support import CLIENT_URI, Running, running


@pytest.fixture(autouse=True, scope="session")
def standard_nodes() -> Iterator[None]:
    """OPC UA's own nodes are built once."""
    with pytest.MonkeyPatch.context() as patch:
        standard.reuse(patch)
        yield


@pytest.fixture
async def standard_space() -> AddressSpace:
    """An address space with nothing but OPC UA's own nodes."""
    engine = InternalServer()
    await engine.load_standard_address_space()
    return engine.aspace


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def shared(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Running]:
    async with running(tmp_path_factory.mktemp("opcua")) as gateway:
        yield gateway


@pytest.fixture(scope="session")
def own(tmp_path_factory: pytest.TempPathFactory) -> Own:
    """A client's certificate and key."""
    return Own(tmp_path_factory.mktemp("client"), CLIENT_URI, "localhost")


@pytest.fixture
def gateway(shared: Running) -> Running:
    """The adapter that tests share, with a bridge that remembers nothing of earlier tests."""
    shared.bridge.reset()
    return shared
