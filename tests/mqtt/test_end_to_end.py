"""The adapter against real brokers, seen by an independent client."""

from __future__ import annotations

import asyncio
import time

import msgspec
import pytest

from gateway.bridge.api import DriveState, Happened
from gateway.northbound.mqtt import connection, link, protocol
from gateway.tag import Cause, Event, Outcome, Quality, Sample, Verdict
from tests.fakes import FakeBridge, small_catalogue
from tests.mqtt.brokers import BrokerProcess
from tests.mqtt.conftest import adapter, section
from tests.mqtt.spy import Spy
from tests.northbound import named_catalogue

FREQUENCY = "plant7/fan-1/state/output_frequency"
GATEWAY = "plant7/_gateway/gw1/status"
SETPOINT = "plant7/fan-1/cmd/frequency_command"
ACK = "plant7/fan-1/ack/frequency_command"


def hertz(value: float, quality: Quality = Quality.GOOD) -> Sample:
    return Sample("fan-1.output_frequency", value, quality, time.time_ns())


async def epoch_of(spy: Spy) -> str:
    birth = await spy.until(GATEWAY, lambda d: d["status"] == "online")
    return str(birth.json["epoch"])


async def test_values_reach_retained_topics(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        bridge.push(hertz(49.98))
        seen = await spy.until(FREQUENCY, lambda d: d["v"] == 49.98)
        assert seen.json["q"] == "good"
        assert seen.json["u"] == "Hz"
        assert seen.json["ts"].endswith("Z")
        assert seen.qos == 1
        await epoch_of(spy)
        bridge.push(
            *(Sample(f"fan-1.{bit}", True, Quality.GOOD, time.time_ns()) for bit in ("running", "run"))
        )
        data = await spy.until("plant7/fan-1/data", lambda d: len(d["values"]) == 2)
        assert data.json["values"]["running"]["v"] is True
        assert not data.retain
        async with Spy(broker.port, broker.version) as late:
            kept = await late.until(FREQUENCY)
            assert kept.retain
            assert kept.json["v"] == 49.98


async def test_what_is_wanted_follows_from_the_rules(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        await epoch_of(spy)
        assert bridge.wants["fan-1.output_frequency"] == 0.2
        assert bridge.wants["fan-1.output_voltage"] == 1.0
        assert "fan-1.run_source" not in bridge.wants  # a parameter


async def test_diagnostics_go_where_they_cannot_be_taken_for_a_drives(broker: BrokerProcess) -> None:
    publish = [{"points": ["_north.*", "_timeouts"], "rate": 1.0}]
    bridge = FakeBridge(section=section(broker.port, publish=publish))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        bridge.push(Sample("_north.utilisation", 97.5, Quality.GOOD, time.time_ns()))
        state = await spy.until("plant7/_gateway/gw1/lines/north/state/utilisation", lambda d: d["v"])
        assert (state.json["v"], state.json["u"]) == (97.5, "%")
        bridge.push(Sample("fan-1._timeouts", 3, Quality.GOOD, time.time_ns()))
        await spy.until("plant7/fan-1/state/_timeouts", lambda d: d["v"] == 3)
        meta = await spy.until("plant7/fan-1/meta", lambda d: d["points"])
        assert meta.json["points"]["_timeouts"]["published"] is True


async def test_birth_comes_after_everything_retained(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        await epoch_of(spy)
        topics = [seen.topic for seen in spy.seen]
        before = topics[: topics.index(GATEWAY)]
        assert "plant7/fan-1/meta" in before
        assert FREQUENCY in before


async def test_loss_is_shown_as_bad_with_its_reason(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        bridge.push(hertz(50.0))
        await spy.until(FREQUENCY, lambda d: d["v"] == 50.0)
        now = time.time_ns()
        lost = Sample("fan-1.output_frequency", None, Quality.NO_COMMUNICATION, now, reason="no answer")
        bridge.push(lost)
        bridge.push_update(DriveState("fan-1", up=False, time=now, reason="no answer since 3 requests"))
        event = Event(time=now, drive="fan-1", name="communication_lost", text="fan-1 does not answer")
        bridge.push_update(Happened(event))
        seen = await spy.until(FREQUENCY, lambda d: d["q"] == "bad" and d["cause"] == "no_communication")
        assert seen.json["v"] is None
        assert seen.json["reason"] == "no answer"
        status = await spy.until("plant7/fan-1/status", lambda d: d["status"] == "offline")
        assert "3 requests" in status.json["reason"]
        await spy.until("plant7/fan-1/event", lambda d: d["name"] == "communication_lost")


async def test_a_setpoint_is_written_and_answered(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    bridge.outcome = Outcome(verdict=Verdict.CONFIRMED, value=30.0)
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        epoch = await epoch_of(spy)
        spy.send(SETPOINT, {"id": "a1", "v": 30.0, "epoch": epoch, "by": "ann"})
        ack = (await spy.until(ACK)).json
        assert (ack["id"], ack["verdict"], ack["v"]) == ("a1", "confirmed", 30.0)
        ((tag, value, origin, ttl, _),) = bridge.writes
        assert (tag, value, ttl) == ("fan-1.frequency_command", 30.0, pytest.approx(5.0, abs=1.0))
        assert (origin.through, origin.who, origin.role, origin.authenticated) == (
            "mqtt",
            "ann",
            "operator",
            False,
        )


async def test_a_command_takes_arguments_and_shows_its_refusal(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    bridge.outcome = Outcome(verdict=Verdict.REFUSED, cause=Cause.OUT_OF_RANGE, reason="above 60 Hz", code=3)
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        await epoch_of(spy)
        soon = time.time() + 5
        spy.send("plant7/fan-1/cmd/run_forward", {"id": 7, "args": {"frequency": 99}, "exp": soon})
        ack = (await spy.until("plant7/fan-1/ack/run_forward")).json
        assert (ack["id"], ack["verdict"], ack["cause"], ack["code"]) == (7, "refused", "out_of_range", 3)
        assert ack["reason"] == "above 60 Hz"
        ((drive, name, args, _, ttl, _),) = bridge.commands
        assert (drive, name, args) == ("fan-1", "run_forward", {"frequency": 99})
        assert 3.0 < ttl <= 5.0


async def test_expired_and_stale_commands_are_never_carried_out(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        epoch = await epoch_of(spy)
        spy.send(SETPOINT, {"id": "old", "v": 30, "exp": time.time() - 1, "epoch": epoch})
        spy.send(SETPOINT, {"id": "other", "v": 30, "epoch": "0123456789abcdef"})
        spy.send(SETPOINT, {"id": "bare", "v": 30})
        acks = {ack.json["id"]: ack.json for ack in await spy.several(3, ACK)}
        assert acks["old"]["verdict"] == "expired"
        assert acks["other"]["cause"] == "wrong_epoch"
        assert acks["bare"]["cause"] == "malformed"
        assert bridge.writes == []


async def test_a_retained_command_is_refused_and_told(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy:
        command = {"id": "r1", "v": 30, "exp": time.time() + 50}
        stop = {"id": "r2"}
        if broker.version == 4:  # the broker hands it to the gateway when that connects
            spy.send(SETPOINT, command, retain=True)
            spy.send("plant7/fan-1/cmd/stop", stop, retain=True)
            await spy.until("plant7/fan-1/cmd/stop")
        async with adapter(bridge):
            await epoch_of(spy)
            if broker.version == 5:  # not asked for when connecting; passes by later with its mark
                spy.send(SETPOINT, command, retain=True)
                spy.send("plant7/fan-1/cmd/stop", stop, retain=True)
            ack = await spy.until(ACK)
            assert (ack.json["id"], ack.json["verdict"], ack.json["cause"]) == ("r1", "refused", "retained")
            await spy.until("plant7/fan-1/ack/stop", lambda d: d["cause"] == "retained")
            told = await spy.several(2, "plant7/fan-1/event", lambda d: d["name"] == "command_refused")
            assert {event.json["command"] for event in told} == {"frequency_command", "stop"}
            assert bridge.writes == []
            assert bridge.commands == []


async def test_a_repeated_command_is_carried_out_once(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    bridge.delay = 0.2
    bridge.outcome = Outcome(verdict=Verdict.CONFIRMED, value=30.0)
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        epoch = await epoch_of(spy)
        command = {"id": "once", "v": 30, "epoch": epoch}
        spy.send(SETPOINT, command)
        spy.send(SETPOINT, command)
        first, second = await spy.several(2, ACK)
        spy.send(SETPOINT, command)
        third = (await spy.several(3, ACK))[2]
        assert [m.json["verdict"] for m in (first, second, third)] == ["confirmed"] * 3
        assert [m.json.get("repeated", False) for m in (first, second, third)] == [False, True, True]
        assert len(bridge.writes) == 1


async def test_stop_needs_nothing_and_is_never_a_repetition(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        await epoch_of(spy)
        for payload in (b"", b"now!", b'{"id": "s"}', b'{"id": "s"}'):
            spy.send("plant7/fan-1/cmd/stop", payload)
        acks = await spy.several(4, "plant7/fan-1/ack/stop")
        assert [ack.json["verdict"] for ack in acks] == ["confirmed"] * 4
        assert [(name, id) for _, name, _, _, _, id in bridge.commands] == [("stop", "")] * 4


async def test_a_drive_of_another_gateway_is_left_alone(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        epoch = await epoch_of(spy)
        spy.send("plant7/pump-9/cmd/frequency_command", {"id": "p", "v": 1, "epoch": epoch})
        spy.send(SETPOINT, {"id": "f", "v": 1, "epoch": epoch})
        await spy.until(ACK)
        assert [w[0] for w in bridge.writes] == ["fan-1.frequency_command"]
        assert not [m for m in spy.seen if m.topic.startswith("plant7/pump-9/ack")]


async def test_a_site_may_call_everything_otherwise(broker: BrokerProcess) -> None:
    bridge = FakeBridge(named_catalogue(), section(broker.port))
    async with Spy(broker.port, broker.version, "plant7/#", "hall2/#") as spy, adapter(bridge):
        epoch = await epoch_of(spy)
        bridge.push(hertz(12.0))
        await spy.until("hall2/fan/state/speed/hz", lambda d: d["v"] == 12.0)
        data = await spy.until("hall2/fan/data", lambda d: "output_frequency" in d["values"])
        assert data.json["values"]["output_frequency"]["v"] == 12.0
        spy.send("hall2/fan/cmd/speed/set", {"id": 1, "v": 30, "epoch": epoch})
        await spy.until("hall2/fan/ack/speed/set", lambda d: d["verdict"] == "confirmed")
        spy.send("hall2/fan/cmd/frequency_command", {"id": 2, "v": 30, "epoch": epoch})
        await spy.until("hall2/fan/ack/frequency_command", lambda d: d["cause"] == "unknown_tag")
        spy.send("hall2/fan/cmd/halt", {})
        await spy.until("hall2/fan/ack/halt", lambda d: d["verdict"] == "confirmed")
        assert [(tag, value) for tag, value, *_ in bridge.writes] == [("fan-1.frequency_command", 30)]
        assert [name for _, name, *_ in bridge.commands] == ["stop"]
        assert not [seen.topic for seen in spy.seen if seen.topic.startswith("plant7/fan-1")]


async def test_more_drives_than_one_subscription_takes(broker: BrokerProcess) -> None:
    fan = small_catalogue().drives[0]
    names = [f"fan-{number}" for number in range(2 * protocol.FILTERS + 1)]
    fans = tuple(msgspec.structs.replace(fan, name=name) for name in names)
    bridge = FakeBridge(msgspec.structs.replace(small_catalogue(), drives=fans), section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        await epoch_of(spy)
        for name in names:
            spy.send(f"plant7/{name}/cmd/stop", {})
        for name in names:
            await spy.until(f"plant7/{name}/ack/stop", lambda d: d["verdict"] == "confirmed")
        assert sorted(drive for drive, *_ in bridge.commands) == sorted(names)


async def test_without_commands_in_the_section_none_are_taken(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port, commands=None))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        birth = await spy.until(GATEWAY, lambda d: d["status"] == "online")
        assert birth.json["commands"] is False
        spy.send("plant7/fan-1/cmd/stop", {"id": "s"})
        await spy.until("plant7/fan-1/cmd/stop")
        bridge.push(hertz(1.0))
        await spy.until(FREQUENCY, lambda d: d["v"] == 1.0)
        assert bridge.commands == []


async def test_the_broker_dies_and_returns(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with adapter(bridge):
        async with Spy(broker.port, broker.version) as spy:
            first_epoch = await epoch_of(spy)
            bridge.push(hertz(10.0))
            await spy.until(FREQUENCY, lambda d: d["v"] == 10.0)
        broker.kill()
        for value in range(2000):
            bridge.push(hertz(float(value)), Sample("fan-1.running", value % 2 == 0, Quality.GOOD, 1))
        async with asyncio.timeout(5):
            while not bridge._queue.empty():  # a dead broker does not hold up the bridge
                await asyncio.sleep(0)
        bridge.push(Sample("fan-1.output_frequency", None, Quality.STALE, time.time_ns(), reason="last"))
        broker.start()
        async with Spy(broker.port, broker.version) as spy:
            birth = await spy.until(GATEWAY, lambda d: d.get("epoch") not in (None, first_epoch))
            assert birth.json["status"] == "online"
            await spy.until(FREQUENCY, lambda d: d.get("cause") == "stale")
            await spy.until("plant7/fan-1/state/running", lambda d: d["v"] is False)
            await spy.until("plant7/fan-1/meta")
            await spy.until(GATEWAY)


async def test_hundreds_of_tags_over_one_connection(broker: BrokerProcess) -> None:
    drive = small_catalogue().drives[0]
    bit = drive.points[0]
    points = tuple(msgspec.structs.replace(bit, name=f"bit_{number}") for number in range(400))
    catalogue = msgspec.structs.replace(
        small_catalogue(), drives=(msgspec.structs.replace(drive, points=points),)
    )
    bridge = FakeBridge(catalogue, section(broker.port))
    async with Spy(broker.port, broker.version) as spy, adapter(bridge):
        epoch = await epoch_of(spy)
        now = time.time_ns()
        bridge.push(*(Sample(f"fan-1.bit_{number}", True, Quality.GOOD, now) for number in range(400)))
        for number in range(400):
            await spy.until(f"plant7/fan-1/state/bit_{number}", lambda d: d["v"] is True)
        assert {seen.json.get("epoch") for seen in spy.seen if seen.topic == GATEWAY} == {epoch}


async def test_a_broker_that_hangs_is_given_up(
    broker: BrokerProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(protocol, "KEEPALIVE", 1)
    monkeypatch.setattr(connection, "MISC_PERIOD", 0.1)
    bridge = FakeBridge(section=section(broker.port))
    async with adapter(bridge):
        async with Spy(broker.port, broker.version) as spy:
            first = await epoch_of(spy)
        lost = asyncio.Event()
        monkeypatch.setattr(link.log, "warning", lambda *_: lost.set())
        broker.freeze()
        async with asyncio.timeout(10):
            await lost.wait()
        broker.thaw()
        async with Spy(broker.port, broker.version) as spy:
            await spy.until(GATEWAY, lambda d: d.get("epoch") not in (None, first))


async def test_an_orderly_end_leaves_no_live_looking_value(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version) as spy:
        async with adapter(bridge):
            bridge.push(hertz(50.0))
            await spy.until(FREQUENCY, lambda d: d["v"] == 50.0)
            await epoch_of(spy)
            begun = time.monotonic()
        assert time.monotonic() - begun < 2.0
        gone = await spy.until(GATEWAY, lambda d: d["status"] == "offline")
        assert "stopped" in gone.json["reason"]
        async with Spy(broker.port, broker.version) as late:
            state = await late.until(FREQUENCY)
            assert (state.json["v"], state.json["q"]) == (None, "bad")
            assert (await late.until(GATEWAY)).json["status"] == "offline"


@pytest.mark.parametrize("broker", ["mosquitto"], indirect=True)
async def test_mqtt_5_extras(broker: BrokerProcess) -> None:
    bridge = FakeBridge(section=section(broker.port))
    async with Spy(broker.port, broker.version, "plant7/#", "me/#") as spy, adapter(bridge):
        await epoch_of(spy)
        spy.send(
            SETPOINT,
            {"id": "x", "v": 5},
            MessageExpiryInterval=3,
            ResponseTopic="me/answers",
            CorrelationData=b"\x01\x02",
        )
        answer = await spy.until("me/answers")
        assert answer.json["verdict"] == "confirmed"
        assert answer.correlation == b"\x01\x02"
        assert (await spy.until(ACK)).json["id"] == "x"
        assert 2.0 < bridge.writes[0][3] <= 3.0
        spy.send(SETPOINT, {"id": "y", "v": 5}, MessageExpiryInterval=3, ResponseTopic=FREQUENCY)
        await spy.several(2, ACK)
        assert not [m for m in spy.seen if m.topic == FREQUENCY and "verdict" in m.json]
