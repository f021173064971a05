"""Writes and method calls: asked of the core, answered with their true outcome.

The core is the only judge: whatever an authenticated client asks and can be understood goes there. Anonymous
clients, and what makes no sense in OPC UA's own terms, are turned away at once; the journal has them too.
"""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Awaitable
from typing import Any

import structlog
from asyncua import ua

from gateway.bridge.api import DEFAULT_TTL, Bridge, BridgeError
from gateway.northbound.opcua import plain
from gateway.northbound.opcua.commands import named
from gateway.northbound.opcua.given import is_mistaken, is_plain, is_taken, value_of
from gateway.northbound.opcua.locking import NOT_YOURS, OK
from gateway.northbound.opcua.model import MethodNode, Model, TagNode
from gateway.northbound.opcua.status import outcome_status
from gateway.tag import Cause, Origin, Outcome, Verdict, tag_of

TTL_SHARE = 0.9
"""Part of a client's patience after which nothing is sent any more."""

SHOWN = 200
"""Characters of a value that are shown in the journal at most."""

_CAUSES = {
    ua.StatusCodes.BadUserAccessDenied: Cause.NO_RIGHTS,
    ua.StatusCodes.BadNotWritable: Cause.NOT_WRITABLE,
    ua.StatusCodes.BadTypeMismatch: Cause.WRONG_TYPE,
    ua.StatusCodes.BadWriteNotSupported: Cause.MALFORMED,
}

STOPS = ("stop", "stop_all")
"""The commands that are carried out whatever arguments are given."""

_REASONS = {
    ua.StatusCodes.BadUserAccessDenied: "nobody writes without a name and a password",
    ua.StatusCodes.BadTypeMismatch: "of another type than the node (an integer is never taken for a number)",
    ua.StatusCodes.BadWriteNotSupported: "a part of a value, or one whose status is not Good",
    ua.StatusCodes.BadInvalidArgument: "an argument is of another type than the method's",
}

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
        if node is None:
            return plain.status(ua.StatusCodes.BadNotWritable)
        objection = _write_objection(wanted, node)
        if not origin.authenticated:
            objection = ua.StatusCodes.BadUserAccessDenied
        if objection is not None:
            self._turn_away(node.tag, wanted.Value.Value, origin, objection)
            return plain.status(objection)
        asked = self._bridge.write(node.tag, value_of(wanted.Value.Value), origin, _ttl(patience))
        return outcome_status(await self._outcome(asked, patience, node.tag))

    async def write_missing(
        self, wanted: ua.WriteValue, origin: Origin, patience: float | None
    ) -> ua.StatusCode:
        """Write to a node that is not there. Where it would be a drive's, the core says so, on record."""
        missing = self._model.missing(wanted.NodeId)
        given = wanted.Value.Value
        if missing is None or given is None or not is_plain(given) or not origin.authenticated:
            return plain.status(ua.StatusCodes.BadNodeIdUnknown)
        tag = tag_of(*missing)
        asked = self._bridge.write(tag, value_of(given), origin, _ttl(patience))
        return outcome_status(await self._outcome(asked, patience, tag))

    async def call(
        self, wanted: ua.CallMethodRequest, origin: Origin, patience: float | None
    ) -> ua.CallMethodResult:
        """Carry out a command. Good means that its proof was seen; verdict and reason are outputs."""
        method = self._model.methods.get(wanted.MethodId)
        given = list(wanted.InputArguments or [])
        if method is not None and method.is_command and method.what.rpartition(".")[2] in STOPS:
            given = []  # what a stop does not take is passed over: it is never refused for that
        if method is None:
            return await self._call_missing(wanted.MethodId, given, origin, patience)
        if wanted.ObjectId not in method.objects:
            return _call_refused(ua.StatusCodes.BadMethodInvalid)
        objection = _call_objection(method, given)
        own = objection is not None and not _is_for_core(method, given)
        if not origin.authenticated:
            objection, own = _call_refused(ua.StatusCodes.BadUserAccessDenied), True
        if objection is not None and own:
            self._turn_away(method.what, [value.Value for value in given], origin, objection.StatusCode.value)
            return objection
        values = [value_of(value) for value in given]
        asked = method.ask(self._bridge, values, origin, _ttl(patience))
        outcome = await self._outcome(asked, patience, method.what)
        if method.is_lock:
            return _locked(outcome, len(given))
        result = _call_done(outcome, len(given))
        if objection is not None and outcome.cause in (Cause.WRONG_ARGUMENTS, Cause.WRONG_TYPE):
            result.StatusCode = objection.StatusCode
            result.InputArgumentResults = objection.InputArgumentResults
        return result

    async def _call_missing(
        self, method: ua.NodeId, given: list[ua.Variant], origin: Origin, patience: float | None
    ) -> ua.CallMethodResult:
        """A call of a method that is not there, as `write_missing`."""
        missing = self._model.missing(method)
        if missing is None or not all(is_plain(value) for value in given) or not origin.authenticated:
            return _call_refused(ua.StatusCodes.BadMethodInvalid)
        arguments = named([value_of(value) for value in given])
        asked = self._bridge.command(*missing, arguments, origin, _ttl(patience))
        return _call_done(await self._outcome(asked, patience, tag_of(*missing)), len(given))

    def _turn_away(self, what: str, wanted: Any, origin: Origin, code: int) -> None:
        """Have the core put on record what does not get as far as it."""
        cause = _CAUSES.get(code, Cause.WRONG_ARGUMENTS)
        shown = wanted.Value if isinstance(wanted, ua.Variant) else wanted
        plain_value = shown if isinstance(shown, bool | int | float | None) else str(shown)[:SHOWN]
        reason = _REASONS.get(code) or plain.status(code).name
        outcome = Outcome(verdict=Verdict.REFUSED, cause=cause, reason=reason)
        self._bridge.turned_away(what, plain_value, origin, outcome)

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
    """Nothing is sent after its asker stopped waiting; he hears of it before."""
    return DEFAULT_TTL if patience is None else min(DEFAULT_TTL, TTL_SHARE * patience)


def _is_for_core(method: MethodNode, given: list[ua.Variant]) -> bool:
    """True for wrong arguments of a command that the core refuses for certain."""
    kinds = itertools.chain(method.takes, itertools.repeat(ua.VariantType.Variant))
    return method.is_command and all(
        is_plain(value) and (is_taken(value, kind) or is_mistaken(value, kind))
        for value, kind in zip(given, kinds, strict=False)
    )


def _write_objection(wanted: ua.WriteValue, node: TagNode) -> int | None:
    """Why the write makes no sense in OPC UA's own terms; None when it does."""
    if node.text or wanted.AttributeId != ua.AttributeIds.Value:
        return ua.StatusCodes.BadNotWritable
    value = wanted.Value
    if wanted.IndexRange or _is_doubtful(value):
        return ua.StatusCodes.BadWriteNotSupported
    if not is_taken(value.Value, node.kind) and not is_mistaken(value.Value, node.kind):
        return ua.StatusCodes.BadTypeMismatch
    return None


def _is_doubtful(value: ua.DataValue) -> bool:
    """True when the client itself says that the value is not good. Its times are passed over: many clients
    send them unasked, and the node shows the drive's read-back with its own time."""
    return value.StatusCode is not None and value.StatusCode.value != ua.StatusCodes.Good


def _call_objection(method: MethodNode, given: list[ua.Variant]) -> ua.CallMethodResult | None:
    expected = method.takes
    if len(given) < len(expected):
        return _call_refused(ua.StatusCodes.BadArgumentsMissing)
    if len(given) > len(expected):
        return _call_refused(ua.StatusCodes.BadTooManyArguments)
    codes = [_argument_code(kind, value) for kind, value in zip(expected, given, strict=True)]
    if all(code == ua.StatusCodes.Good for code in codes):
        return None
    result = _call_refused(ua.StatusCodes.BadInvalidArgument)
    result.InputArgumentResults = [plain.status(code) for code in codes]
    return result


def _argument_code(kind: ua.VariantType, value: ua.Variant) -> int:
    return ua.StatusCodes.Good if is_taken(value, kind) else ua.StatusCodes.BadTypeMismatch


def _call_refused(code: int) -> ua.CallMethodResult:
    result = ua.CallMethodResult()
    result.StatusCode = plain.status(code)
    return result


def _locked(outcome: Outcome, arguments: int) -> ua.CallMethodResult:
    """The answer of a lock: Good and a number, unless it is about something else than who holds it."""
    yours = outcome.verdict is Verdict.CONFIRMED
    result = _call_done(outcome, arguments)
    if yours or outcome.cause is Cause.LEASE:
        result.StatusCode = ua.StatusCode()
    result.OutputArguments = [ua.Variant(OK if yours else NOT_YOURS, ua.VariantType.Int32)]
    return result


def _call_done(outcome: Outcome, arguments: int) -> ua.CallMethodResult:
    result = ua.CallMethodResult()
    result.StatusCode = outcome_status(outcome)
    result.InputArgumentResults = [ua.StatusCode() for _ in range(arguments)]
    outputs: list[Any] = [ua.Variant(outcome.verdict.value, ua.VariantType.String)]
    outputs.append(ua.Variant(outcome.reason, ua.VariantType.String))
    result.OutputArguments = outputs
    return result
