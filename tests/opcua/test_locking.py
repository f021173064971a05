"""The lock of a drive, maintenance, values that do harm; sessions that keep their leases alive (H10, H12)."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from asyncua import Client, ua

from gateway.bridge.api import Catalogue, ControlInfo, ControlState, LeaseAct
from gateway.tag import Cause, Origin, Outcome, Quality, Role, Sample, Verdict
from tests.fakes import small_catalogue
from tests.opcua.support import COMMAND, Running, client_of, double, eventually, node, running

pytestmark = pytest.mark.asyncio(loop_scope="session")

TTL = 0.8
LOCK = "fan-1/Lock"
HELD = Outcome(verdict=Verdict.REFUSED, cause=Cause.LEASE, reason="held by bob")


async def call(client: Client, where: str, method: str, *args: Any) -> Any:
    return await node(client, where).call_method(ua.QualifiedName(method, 3), *args)


@pytest.mark.parametrize(
    ("method", "args", "act"),
    [
        ("InitLock", ["panel 3"], LeaseAct.ACQUIRE),
        ("RenewLock", [], LeaseAct.RENEW),
        ("ExitLock", [], LeaseAct.RELEASE),
        ("BreakLock", [], LeaseAct.TAKE),
    ],
)
async def test_a_lock_asks_for_the_lease_and_answers_a_number(
    gateway: Running, method: str, args: list[Any], act: LeaseAct
) -> None:
    gateway.bridge.leases.clear()
    async with client_of(gateway, "engineer") as client:
        assert await call(client, LOCK, method, *args) == 0
        gateway.bridge.outcome = HELD
        assert await call(client, LOCK, method, *args) == -1
    drive, asked, origin, whom = gateway.bridge.leases[0]
    assert (drive, asked, whom) == ("fan-1", act, "")
    assert (origin.who, origin.role, len(origin.session)) == ("engineer", Role.ENGINEER, 16)


async def test_what_is_not_about_the_holder_is_no_number(gateway: Running) -> None:
    gateway.bridge.outcome = Outcome(verdict=Verdict.REFUSED, cause=Cause.NO_RIGHTS)
    async with client_of(gateway, "operator") as client:
        with pytest.raises(ua.UaStatusCodeError) as refused:
            await call(client, LOCK, "BreakLock")
    assert refused.value.code == ua.StatusCodes.BadUserAccessDenied


async def test_anonymous_locks_nothing(gateway: Running) -> None:
    gateway.bridge.leases.clear()
    async with client_of(gateway) as client:
        with pytest.raises(ua.UaStatusCodeError):
            await call(client, LOCK, "InitLock", "")
    assert gateway.bridge.leases == []


async def test_who_holds_it_is_shown(gateway: Running) -> None:
    for tag, value in (("fan-1._locked", True), ("fan-1._lease_holder", "bob")):
        gateway.bridge.samples[tag] = Sample(tag, value, Quality.GOOD, 10**18)
    async with client_of(gateway) as client:
        assert await node(client, f"{LOCK}/Locked").read_value() is True
        assert await node(client, f"{LOCK}/LockingUser").read_value() == "bob"


async def test_maintenance(gateway: Running) -> None:
    gateway.bridge.maintained.clear()
    async with client_of(gateway, "engineer") as client:
        told = await call(client, "fan-1/Administration", "SetMaintenance", True, "bearing")
    assert told[0] == "confirmed"
    assert gateway.bridge.maintained[0][:2] == ("fan-1", True)
    assert gateway.bridge.maintained[0][3] == "bearing"


async def test_a_value_that_does_harm_is_confirmed_by_a_method(gateway: Running) -> None:
    gateway.bridge.confirmed.clear()
    async with client_of(gateway, "engineer") as client:
        given = ["run_source", ua.Variant(0, ua.VariantType.Int32), "the line is obeyed"]
        await call(client, "fan-1/Administration", "WriteConfirmed", *given)
        await node(client, COMMAND).write_attribute(ua.AttributeIds.Value, ua.DataValue(double(1.0)))
    assert gateway.bridge.writes[0][:2] == ("fan-1.run_source", 0)
    assert gateway.bridge.confirmed == ["the line is obeyed", ""]


async def test_the_core_hears_how_many_writes_came_together(gateway: Running) -> None:
    async with client_of(gateway, "operator") as client:
        nodes = [node(client, COMMAND), node(client, "fan-1.input_5")]
        await client.write_values(nodes, [double(1.0), ua.Variant(True, ua.VariantType.Boolean)])
    assert [origin.together for _, _, origin, _, _ in gateway.bridge.writes] == [2, 2]


# -- sessions and their leases


def leased() -> Catalogue:
    catalogue = small_catalogue()
    drive = msgspec.structs.replace(catalogue.drives[0], control=ControlInfo(ttl=TTL, on_expiry="stop"))
    return msgspec.structs.replace(catalogue, drives=(drive,))


@contextlib.asynccontextmanager
async def keeping(folder: Path) -> AsyncIterator[Running]:
    async with running(folder, leased()) as gateway:
        yield gateway


def holds(gateway: Running, origin: Origin) -> None:
    """The core tells that this client holds the lease."""
    gateway.bridge.push_update(ControlState(drive="fan-1", phase="held", holder=origin))


async def with_a_lease(gateway: Running, client: Client) -> Origin:
    """Write once; the session's origin, which holds the lease from now on."""
    before = len(gateway.bridge.writes)
    await node(client, COMMAND).write_attribute(ua.AttributeIds.Value, ua.DataValue(double(1.0)))
    origin = gateway.bridge.writes[before][2]
    holds(gateway, origin)
    return origin


async def test_h10_a_living_session_renews_its_lease_and_one_that_is_closed_has_lost_it(
    tmp_path: Path,
) -> None:
    async with keeping(tmp_path) as gateway:
        bridge = gateway.bridge
        async with client_of(gateway, "operator") as client:
            origin = await with_a_lease(gateway, client)
            await eventually(lambda: len(bridge.leases) >= 3)
            assert {(act, who) for _, act, who, _ in bridge.leases} == {(LeaseAct.RENEW, origin)}
            assert bridge.departed == []
        await eventually(lambda: bridge.departed != [])
        assert bridge.departed[0] == (origin, False)


async def test_h10_a_session_whose_connection_breaks_may_return_and_is_not_renewed_meanwhile(
    tmp_path: Path,
) -> None:
    async with keeping(tmp_path) as gateway:
        bridge = gateway.bridge
        client = client_of(gateway, "operator")
        await client.connect()
        origin = await with_a_lease(gateway, client)
        client.uaclient.protocol.transport.abort()
        await eventually(lambda: bridge.departed != [])
        assert bridge.departed[0] == (origin, True)
        renewed = len(bridge.leases)
        await eventually(lambda: bridge.departed[0] == (origin, True))
        async with client_of(gateway, "operator") as other:
            await other.get_namespace_array()
        assert len(bridge.leases) <= renewed + 1
        with contextlib.suppress(Exception):
            await client.disconnect()


async def test_h10_leases_of_others_are_not_renewed(tmp_path: Path) -> None:
    async with keeping(tmp_path) as gateway:
        async with client_of(gateway, "operator") as client:
            origin = await with_a_lease(gateway, client)
            await eventually(lambda: gateway.bridge.leases != [])
            holds(gateway, msgspec.structs.replace(origin, session="another"))
            holds(gateway, replace_through(origin))
            await client.get_namespace_array()
            gateway.bridge.leases.clear()
            await with_a_lease(gateway, client)
            await eventually(lambda: gateway.bridge.leases != [])
        assert {who.session for _, _, who, _ in gateway.bridge.leases} == {origin.session}


def replace_through(origin: Origin) -> Origin:
    return msgspec.structs.replace(origin, through="mqtt")


async def test_h11_the_end_of_the_server_ends_no_lease(tmp_path: Path) -> None:
    async with keeping(tmp_path) as gateway:
        client = client_of(gateway, "operator")
        await client.connect()
        await with_a_lease(gateway, client)
    assert gateway.bridge.departed == []
    with contextlib.suppress(Exception):
        await client.disconnect()
