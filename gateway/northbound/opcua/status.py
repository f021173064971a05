"""Qualities and outcomes in the words of OPC UA: StatusCodes and DataValues."""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta

from asyncua import ua

from gateway.northbound.opcua import plain
from gateway.tag import Cause, Outcome, Quality, Sample, Severity, Value, Verdict

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)

_QUALITY: dict[Quality, int] = {
    Quality.GOOD: ua.StatusCodes.Good,
    Quality.STALE: ua.StatusCodes.UncertainLastUsableValue,
    Quality.WAITING: ua.StatusCodes.BadWaitingForInitialData,
    Quality.NO_COMMUNICATION: ua.StatusCodes.BadNoCommunication,
    Quality.LINE_DOWN: ua.StatusCodes.BadNotConnected,
    Quality.REFUSED: ua.StatusCodes.BadNotSupported,
    Quality.INVALID: ua.StatusCodes.BadSensorFailure,
    Quality.NOT_APPLICABLE: ua.StatusCodes.BadOutOfService,
    Quality.CONFIGURATION: ua.StatusCodes.BadConfigurationError,
}

_VERDICT: dict[Verdict, int] = {
    Verdict.CONFIRMED: ua.StatusCodes.Good,
    Verdict.FAILED: ua.StatusCodes.BadDeviceFailure,
    Verdict.UNKNOWN: ua.StatusCodes.BadTimeout,
    Verdict.EXPIRED: ua.StatusCodes.BadTimeout,
    Verdict.SUPERSEDED: ua.StatusCodes.BadOperationAbandoned,
}

_REFUSED: dict[Cause, int] = {
    Cause.NONE: ua.StatusCodes.BadInvalidState,
    Cause.WRITES_DISABLED: ua.StatusCodes.BadUserAccessDenied,
    Cause.UNKNOWN_TAG: ua.StatusCodes.BadNodeIdUnknown,
    Cause.UNKNOWN_COMMAND: ua.StatusCodes.BadMethodInvalid,
    Cause.UNKNOWN_ALARM: ua.StatusCodes.BadEventIdUnknown,
    Cause.NOT_WRITABLE: ua.StatusCodes.BadNotWritable,
    Cause.WRONG_TYPE: ua.StatusCodes.BadTypeMismatch,
    Cause.WRONG_ARGUMENTS: ua.StatusCodes.BadInvalidArgument,
    Cause.OUT_OF_RANGE: ua.StatusCodes.BadOutOfRange,
    Cause.NO_RIGHTS: ua.StatusCodes.BadUserAccessDenied,
    Cause.PRECONDITION: ua.StatusCodes.BadInvalidState,
    Cause.DANGER: ua.StatusCodes.BadUserAccessDenied,
    Cause.LEASE: ua.StatusCodes.BadUserAccessDenied,
    Cause.MAINTENANCE: ua.StatusCodes.BadInvalidState,
    Cause.STEP: ua.StatusCodes.BadOutOfRange,
    Cause.TOO_SOON: ua.StatusCodes.BadTooManyOperations,
    Cause.RETAINED: ua.StatusCodes.BadInvalidState,
    Cause.EXPIRED: ua.StatusCodes.BadTimeout,
    Cause.WRONG_EPOCH: ua.StatusCodes.BadInvalidState,
    Cause.MALFORMED: ua.StatusCodes.BadInvalidArgument,
    Cause.DUPLICATE: ua.StatusCodes.BadInvalidState,
    Cause.OVERFLOW: ua.StatusCodes.BadTooManyOperations,
    Cause.JOURNAL: ua.StatusCodes.BadResourceUnavailable,
    Cause.WEAR: ua.StatusCodes.BadResourceUnavailable,
    Cause.DRIVE_REFUSED: ua.StatusCodes.BadDeviceFailure,
    Cause.NO_ANSWER: ua.StatusCodes.BadNoCommunication,
    Cause.LINE_DOWN: ua.StatusCodes.BadNotConnected,
    Cause.NOT_PROVED: ua.StatusCodes.BadDeviceFailure,
    Cause.SUPERSEDED: ua.StatusCodes.BadOperationAbandoned,
    Cause.SHUTTING_DOWN: ua.StatusCodes.BadShutdown,
    Cause.INTERNAL: ua.StatusCodes.BadInternalError,
}

_DRIVE_ERROR: dict[str, int] = {
    "illegal_function": ua.StatusCodes.BadNotSupported,
    "illegal_address": ua.StatusCodes.BadNotSupported,
    "illegal_count": ua.StatusCodes.BadOutOfRange,
    "illegal_value": ua.StatusCodes.BadOutOfRange,
    "locked": ua.StatusCodes.BadInvalidState,
    "undervoltage": ua.StatusCodes.BadInvalidState,
    "busy": ua.StatusCodes.BadResourceUnavailable,
    "drive_failure": ua.StatusCodes.BadDeviceFailure,
}

_MODBUS_EXCEPTION: dict[int, int] = {
    1: ua.StatusCodes.BadNotSupported,
    2: ua.StatusCodes.BadNotSupported,
    3: ua.StatusCodes.BadOutOfRange,
    6: ua.StatusCodes.BadResourceUnavailable,
}
"""For drive errors that the profile does not name (Modbus application protocol, section 7)."""

_RANGE: dict[ua.VariantType, tuple[int, int]] = {
    ua.VariantType.Int32: (-(2**31), 2**31 - 1),
    ua.VariantType.Int64: (-(2**63), 2**63 - 1),
}


def quality_status(quality: Quality) -> ua.StatusCode:
    """The StatusCode of a sample's quality."""
    return plain.status(_QUALITY[quality])


def outcome_status(outcome: Outcome) -> ua.StatusCode:
    """The StatusCode of what became of a write or command: Good means read back, nothing less."""
    if outcome.cause is Cause.DRIVE_REFUSED and outcome.verdict is Verdict.REFUSED:
        return plain.status(_drive_refused(outcome))
    if outcome.verdict is Verdict.REFUSED:
        return plain.status(_REFUSED[outcome.cause])
    return plain.status(_VERDICT.get(outcome.verdict, ua.StatusCodes.BadTimeout))


def _drive_refused(outcome: Outcome) -> int:
    if outcome.drive_error in _DRIVE_ERROR:
        return _DRIVE_ERROR[outcome.drive_error]
    return _MODBUS_EXCEPTION.get(outcome.code or 0, ua.StatusCodes.BadDeviceFailure)


def data_value(sample: Sample, kind: ua.VariantType) -> ua.DataValue:
    """The sample as a DataValue of the node's type; a bad one carries no value."""
    if sample.quality.severity is Severity.BAD:
        return bad_value(_QUALITY[sample.quality], sample.time)
    try:
        value = convert(sample.value, kind)
    except (TypeError, ValueError):
        return bad_value(ua.StatusCodes.BadConfigurationError, sample.time)
    variant = ua.Variant(value, kind)
    return plain.data_value(variant, _QUALITY[sample.quality], timestamp(sample.time), datetime.now(UTC))


def bad_value(code: int, time: int = 0) -> ua.DataValue:
    """A DataValue that tells only why there is none; ``time`` in nanoseconds since 1970, 0: no time."""
    nothing = ua.Variant(None, ua.VariantType.Null)
    return plain.data_value(nothing, code, timestamp(time), datetime.now(UTC))


def timestamp(time: int) -> datetime | None:
    """Nanoseconds since 1970 as a UTC time; None for 0."""
    return _EPOCH + timedelta(microseconds=time // 1000) if time > 0 else None


def convert(value: Value, kind: ua.VariantType) -> Value | ua.LocalizedText:
    """The value as the node's type holds it.

    Raises:
        TypeError: if the value is of another sort.
        ValueError: if it is not a number that the type can hold.
    """
    if kind is ua.VariantType.Double:
        return _double(value)
    if kind in _RANGE:
        return _integer(value, *_RANGE[kind])
    if kind is ua.VariantType.Boolean and isinstance(value, bool):
        return value
    if kind is ua.VariantType.String and isinstance(value, str):
        return value
    if kind is ua.VariantType.LocalizedText:
        return ua.LocalizedText("" if value is None else str(value))
    raise TypeError(f"{value!r} is no {kind.name}")


def _double(value: Value) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number")
    if not math.isfinite(value):
        raise ValueError(f"{value!r} is not finite")
    return float(value)


def _integer(value: Value, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"{value!r} is no integer")
    if not low <= value <= high:
        raise ValueError(f"{value!r} is not within {low} and {high}")
    return value
