"""One adapter per test module: building the standard address space takes over a second."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest
import pytest_asyncio

from tests.opcua.support import Running, running


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def shared(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Running]:
    async with running(tmp_path_factory.mktemp("opcua")) as gateway:
        yield gateway


@pytest.fixture
def gateway(shared: Running) -> Running:
    """The module's adapter, with a bridge that remembers nothing of earlier tests."""
    shared.bridge.reset()
    return shared
