"""Writes and method calls: asked of the core, answered with their true outcome.

The core is the only judge: whatever an authenticated client asks and can be understood goes there, so
that refusals too are in its journal. Only anonymous clients are turned away at once.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from typing import Any

import structlog
from asyncua import ua

from gateway.bridge.api import DEFAULT_TTL, ArgumentInfo, Bridge, BridgeError
from gateway.northbound.opcua import plain
from gateway.northbound.opcua.given import is_taken, value_of
from gateway.northbound.opcua.model import MethodNode, Model, TagNode, variant_type
from gateway.northbound.opcua.status import outcome_status
from gateway.tag import Cause, Origin, Outcome, Verdict

_log = structlog.get_logger(__name__)


class Asker:
    """Carries writes and calls to the core."""

    def __init__(self, bridge: Bridge, model: Model) -> None:
        self._bridge = bridge
        self._model = model
        self._late: set[asyncio.Task[Outcome]] = set()

    async def write(self, wanted: ua.WriteValue, origin: Origin, patience: float | None) -> ua.StatusCode:
        """Write one value. Good means that the drive was seen to hold it."""
        node = self._model.tags.get(wanted.NodeId)
        objection = _write_objection(wanted, node)
        if objection is not None or node is None:
            return plain.status(objection or ua.StatusCodes.BadNotWritable)
        if not origin.authenticated:
            _log.warning("anonymous write refused", tag=node.tag, address=origin.address)
            return plain.status(ua.StatusCodes.BadUserAccessDenied)
        asked = self._bridge.write(node.tag, value_of(wanted.Value.Value), origin, _ttl(patience))
        return outcome_status(await self._outcome(asked, patience, node.tag))

    async def call(
        self, wanted: ua.CallMethodRequest, origin: Origin, patience: float | None
    ) -> ua.CallMethodResult:
        """Carry out a command. Good means that its proof was seen; verdict and reason are outputs."""
        method = self._model.methods.get(wanted.MethodId)
        if method is None or wanted.ObjectId not in method.objects:
            return _call_refused(ua.StatusCodes.BadMethodInvalid)
        given = list(wanted.InputArguments or [])
        objection = _call_objection(method, given)
        if objection is not None:
            return objection
        if not origin.authenticated:
            _log.warning("anonymous call refused", drive=method.drive, address=origin.address)
            return _call_refused(ua.StatusCodes.BadUserAccessDenied)
        args = {arg.name: value_of(value) for arg, value in zip(method.command.args, given, strict=True)}
        asked = self._bridge.command(method.drive, method.command.name, args, origin, _ttl(patience))
        outcome = await self._outcome(asked, patience, f"{method.drive}.{method.command.name}")
        return _call_done(outcome, len(given))

    async def _outcome(self, asked: Awaitable[Outcome], patience: float | None, what: str) -> Outcome:
        """The outcome; when the client's patience ends first, ``unknown``, and the late outcome is logged.

        The request itself is never cancelled: what was asked may be on the wire.
        """
        task = asyncio.ensure_future(asked)
        done, _ = await asyncio.wait((task,), timeout=patience)
        if done:
            return _result(task)
        self._late.add(task)
        task.add_done_callback(lambda late: self._log_late(late, what))
        return Outcome(verdict=Verdict.UNKNOWN, reason="not finished within the time that the client waits")

    def _log_late(self, task: asyncio.Future[Outcome], what: str) -> None:
        self._late.discard(task)
        if not task.cancelled():
            outcome = _result(task)
            _log.warning("late outcome", what=what, verdict=outcome.verdict.value, reason=outcome.reason)


def _result(task: asyncio.Future[Outcome]) -> Outcome:
    try:
        return task.result()
    except BridgeError as error:
        return Outcome(verdict=Verdict.UNKNOWN, cause=Cause.SHUTTING_DOWN, reason=str(error))


def _ttl(patience: float | None) -> float:
    """Nothing is sent after its asker stopped waiting."""
    return DEFAULT_TTL if patience is None else min(DEFAULT_TTL, patience)


def _write_objection(wanted: ua.WriteValue, node: TagNode | None) -> int | None:
    """Why the write makes no sense in OPC UA's own terms; None when it does."""
    if node is None or node.text or wanted.AttributeId != ua.AttributeIds.Value:
        return ua.StatusCodes.BadNotWritable
    value = wanted.Value
    if wanted.IndexRange or _is_doubtful(value):
        return ua.StatusCodes.BadWriteNotSupported
    if not is_taken(value.Value, node.kind):
        return ua.StatusCodes.BadTypeMismatch
    return None


def _is_doubtful(value: ua.DataValue) -> bool:
    """True when the client itself says that the value is not good. Its times are passed over: many clients
    send them unasked, and the node shows the drive's read-back with its own time."""
    return value.StatusCode is not None and value.StatusCode.value != ua.StatusCodes.Good


def _call_objection(method: MethodNode, given: list[ua.Variant]) -> ua.CallMethodResult | None:
    expected = method.command.args
    if len(given) < len(expected):
        return _call_refused(ua.StatusCodes.BadArgumentsMissing)
    if len(given) > len(expected):
        return _call_refused(ua.StatusCodes.BadTooManyArguments)
    codes = [_argument_code(arg, value) for arg, value in zip(expected, given, strict=True)]
    if all(code == ua.StatusCodes.Good for code in codes):
        return None
    result = _call_refused(ua.StatusCodes.BadInvalidArgument)
    result.InputArgumentResults = [plain.status(code) for code in codes]
    return result


def _argument_code(arg: ArgumentInfo, value: ua.Variant) -> int:
    return ua.StatusCodes.Good if is_taken(value, variant_type(arg)) else ua.StatusCodes.BadTypeMismatch


def _call_refused(code: int) -> ua.CallMethodResult:
    result = ua.CallMethodResult()
    result.StatusCode = plain.status(code)
    return result


def _call_done(outcome: Outcome, arguments: int) -> ua.CallMethodResult:
    result = ua.CallMethodResult()
    result.StatusCode = outcome_status(outcome)
    result.InputArgumentResults = [ua.StatusCode() for _ in range(arguments)]
    outputs: list[Any] = [ua.Variant(outcome.verdict.value, ua.VariantType.String)]
    outputs.append(ua.Variant(outcome.reason, ua.VariantType.String))
    result.OutputArguments = outputs
    return result
