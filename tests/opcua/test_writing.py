"""Write responses and method calls carry the true outcome."""

from __future__ import annotations

import asyncio
import time
from datetime import UTC, datetime

import pytest
from asyncua import Client, ua

from gateway.tag import Cause, Outcome, Role, Verdict
from tests.opcua.support import COMMAND, FREQUENCY, Running, client_of, double, eventually, good, node, write

pytestmark = pytest.mark.asyncio(loop_scope="session")


def refused(cause: Cause, **more: object) -> Outcome:
    return Outcome(verdict=Verdict.REFUSED, cause=cause, **more)


OUTCOMES = [
    (refused(Cause.WRITES_DISABLED), "BadUserAccessDenied"),
    (refused(Cause.LEASE), "BadUserAccessDenied"),
    (refused(Cause.NOT_WRITABLE), "BadNotWritable"),
    (refused(Cause.OUT_OF_RANGE), "BadOutOfRange"),
    (refused(Cause.PRECONDITION), "BadInvalidState"),
    (refused(Cause.DRIVE_REFUSED, code=0x21, drive_error="illegal_value"), "BadOutOfRange"),
    (refused(Cause.DRIVE_REFUSED, code=0x22, drive_error="locked"), "BadInvalidState"),
    (refused(Cause.DRIVE_REFUSED, code=6, drive_error="busy"), "BadResourceUnavailable"),
    (refused(Cause.DRIVE_REFUSED, code=2), "BadNotSupported"),
    (refused(Cause.DRIVE_REFUSED, code=0x7F), "BadDeviceFailure"),
    (Outcome(verdict=Verdict.FAILED, cause=Cause.NOT_PROVED), "BadDeviceFailure"),
    (Outcome(verdict=Verdict.UNKNOWN, cause=Cause.NO_ANSWER), "BadTimeout"),
    (Outcome(verdict=Verdict.EXPIRED, cause=Cause.EXPIRED), "BadTimeout"),
    (Outcome(verdict=Verdict.SUPERSEDED, cause=Cause.SUPERSEDED), "BadOperationAbandoned"),
]


async def code_of_write(client: Client, tag: str, value: ua.Variant | ua.DataValue) -> str:
    try:
        await write(client, tag, value)
    except ua.UaStatusCodeError as error:
        return ua.StatusCode(error.code).name
    return "Good"


async def test_a_confirmed_write_is_good(gateway: Running) -> None:
    async with client_of(gateway, "operator") as client:
        await write(client, COMMAND, double(42.5))
    (((tag, value, origin, ttl, _),)) = gateway.bridge.writes
    assert (tag, value) == (COMMAND, 42.5)
    assert (origin.through, origin.who, origin.role) == ("opcua", "operator", Role.OPERATOR)
    assert (origin.address, origin.authenticated) == ("127.0.0.1", True)
    assert ttl == 5.0


@pytest.mark.parametrize(("outcome", "code"), OUTCOMES, ids=lambda x: str(getattr(x, "cause", x)))
async def test_every_other_outcome_has_its_status(gateway: Running, outcome: Outcome, code: str) -> None:
    gateway.bridge.outcome = outcome
    async with client_of(gateway, "operator") as client:
        assert await code_of_write(client, COMMAND, double(1.0)) == code


async def test_a_written_value_is_never_echoed(gateway: Running) -> None:
    gateway.bridge.samples[COMMAND] = good(COMMAND, 5.0)
    async with client_of(gateway, "operator") as client:
        await write(client, COMMAND, double(42.5))
        assert await node(client, COMMAND).read_value() == 5.0


async def test_a_client_cannot_set_the_status(gateway: Running) -> None:
    doubtful = ua.DataValue(double(1.0), StatusCode=ua.StatusCode(ua.StatusCodes.UncertainInitialValue))
    async with client_of(gateway, "operator") as client:
        assert await code_of_write(client, COMMAND, doubtful) == "BadWriteNotSupported"
    assert gateway.bridge.writes == []


async def test_a_clients_times_are_passed_over(gateway: Running) -> None:
    at = datetime(2001, 1, 1, tzinfo=UTC)
    gateway.bridge.samples[COMMAND] = good(COMMAND, 5.0)
    written = ua.DataValue(double(6.0), ua.StatusCode(), SourceTimestamp=at, ServerTimestamp=at)
    async with client_of(gateway, "operator") as client:
        assert await code_of_write(client, COMMAND, written) == "Good"
        shown = await node(client, COMMAND).read_data_value()
    assert gateway.bridge.writes[0][1] == 6.0
    assert shown.Value.Value == 5.0
    assert shown.SourceTimestamp > at


async def test_the_plain_call_of_asyncua_writes(gateway: Running) -> None:
    """``write_value`` sends a SourceTimestamp, and any integer as Int64."""
    async with client_of(gateway, "engineer") as client:
        await node(client, COMMAND).write_value(30.0)
        await node(client, "fan-1.run_source").write_value(1)
        await node(client, "fan-1.input_5").write_value(True)
    assert [(tag, value) for tag, value, *_ in gateway.bridge.writes] == [
        (COMMAND, 30.0),
        ("fan-1.run_source", 1),
        ("fan-1.input_5", True),
    ]


@pytest.mark.parametrize(
    ("tag", "kind", "value"),
    [
        (COMMAND, ua.VariantType.Int32, 5),
        (COMMAND, ua.VariantType.String, "5"),
        (COMMAND, ua.VariantType.Double, [1.0]),
        (COMMAND, ua.VariantType.Null, None),
        ("fan-1.run_source", ua.VariantType.Double, 1.0),
        ("fan-1.input_5", ua.VariantType.Byte, 1),
    ],
    ids=lambda x: getattr(x, "name", None),
)
async def test_another_type_is_refused(
    gateway: Running, tag: str, kind: ua.VariantType, value: object
) -> None:
    async with client_of(gateway, "engineer") as client:
        assert await code_of_write(client, tag, ua.Variant(value, kind)) == "BadTypeMismatch"
    assert gateway.bridge.writes == []


async def test_nothing_but_values_of_points_can_be_written(gateway: Running) -> None:
    async with client_of(gateway, "engineer") as client:
        where = node(client, COMMAND)
        for attribute in (ua.AttributeIds.AccessLevel, ua.AttributeIds.DisplayName):
            with pytest.raises(ua.uaerrors.BadNotWritable):
                await where.write_attribute(attribute, ua.DataValue(ua.Variant(255, ua.VariantType.Byte)))
        with pytest.raises(ua.uaerrors.BadNotWritable):
            await client.nodes.namespace_array.write_attribute(
                ua.AttributeIds.Value, ua.DataValue(ua.Variant(["x"], ua.VariantType.String))
            )


async def test_anonymous_clients_never_write_or_call(gateway: Running) -> None:
    async with client_of(gateway) as client:
        assert await code_of_write(client, COMMAND, double(1.0)) == "BadUserAccessDenied"
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await node(client, "fan-1/MethodSet").call_method("2:stop")
    turned = [(what, outcome.cause) for what, _, _, outcome in gateway.bridge.turned[-2:]]
    assert turned == [(COMMAND, Cause.NO_RIGHTS), ("fan-1.stop", Cause.NO_RIGHTS)], "R1: on record too"
    assert gateway.bridge.writes == []
    assert gateway.bridge.commands == []


async def test_the_role_decides(gateway: Running) -> None:
    parameter = ua.Variant(0, ua.VariantType.Int32)
    async with client_of(gateway, "operator") as client:
        assert await code_of_write(client, "fan-1.run_source", parameter) == "BadUserAccessDenied"
    async with client_of(gateway, "engineer") as client:
        assert await code_of_write(client, "fan-1.run_source", parameter) == "Good"
    async with client_of(gateway, "viewer") as client:
        assert await code_of_write(client, COMMAND, double(1.0)) == "BadUserAccessDenied"


async def test_each_item_of_a_request_has_its_own_status(gateway: Running) -> None:
    async with client_of(gateway, "operator") as client:
        values = [
            ua.WriteValue(ua.NodeId(tag, 2), ua.AttributeIds.Value, Value=ua.DataValue(double(1.0)))
            for tag in (COMMAND, FREQUENCY, "fan-1.nothing")
        ]
        results = await client.uaclient.write(ua.WriteParameters(NodesToWrite=values))
    assert [status.name for status in results] == ["Good", "BadUserAccessDenied", "BadNodeIdUnknown"]


async def test_a_slow_write_holds_up_no_read_of_its_session(gateway: Running) -> None:
    gateway.bridge.delay = 0.5
    async with client_of(gateway, "operator") as client:
        slow = asyncio.create_task(write(client, COMMAND, double(1.0)))
        await eventually(lambda: len(gateway.bridge.writes) == 1)
        for _ in range(5):
            await client.nodes.server_state.read_value()
        assert not slow.done()
        await slow


async def test_slow_writes_run_side_by_side(gateway: Running) -> None:
    gateway.bridge.delay = 0.3
    async with client_of(gateway, "operator") as client:
        begun = time.monotonic()
        await asyncio.gather(*(write(client, COMMAND, double(float(n))) for n in range(6)))
        assert time.monotonic() - begun < 6 * gateway.bridge.delay
    assert [value for _, value, *_ in gateway.bridge.writes] == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


async def test_the_answer_comes_before_the_client_gives_up(gateway: Running) -> None:
    gateway.bridge.delay = 3.0
    async with client_of(gateway, "operator") as client:
        client.uaclient.protocol.timeout = 0.5
        assert await code_of_write(client, COMMAND, double(1.0)) == "BadTimeout"
    (((_, _, _, ttl, _),)) = gateway.bridge.writes
    assert ttl < 0.5


async def test_a_method_is_a_command(gateway: Running) -> None:
    async with client_of(gateway, "operator") as client:
        outputs = await node(client, "fan-1/MethodSet").call_method("2:run_forward", double(30.0))
    assert outputs == ["confirmed", ""]
    (((drive, name, args, origin, _, _),)) = gateway.bridge.commands
    assert (drive, name, args, origin.who) == ("fan-1", "run_forward", {"frequency": 30.0}, "operator")


@pytest.mark.parametrize("target", ["_north", "_north/MethodSet"])
async def test_a_method_of_a_line_is_for_all_its_drives(gateway: Running, target: str) -> None:
    async with client_of(gateway, "operator") as client:
        result = await call(client, target, "_north.stop_all")
    assert result.StatusCode.is_good()
    (((owner, name, args, origin, _, _),)) = gateway.bridge.commands
    assert (owner, name, args, origin.who) == ("_north", "stop_all", {}, "operator")


async def call(client: Client, target: str, method: str, *args: ua.Variant) -> ua.CallMethodResult:
    request = ua.CallMethodRequest(ua.NodeId(target, 2), ua.NodeId(method, 2), list(args))
    (result,) = await client.uaclient.call([request])
    return result


async def test_a_call_carries_verdict_and_reason(gateway: Running) -> None:
    gateway.bridge.outcome = refused(Cause.PRECONDITION, reason="the drive is not in remote")
    async with client_of(gateway, "operator") as client:
        result = await call(client, "fan-1", "fan-1.stop")
    assert result.StatusCode.name == "BadInvalidState"
    assert [output.Value for output in result.OutputArguments] == ["refused", "the drive is not in remote"]


async def test_h20_no_stop_is_refused_for_an_argument_too_much(gateway: Running) -> None:
    async with client_of(gateway, "operator") as client:
        results = [
            await call(client, "fan-1", "fan-1.stop", double(1.0)),
            await call(client, "fan-1", "fan-1.stop", ua.Variant([1, 2], ua.VariantType.Int32)),
        ]
    assert [result.StatusCode.name for result in results] == ["Good", "Good"]
    assert [args for _, name, args, *_ in gateway.bridge.commands if name == "stop"] == [{}, {}]


async def test_wrong_arguments_are_named(gateway: Running) -> None:
    async with client_of(gateway, "operator") as client:
        missing = await call(client, "fan-1", "fan-1.run_forward")
        many = await call(client, "fan-1", "fan-1.run_forward", double(1.0), double(2.0))
        wrong = await call(client, "fan-1", "fan-1.run_forward", ua.Variant(30, ua.VariantType.Int32))
        elsewhere = await call(client, "fan-1/ParameterSet", "fan-1.stop")
    assert missing.StatusCode.name == "BadArgumentsMissing"
    assert many.StatusCode.name == "BadTooManyArguments"
    assert wrong.StatusCode.name == "BadInvalidArgument"
    assert [status.name for status in wrong.InputArgumentResults] == ["BadTypeMismatch"]
    assert elsewhere.StatusCode.name == "BadMethodInvalid"
    assert gateway.bridge.commands == []


async def test_a_node_that_is_not_there_is_unknown_for_writes_as_for_reads(gateway: Running) -> None:
    async with client_of(gateway, "operator") as client:
        assert await code_of_write(client, "fan-1.warp", double(1.0)) == "BadNodeIdUnknown"
    assert gateway.bridge.writes == []
