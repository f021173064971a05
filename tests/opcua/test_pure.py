"""The parts that need no server: statuses, interest, throttle, reporting, settings, service level."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from asyncua import ua
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bridge.api import PointInfo
from gateway.northbound.opcua.given import is_taken, value_of
from gateway.northbound.opcua.health import service_level
from gateway.northbound.opcua.interest import Interest, Item
from gateway.northbound.opcua.model import variant_type
from gateway.northbound.opcua.points import decimals, describe
from gateway.northbound.opcua.reporting import Rule, enqueue
from gateway.northbound.opcua.settings import Security, SettingsError, read_settings
from gateway.northbound.opcua.status import bad_value, data_value, outcome_status, quality_status
from gateway.northbound.opcua.throttle import FREE, LONGEST, SOURCES, Throttle
from gateway.northbound.opcua.units import engineering_units
from gateway.tag import Cause, Outcome, Quality, Sample, Severity, ValueType, Verdict

SECTION = {"endpoint": "opc.tcp://127.0.0.1:4840", "certificates": "c", "users_file": "u"}


NUMBER_TYPES = (ua.VariantType.Double, ua.VariantType.Float)
INTEGER_TYPES = [
    kind
    for kind in ua.VariantType
    if kind.name.lstrip("S").startswith(("Int", "UInt", "Byte")) and kind.value < 10
]


@pytest.mark.parametrize("kind", [kind for kind in ua.VariantType if kind.name != "Null"])
def test_types_that_clients_may_write(kind: ua.VariantType) -> None:
    given = ua.Variant(1, kind)
    assert len(INTEGER_TYPES) == 8
    for integer in (ua.VariantType.Int32, ua.VariantType.Int64):
        assert is_taken(given, integer) == (kind in INTEGER_TYPES)
    assert is_taken(given, ua.VariantType.Double) == (kind in NUMBER_TYPES)
    for exact in (ua.VariantType.Boolean, ua.VariantType.String):
        assert is_taken(given, exact) == (kind is exact)


@pytest.mark.parametrize("value", [0.0, 0.01, 12.34, 59.9, 400.0, 655.35, -0.1, 1e-30, 16777216.0])
def test_a_float_is_the_decimal_that_was_meant(value: float) -> None:
    (sent,) = struct.unpack("<f", struct.pack("<f", value))
    assert value_of(ua.Variant(sent, ua.VariantType.Float)) == value
    assert value_of(ua.Variant(sent, ua.VariantType.Double)) == sent


@settings(max_examples=50, deadline=None)
@given(st.floats(width=32))
def test_a_float_stays_the_same_float(sent: float) -> None:
    value: Any = value_of(ua.Variant(sent, ua.VariantType.Float))
    assert struct.pack("<f", value) == struct.pack("<f", sent)


@pytest.mark.parametrize("quality", Quality)
def test_every_quality_has_a_status_of_its_severity(quality: Quality) -> None:
    status = quality_status(quality)
    severity = {Severity.GOOD: "good", Severity.UNCERTAIN: "uncertain", Severity.BAD: "bad"}
    assert getattr(status, f"is_{severity[quality.severity]}")()


@pytest.mark.parametrize("verdict", [verdict for verdict in Verdict if verdict.final])
@pytest.mark.parametrize("cause", Cause)
def test_only_a_confirmed_outcome_is_good(verdict: Verdict, cause: Cause) -> None:
    status = outcome_status(Outcome(verdict=verdict, cause=cause))
    assert status.is_good() == (verdict is Verdict.CONFIRMED)
    assert status.is_bad() == (verdict is not Verdict.CONFIRMED)


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (math.nan, ua.VariantType.Double),
        (math.inf, ua.VariantType.Double),
        ("1", ua.VariantType.Double),
        (True, ua.VariantType.Double),
        (2**63, ua.VariantType.Int64),
        (2**31, ua.VariantType.Int32),
        (1.5, ua.VariantType.Int64),
        (1, ua.VariantType.Boolean),
        (1, ua.VariantType.String),
        (None, ua.VariantType.Double),
    ],
)
def test_a_value_that_the_type_cannot_hold_is_bad(value: Any, kind: ua.VariantType) -> None:
    shown = data_value(Sample("a.b", value, Quality.GOOD, 1), kind)
    assert shown.StatusCode == ua.StatusCode(ua.StatusCodes.BadConfigurationError)
    assert shown.Value is not None
    assert shown.Value.Value is None


def test_an_enumeration_of_large_numbers_is_an_int64() -> None:
    small = PointInfo(
        name="a", group="g", kind="status", type=ValueType.INTEGER, rate="slow", values={1: "x"}
    )
    large = PointInfo(
        name="a", group="g", kind="status", type=ValueType.INTEGER, rate="slow", values={2**31: "x"}
    )
    assert variant_type(small) is ua.VariantType.Int32
    assert variant_type(large) is ua.VariantType.Int64


actions = st.lists(
    st.tuples(
        st.integers(0, 4),
        st.sampled_from(["a.x", "a.y", None]),
        st.sampled_from([0.1, 0.5, 2.0]),
        st.booleans(),
    ),
    max_size=40,
)


@settings(max_examples=50, deadline=None)
@given(actions)
def test_the_core_is_told_the_fastest_period_of_each_tag(steps: list[tuple[int, Any, float, bool]]) -> None:
    interest, told, model = Interest(), {}, {}
    for number, tag, period, settle in steps:
        if tag is None:
            interest.drop(Item(1, number))
            model.pop(number, None)
        else:
            interest.want(Item(1, number), tag, period)
            model[number] = (tag, period)
        if settle:
            told.update(interest.take_changes())
    told.update(interest.take_changes())
    fastest: dict[str, float] = {}
    for tag, period in model.values():
        fastest[tag] = min(period, fastest.get(tag, period))
    assert {tag: period for tag, period in told.items() if period is not None} == fastest
    assert interest.take_changes() == {}


def test_what_could_not_be_told_is_told_again() -> None:
    interest = Interest()
    interest.want(Item(1, 1), "a.x", 1.0)
    interest.give_back(interest.take_changes())
    assert interest.take_changes() == {"a.x": 1.0}
    interest.drop(Item(1, 1))
    interest.give_back(interest.take_changes())
    assert interest.take_changes() == {"a.x": None}


def test_guessing_gets_slow_for_its_source_only() -> None:
    throttle = Throttle()
    for attempt in range(20):
        assert (throttle.wait("bad", float(attempt) * 100) == 0.0) or attempt > FREE
        throttle.failed("bad", float(attempt) * 100)
    assert throttle.wait("bad", 1900.0) == LONGEST
    assert throttle.wait("good", 1900.0) == 0.0
    assert throttle.wait("bad", 1900.0 + LONGEST) == 0.0
    throttle.succeeded("bad")
    assert throttle.wait("bad", 1900.0) == 0.0


def test_the_throttle_remembers_a_bounded_number_of_sources() -> None:
    throttle = Throttle()
    for source in range(SOURCES + 10):
        for _ in range(FREE + 1):
            throttle.failed(str(source), 0.0)
    assert throttle.wait("0", 0.0) == 0.0
    assert throttle.wait(str(SOURCES + 9), 0.0) > 0.0


def double(value: float) -> ua.DataValue:
    return ua.DataValue(ua.Variant(value, ua.VariantType.Double))


def reported(rule: Rule, values: list[ua.DataValue]) -> list[float | None]:
    found = []
    for value in values:
        if rule.due(value):
            rule.reported = value
            found.append(value.Value.Value if value.Value else None)
    return found


def test_slow_drift_passes_a_deadband() -> None:
    ramp = [double(10 + 0.4 * step) for step in range(1, 21)]
    found = reported(Rule(deadband=1.0, reported=double(10.0)), ramp)
    assert found == pytest.approx([11.2, 12.4, 13.6, 14.8, 16.0, 17.2])


def test_a_status_trigger_reports_status_only() -> None:
    values = [double(1.0), double(2.0), bad_value(ua.StatusCodes.BadNotConnected), double(3.0)]
    assert reported(Rule(trigger=ua.DataChangeTrigger.Status), values) == [1.0, None, 3.0]


def queue_after(size: int, *, discard_oldest: bool) -> list[tuple[float, bool]]:
    queue: list[ua.MonitoredItemNotification] = []
    for number in range(5):
        notification = ua.MonitoredItemNotification(ClientHandle=1, Value=double(float(number)))
        enqueue(queue, notification, size, discard_oldest=discard_oldest)
    return [(item.Value.Value.Value, item.Value.StatusCode.value == 0x480) for item in queue]


def test_an_overflowing_queue_says_so() -> None:
    assert queue_after(3, discard_oldest=True) == [(2.0, True), (3.0, False), (4.0, False)]
    assert queue_after(3, discard_oldest=False) == [(0.0, False), (1.0, False), (4.0, True)]
    assert queue_after(1, discard_oldest=True) == [(4.0, False)]
    assert queue_after(9, discard_oldest=True) == [(float(n), False) for n in range(5)]


def test_defaults_of_the_section_are_safe() -> None:
    settings = read_settings(SECTION)
    assert settings.security == (Security.SIGN_AND_ENCRYPT,)
    assert not settings.anonymous


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"endpoint": None}, "endpoint"),
        ({"endpoint": "http://127.0.0.1"}, "opc.tcp"),
        ({"endpoint": "opc.tcp://127.0.0.1:99999"}, "endpoint"),
        ({"security": []}, "empty"),
        ({"security": ["sometimes"]}, "sometimes"),
        ({"certificates": None}, "certificates"),
        ({"endpoint": "opc.tcp://0.0.0.0:4840", "anonymous": True}, "anonymous"),
        ({"endpoint": "opc.tcp://192.168.0.1:4840", "security": ["none"]}, "none"),
        ({"endpoint": "opc.tcp://plant7:4840", "security": ["none"]}, "none"),
    ],
)
def test_e3_what_cannot_be_used_or_is_careless_is_refused(change: dict[str, Any], word: str) -> None:
    with pytest.raises(SettingsError, match=word):
        read_settings(SECTION | change)


def test_the_service_level_falls_with_the_drives_that_are_lost() -> None:
    assert [service_level(3, down) for down in range(4)] == [255, 133, 67, 1]
    assert service_level(0, 0) == 255


def test_an_unknown_unit_keeps_its_symbol() -> None:
    unit = engineering_units("furlong")
    assert (unit.UnitId, unit.DisplayName.Text) == (-1, "furlong")


@pytest.mark.parametrize(("step", "digits"), [(0.01, 2.0), (0.1, 1.0), (1.0, 0.0), (10.0, 0.0), (0.5, 1.0)])
def test_digits_behind_the_point(step: float, digits: float) -> None:
    assert decimals(step) == digits


def test_a_doubt_is_told() -> None:
    assert describe("Speed.", "sim 9", "scale") == "Speed. Source: sim 9. Doubt: scale."
