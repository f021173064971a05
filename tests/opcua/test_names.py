"""A site may call nodes and what clients browse otherwise; everything else finds them all the same."""

from __future__ import annotations

from collections.abc import AsyncIterator

import msgspec
import pytest
import pytest_asyncio
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from gateway.northbound.opcua.settings import SettingsError
from gateway.northbound.opcua.space import build_space
from tests.northbound import named_catalogue
from tests.opcua.support import (
    COMMAND,
    FREQUENCY,
    Running,
    client_of,
    double,
    eventually,
    good,
    monitor,
    node,
    running,
    subscribe,
    write,
)

pytestmark = [pytest.mark.asyncio(loop_scope="module"), pytest.mark.xdist_group("opcua-names")]


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def named(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Running]:
    async with running(tmp_path_factory.mktemp("named"), named_catalogue()) as gateway:
        yield gateway


async def test_nodes_and_browse_names_are_the_sites(named: Running) -> None:
    async with client_of(named) as client:
        path = ["3:DeviceSet", "2:Fan", "3:ParameterSet", "2:Speed"]
        speed = await client.nodes.objects.get_child(path)
        assert speed.nodeid == ua.NodeId("F1:speed", 2)
        assert (await speed.read_display_name()).Text == "Speed"
        drive = await client.nodes.objects.get_child(path[:2])
        assert drive.nodeid == ua.NodeId("Hall2.Fan", 2)
        other = await drive.get_child(["3:ParameterSet", "2:running"])
        assert other.nodeid == ua.NodeId("fan-1.running", 2)
        unit = await speed.get_child("0:EngineeringUnits")
        assert unit.nodeid == ua.NodeId("F1:speed/EngineeringUnits", 2)


async def test_what_is_read_written_and_called_is_the_tag(named: Running) -> None:
    named.bridge.reset()
    named.bridge.samples[FREQUENCY] = good(FREQUENCY, 12.5)
    async with client_of(named, "operator") as client:
        assert await node(client, "F1:speed").read_value() == 12.5
        await write(client, "F1:set", double(30.0))
        await node(client, "Hall2.Fan/MethodSet").call_method("2:Halt")
        await node(client, "Hall2.Fan").call_method(ua.NodeId("F1:halt", 2))
        with pytest.raises(ua.uaerrors.BadNodeIdUnknown):
            await node(client, FREQUENCY).read_value()
    assert [tag for tag, *_ in named.bridge.writes] == [COMMAND]
    assert [(drive, name) for drive, name, *_ in named.bridge.commands] == [("fan-1", "stop")] * 2


async def test_an_item_is_a_demand_for_the_tag(named: Running) -> None:
    named.bridge.reset()
    async with client_of(named) as client:
        number, collector = await subscribe(client, 50)
        await monitor(client, number, "F1:speed")
        assert named.bridge.wants == {FREQUENCY: 0.1}
        named.bridge.push(good(FREQUENCY, 7.0))
        await eventually(lambda: 7.0 in collector.contents)
    await eventually(lambda: named.bridge.wants == {})


async def test_two_things_under_one_node_are_refused(standard_space: AddressSpace) -> None:
    catalogue = named_catalogue()
    (fan,) = catalogue.drives
    taken = msgspec.structs.replace(fan.points[0], node="Hall2.Fan/MethodSet")
    clashing = msgspec.structs.replace(fan, points=(taken, *fan.points[1:]))
    with pytest.raises(SettingsError, match=r"Hall2\.Fan/MethodSet"):
        build_space(standard_space, msgspec.structs.replace(catalogue, drives=(clashing,)))
