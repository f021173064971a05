"""H10, H11, H12 with everything real: two clients, clients that die, a core that is killed."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import subprocess
import time
from collections.abc import AsyncIterator, Iterator
from typing import Any

import pytest
from asyncua import Client, ua

from tests.cli.program import GATEWAY, gateway
from tests.end_to_end.plant import PASSWORD, TTL, Plant, plant, running_client
from tests.mqtt.spy import Spy

pytestmark = pytest.mark.xdist_group("end_to_end")

LEASE = "plant7/fan-1/lease"


@pytest.fixture(scope="module")
def works(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    with plant(tmp_path_factory.mktemp("leases")) as made:
        yield made


@pytest.fixture(autouse=True)
def at_rest(works: Plant) -> Iterator[None]:
    """Each test leaves the motor standing and the lease free."""
    yield
    gateway("command", works.site, "fan-1", "stop")
    gateway("lease", works.site, "fan-1", "take")
    gateway("lease", works.site, "fan-1", "release")
    works.wait_until(lambda: "fan-1  free" in gateway("lease", works.site).out)


@contextlib.asynccontextmanager
async def logged_in(works: Plant, user: str = "anna") -> AsyncIterator[Client]:
    client = Client(works.url, timeout=20)
    client.set_user(user)
    client.set_password(PASSWORD)
    async with client:
        yield client


async def run_forward(client: Client, frequency: float = 30.0) -> Any:
    return await client.get_node("ns=2;s=fan-1/MethodSet").call_method("2:run_forward", frequency)


def order(v: object = None, by: str = "bob", **more: object) -> dict[str, object]:
    """An MQTT command that is meant now."""
    body = {"args": more.pop("args")} if "args" in more else {"v": v}
    return {"id": f"{time.time_ns()}", "exp": time.time() + 5, "by": by, **body, **more}


async def asked(spy: Spy, name: str, document: dict[str, object]) -> dict[str, Any]:
    """Send a command over MQTT; its answer."""
    spy.send(f"plant7/fan-1/cmd/{name}", document)
    answer = await spy.until(f"plant7/fan-1/ack/{name}", lambda d: d["id"] == document["id"])
    return dict(answer.json)


async def test_h12_opcua_and_mqtt_fight_over_one_drive(works: Plant) -> None:
    async with logged_in(works) as anna, Spy(works.broker.port, 4) as bob:
        assert (await run_forward(anna))[0] == "confirmed"
        told = await asked(bob, "frequency_command", order(10.0))
        assert (told["verdict"], told["cause"]) == ("refused", "lease")
        assert "anna (opcua" in told["reason"]
        assert (await asked(bob, "run_forward", order(args={"frequency": 5})))["cause"] == "lease"
        assert (await asked(bob, "lease", order("acquire")))["cause"] == "lease"
        assert (await asked(bob, "lease", order("take")))["cause"] == "no_rights"
        held = await bob.until(LEASE, lambda d: d["phase"] == "held")
        assert (held.json["by"], held.json["then"]) == ("anna", "stop")
        await asyncio.sleep(1.5 * TTL)
        assert works.running(), "a session that lives keeps its lease without doing anything"
        assert (await asked(bob, "stop", order(args={})))["verdict"] == "confirmed"
        setpoint = anna.get_node("ns=2;s=fan-1.frequency_command")
        await setpoint.write_value(12.5)
        assert await setpoint.read_value() == 12.5


async def test_h12_the_other_way_round_and_the_lock_tells_who_it_is(works: Plant) -> None:
    async with logged_in(works) as anna, Spy(works.broker.port, 4) as bob:
        assert (await asked(bob, "frequency_command", order(20.0)))["verdict"] == "confirmed"
        with pytest.raises(ua.UaStatusCodeError) as refused:
            await anna.get_node("ns=2;s=fan-1.frequency_command").write_value(10.0)
        assert refused.value.code == ua.StatusCodes.BadUserAccessDenied
        lock = anna.get_node("ns=2;s=fan-1/Lock")
        assert await lock.call_method("3:InitLock", "anna's panel") == -1
        assert await lock.call_method("3:RenewLock") == -1
        assert await (await lock.get_child("3:Locked")).read_value() is True
        assert await (await lock.get_child("3:LockingUser")).read_value() == "bob"
        assert 0 < await (await lock.get_child("3:RemainingLockTime")).read_value() <= 1000 * TTL
        with pytest.raises(ua.UaStatusCodeError) as refused:
            await lock.call_method("3:BreakLock")
        assert refused.value.code == ua.StatusCodes.BadUserAccessDenied


async def test_taking_over_with_a_right_of_its_own(works: Plant) -> None:
    async with logged_in(works, "erika") as erika, Spy(works.broker.port, 4) as bob:
        assert (await asked(bob, "run_forward", order(args={"frequency": 20})))["verdict"] == "confirmed"
        assert await erika.get_node("ns=2;s=fan-1/Lock").call_method("3:BreakLock") == 0
        taken = await bob.until("plant7/fan-1/event", lambda d: d["name"] == "lease_taken")
        assert "erika (opcua" in taken.json["text"] and "bob (mqtt" in taken.json["text"]
        assert (await asked(bob, "frequency_command", order(10.0)))["cause"] == "lease"
        await asyncio.sleep(1.5 * TTL)
        assert works.running(), "what bob started is erika's, and her session lives"


def test_h10_a_client_that_is_killed_is_followed_by_a_stop(works: Plant) -> None:
    before = len(works.own_stops())
    with running_client(works) as client:
        assert works.running()
        client.send_signal(signal.SIGKILL)
        works.wait_until(lambda: len(works.own_stops()) > before, TTL + 15)
    assert not works.running()
    assert works.own_stops()[-1]["outcome"]["verdict"] == "confirmed"
    assert len(works.own_stops()) == before + 1


async def test_h10_a_session_that_is_closed_is_followed_by_a_stop_at_once(works: Plant) -> None:
    before = len(works.own_stops())
    async with logged_in(works) as anna:
        await run_forward(anna)
        closed = time.monotonic()
    await asyncio.to_thread(works.wait_until, lambda: len(works.own_stops()) > before, 15)
    lost = [entry for entry in works.journal("lease") if entry["did"] == "lost"]
    assert lost
    assert closed > 0


async def test_h10_an_mqtt_client_that_renews_keeps_it_and_one_that_does_not_is_followed(
    works: Plant,
) -> None:
    before = len(works.own_stops())
    async with Spy(works.broker.port, 4) as bob:
        assert (await asked(bob, "run_forward", order(args={"frequency": 20})))["verdict"] == "confirmed"
        for _ in range(4):
            await asyncio.sleep(TTL / 2)
            assert (await asked(bob, "lease", order("renew")))["verdict"] == "confirmed"
        assert len(works.own_stops()) == before
        await bob.until("plant7/fan-1/event", lambda d: d["name"] == "lease_expired")
    await asyncio.to_thread(works.wait_until, lambda: len(works.own_stops()) > before, 15)


def test_the_command_line_releases_what_it_acquired_and_says_what_follows(works: Plant) -> None:
    before = len(works.own_stops())
    ran = gateway("command", works.site, "fan-1", "run_forward", "frequency=20")
    assert ran.code == 0
    assert "unless somebody acquires it within 3 s: fan-1 is stopped" in ran.err
    works.wait_until(lambda: len(works.own_stops()) > before, 15)


def test_the_command_line_can_hold(works: Plant) -> None:
    before = len(works.own_stops())
    words = ["command", str(works.site), "fan-1", "run_forward", "frequency=20", "--hold"]
    with subprocess.Popen([*GATEWAY, *words], stderr=subprocess.PIPE, text=True) as holding:
        assert holding.stderr is not None
        assert "Ctrl-C releases it" in holding.stderr.readline()
        time.sleep(1.5 * TTL)
        assert works.running()
        assert len(works.own_stops()) == before
        holding.send_signal(signal.SIGINT)
        assert holding.wait(10) == 0
    works.wait_until(lambda: len(works.own_stops()) > before, 15)


async def test_h11_a_core_that_is_killed_remembers_the_lease_and_acts_on_it_and_on_nothing_else(
    works: Plant,
) -> None:
    async with Spy(works.broker.port, 4) as bob:
        assert (await asked(bob, "lease", order("acquire")))["verdict"] == "confirmed"
        assert (await asked(bob, "run_forward", order(args={"frequency": 20})))["verdict"] == "confirmed"
    before = len(works.own_stops())
    intents = len(works.journal("intent"))
    boots = len(works.journal("boot"))
    works.kill_core()
    await asyncio.to_thread(works.wait_until, lambda: len(works.journal("boot")) > boots, 30)
    await asyncio.to_thread(works.wait_until, lambda: len(works.own_stops()) > before, TTL + 30)
    await asyncio.to_thread(works.wait_until_up)
    after = works.journal("intent")[intents:]
    assert {entry["what"] for entry in after} == {"fan-1.stop"}
    assert {entry["by"]["through"] for entry in after} == {"core"}
