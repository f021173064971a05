"""Which commands are taken: payload, freshness, at most once."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bridge.api import LeaseAct
from gateway.northbound.mqtt.freshness import HORIZON, time_to_live
from gateway.northbound.mqtt.message import Incoming
from gateway.northbound.mqtt.once import LIMIT, REMEMBER, Once
from gateway.northbound.mqtt.order import Order, read_order, read_own_order
from gateway.northbound.mqtt.request import SIZE_LIMIT, MalformedError, RejectedError, Request, parse
from gateway.tag import Cause, Instant, Outcome, Verdict
from tests.fakes import small_catalogue

EPOCH = "e" * 16
WALL = 1_800_000_000_000_000_000
FAN = small_catalogue().drives[0]

short = st.text(max_size=8)
scalars = st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats() | short
json_values = scalars | st.lists(scalars, max_size=2) | st.dictionaries(short, scalars, max_size=2)
command_like = st.dictionaries(st.sampled_from(("id", "v", "args", "exp", "by", "epoch", "x")), json_values)
good = st.fixed_dictionaries({"id": short | st.integers(0, 9), "epoch": st.just(EPOCH)})
commands = st.builds(lambda a, b: json.dumps(a | b).encode(), command_like, good | st.just({}))
payloads = st.binary(max_size=50) | commands
unhurried = settings(deadline=None)  # the machine may be busy


def message(document: object = None, payload: bytes | None = None, **changes: object) -> Incoming:
    """A message that came at `WALL`."""
    fields: dict[str, object] = {
        "topic": "plant7/fan-1/cmd/frequency_command",
        "payload": json.dumps(document).encode() if payload is None else payload,
        "retain": False,
        "epoch": EPOCH,
        "arrived": Instant(100.0, WALL),
    }
    return Incoming(**(fields | changes))  # type: ignore[arg-type]


def order(document: object, name: str = "frequency_command", **changes: object) -> Order:
    return read_order(FAN, name, message(document, **changes))


def rejection(document: object, name: str = "frequency_command", **changes: object) -> Outcome:
    with pytest.raises(RejectedError) as caught:
        order(document, name, **changes)
    return caught.value.outcome


@unhurried
@given(payloads)
def test_any_payload_is_a_finite_fresh_order_or_is_rejected(payload: bytes) -> None:
    for name in ("frequency_command", "run_forward"):
        try:
            result = read_order(FAN, name, message(payload=payload))
        except RejectedError as error:
            assert error.outcome.verdict in (Verdict.REFUSED, Verdict.EXPIRED)
            assert error.outcome.reason
        else:
            assert 0 < result.ttl <= 5.0
            assert result.id is not None
            contents = result.content.values() if isinstance(result.content, dict) else [result.content]
            assert all(not isinstance(value, float) or math.isfinite(value) for value in contents)


@unhurried
@given(payloads)
def test_stop_is_taken_whatever_its_payload(payload: bytes) -> None:
    result = read_order(FAN, "stop", message(payload=payload))
    assert result.is_stop
    assert result.args == {}
    assert result.bridge_id == ""


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"30",
        b"[]",
        b"\xff\xfe",
        b'{"id":1,"v":NaN}',
        b'{"id":1,"v":Infinity}',
        b'{"id":1,"v":-Infinity}',
        b'{"id":1,"v":1e999}',
        b'{"id":1,"v":' + b"9" * 400 + b"}",
        b'{"id":1,"v":9007199254740993}',
        b'{"id":1,"v":30,"v":50}',
        b'{"id":1,"args":{"f":1,"f":2}}',
        b'{"id":"\\ud800","v":1}',
        b'{"id":1,"value":1}',
        b'{"id":true,"v":1}',
        b'{"id":1.5,"v":1}',
        b'{"id":1,"v":[1]}',
        b'{"id":1,"v":{"a":1}}',
        b'{"id":1,"args":{"f":null}}',
        b'{"id":1,"args":[1]}',
        b'{"id":"' + b"x" * 200 + b'","v":1}',
        b'{"id":1,"v":1' + b" " * SIZE_LIMIT + b"}",
        b"[" * 2000,
        b'{"a":' * 500,
    ],
)
def test_malformed_payloads(payload: bytes) -> None:
    with pytest.raises(MalformedError):
        parse(payload)


def test_a_malformed_command_keeps_its_id_for_the_answer() -> None:
    with pytest.raises(MalformedError) as caught:
        parse(b'{"id":"mine","v":[1]}')
    assert caught.value.id == "mine"


@pytest.mark.parametrize(
    "exp",
    [WALL / 1e9 + 2, WALL / 1e6 + 2000, "2027-01-15T08:00:02Z", "2027-01-15T09:00:02+01:00"],
    ids=["seconds", "milliseconds", "utc", "zone"],
)
def test_the_end_of_a_command_in_every_form(exp: float | str) -> None:
    assert order({"id": 1, "v": 30, "exp": exp}).ttl == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize("exp", ["tomorrow", "2027-01-15T08:00:02", 1e300, -1e300, True, [1]])
def test_what_is_not_a_time(exp: object) -> None:
    assert rejection({"id": 1, "v": 30, "exp": exp}).cause is Cause.MALFORMED


@unhurried
@given(st.floats(-1e6, 1e6), st.booleans())
def test_freshness(ahead: float, with_epoch: bool) -> None:
    request = Request(id=1, v=1, exp=WALL / 1e9 + ahead, epoch=EPOCH if with_epoch else None)
    left = (request.expires - WALL) / 1e9  # type: ignore[operator]
    try:
        ttl = time_to_live(message(), request)
    except RejectedError as error:
        assert left <= 0 or (left > HORIZON and not with_epoch)
        assert (error.outcome.verdict is Verdict.EXPIRED) == (left <= 0)
    else:
        assert left > 0
        assert ttl == min(left, 5.0)


def test_a_wrong_epoch_is_refused_even_when_the_end_lies_ahead() -> None:
    outcome = rejection({"id": 1, "v": 30, "exp": WALL / 1e9 + 2, "epoch": "f" * 16})
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, Cause.WRONG_EPOCH)


def test_without_proof_of_freshness_nothing_is_written() -> None:
    assert rejection({"id": 1, "v": 30}).cause is Cause.MALFORMED
    assert order({"id": 1, "v": 30}, expiry=2).ttl == 2.0
    assert rejection({"id": 1, "v": 30}, expiry=3600).cause is Cause.MALFORMED
    assert rejection({"id": 1, "v": 30, "epoch": EPOCH}, expiry=0).cause is Cause.EXPIRED


def test_without_id_nothing_is_written() -> None:
    assert rejection({"v": 30, "epoch": EPOCH}).cause is Cause.MALFORMED


def test_values_are_for_points_and_arguments_for_commands() -> None:
    assert order({"id": 1, "epoch": EPOCH, "v": 30}).value == 30
    assert order({"id": 1, "epoch": EPOCH, "args": {"frequency": 5}}, "run_forward").args == {"frequency": 5}
    assert order({"id": 1, "epoch": EPOCH}, "reset_fault").args == {}
    for document, name in (
        ({"args": {}}, "frequency_command"),
        ({"v": None}, "frequency_command"),
        ({}, "frequency_command"),
        ({"v": 1}, "run_forward"),
    ):
        assert rejection({"id": 1, "epoch": EPOCH} | document, name).cause is Cause.MALFORMED


def test_h3_the_core_knows_a_retry_whatever_end_or_epoch_it_carries() -> None:
    """After a restart of the adapter only the core remembers; a retry has to carry a later end then."""
    exp = WALL / 1e9 + 3
    later = Instant(200.0, WALL + 1_000_000_000)
    first = order({"id": 1, "v": 30, "exp": exp})
    assert order({"id": 1, "v": 30, "exp": exp + 1}, arrived=later).bridge_id == first.bridge_id
    assert order({"id": 1, "v": 30, "epoch": EPOCH}, arrived=later).bridge_id == first.bridge_id
    assert order({"id": 2, "v": 30, "exp": exp}).bridge_id != first.bridge_id
    assert order({"id": 1, "v": 30, "exp": exp, "by": "anna"}).bridge_id != first.bridge_id


def test_true_is_not_one() -> None:
    assert (
        order({"id": 1, "v": 1, "epoch": EPOCH}).fingerprint
        != order({"id": 1, "v": True, "epoch": EPOCH}).fingerprint
    )


@unhurried
@given(st.lists(st.tuples(st.integers(0, 5), st.floats(0, 30)), max_size=60))
def test_a_command_is_remembered_long_enough(steps: list[tuple[int, float]]) -> None:
    once: Once[int] = Once()
    began: dict[int, float] = {}
    now = 0.0
    for key, pause in steps:
        now += pause
        found = once.find(key, now)
        if key in began and now - began[key] < REMEMBER:
            assert found is not None
        else:
            assert found is None
            once.begin(key, key)
            once.finish(key, Outcome(verdict=Verdict.CONFIRMED), now)
            began[key] = now


def test_commands_under_way_are_never_forgotten_and_memory_is_bounded() -> None:
    once: Once[int] = Once()
    once.begin("slow", 0)
    for number in range(2 * LIMIT):
        once.find(number, 1.0)
        once.begin(number, 0)
        once.finish(number, Outcome(verdict=Verdict.CONFIRMED), 1.0)
    assert once.find(LIMIT - 1, 1.0) is None
    assert once.find(2 * LIMIT - 1, 1.0) is not None
    assert once.find("slow", 10 * REMEMBER) is not None


def own_order(document: object, name: str = "lease", **changes: object) -> Order:
    return read_own_order(FAN, name, message(document, **changes))


@pytest.mark.parametrize("act", list(LeaseAct))
def test_an_order_about_a_lease(act: LeaseAct) -> None:
    read = own_order({"id": 1, "v": act.value, "epoch": EPOCH, "by": "anna", "from": "bob"})
    assert (read.own, read.value, read.by, read.whom) == ("lease", act.value, "anna", "bob")


@pytest.mark.parametrize(
    ("document", "name"),
    [
        ({"id": 1, "v": "grab", "epoch": EPOCH}, "lease"),
        ({"id": 1, "epoch": EPOCH}, "lease"),
        ({"id": 1, "args": {}, "epoch": EPOCH}, "lease"),
        ({"v": "renew", "epoch": EPOCH}, "lease"),
        ({"id": 1, "v": "on", "epoch": EPOCH}, "maintenance"),
        ({"id": 1, "v": 1, "epoch": EPOCH}, "maintenance"),
    ],
)
def test_what_is_no_order_about_a_drive(document: object, name: str) -> None:
    with pytest.raises(MalformedError):
        own_order(document, name)


def test_h1_an_old_renewal_keeps_no_dead_clients_lease_alive() -> None:
    for stale in ({"epoch": "another"}, {"exp": WALL / 1e9 - 1}, {}):
        with pytest.raises(RejectedError):
            own_order({"id": 1, "v": "renew", **stale})


def test_only_leases_have_a_from_and_only_maintenance_a_reason() -> None:
    for key in ("from", "reason"):
        assert rejection({"id": 1, "v": 9.0, "epoch": EPOCH, key: "x"}).cause is Cause.MALFORMED
    read = own_order({"id": 1, "v": True, "epoch": EPOCH, "reason": "bearing"}, "maintenance")
    assert (read.value, read.reason) == (True, "bearing")


def test_another_confirmation_is_another_order() -> None:
    one, other = (order({"id": 1, "v": 9.0, "epoch": EPOCH, "confirm": text}) for text in ("a", "b"))
    assert one.confirm == "a"
    assert one.fingerprint != other.fingerprint
