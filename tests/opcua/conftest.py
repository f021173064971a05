"""One adapter per test module: building the standard address space takes over a second."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest
import pytest_asyncio

from gateway.northbound.opcua.certificates import Own
from tests.opcua.support import CLIENT_URI, Running, running


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def shared(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Running]:
    async with running(tmp_path_factory.mktemp("opcua")) as gateway:
        yield gateway


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Own:
    """A client's certificate and key."""
    return Own(tmp_path_factory.mktemp("client"), CLIENT_URI, "localhost")


@pytest.fixture
def gateway(shared: Running) -> Running:
    """The module's adapter, with a bridge that remembers nothing of earlier tests."""
    shared.bridge.reset()
    return shared
