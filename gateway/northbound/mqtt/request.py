"""The payload of a command: ``{"id":…, "v":… | "args":{…}, "exp":…, "by":…, "epoch":…}``.

``id`` is the sender's own name for this command (text or integer, answered as it came); ``v`` the value
for a point, ``args`` the arguments for a command; ``exp`` when it ends to be meant (seconds or
milliseconds since 1970, or ISO 8601 with a time zone); ``by`` who asks, as far as one believes him;
``epoch`` the gateway's present epoch from its status topic; ``confirm`` the harm that a value does, in the
words of the drive's profile; ``from`` whom a lease is to be taken from; ``reason`` why a drive goes into
maintenance.
"""

from __future__ import annotations

import json
import math
from datetime import datetime
from typing import Any, NoReturn

import msgspec

from gateway.tag import Cause, Outcome, Verdict

SIZE_LIMIT = 4096
"""Longest payload in bytes."""
DEPTH_LIMIT = 4
"""Deepest nesting of objects and lists."""
TEXT_LIMIT = 128
"""Longest id, epoch or name in characters."""
INTEGER_LIMIT = 2**53
"""From here on, integers are not exact in every JSON reader."""
MILLISECONDS_FROM = 1e11
"""An ``exp`` from here on counts milliseconds: as seconds it would lie beyond the year 5000."""
LATEST = 253_402_300_800_000
"""The year 10000 in milliseconds."""


class RejectedError(Exception):
    """A command that never reaches the bridge. ``id`` is its id if that could be made out."""

    def __init__(self, outcome: Outcome, id: str | int | None = None) -> None:
        super().__init__(outcome.reason)
        self.outcome = outcome
        self.id = id


class MalformedError(RejectedError):
    """The payload is not a command."""

    def __init__(self, reason: str, id: str | int | None = None) -> None:
        super().__init__(refused(Cause.MALFORMED, reason), id)


def refused(cause: Cause, reason: str) -> Outcome:
    """The outcome of what a rule of this adapter does not let pass."""
    return Outcome(verdict=Verdict.REFUSED, cause=cause, reason=reason)


class Request(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A command's payload, as it came."""

    id: str | int | None = None
    v: bool | int | float | str | msgspec.UnsetType | None = msgspec.UNSET
    args: dict[str, bool | int | float | str] | msgspec.UnsetType = msgspec.UNSET
    exp: int | float | str | None = None
    by: str = "anonymous"
    epoch: str | None = None
    confirm: str = ""
    whom: str = msgspec.field(default="", name="from")
    reason: str = ""

    @property
    def expires(self) -> int | None:
        """When the command ends to be meant, in wall-clock nanoseconds; None if it does not say.

        Raises:
            MalformedError: if ``exp`` is not a time.
        """
        return None if self.exp is None else _nanoseconds(self.exp, self.id)


def parse(payload: bytes) -> Request:
    """Read a payload, strictly: every key known and given once, every number finite.

    Raises:
        MalformedError: with the reason in words.
    """
    document = _json(payload)
    found = document.get("id") if isinstance(document, dict) else None
    id = found if isinstance(found, str | int) and len(str(found)) <= TEXT_LIMIT else None
    try:
        request = msgspec.convert(document, Request)
    except msgspec.ValidationError as error:
        raise MalformedError(str(error), id) from None
    _check_lengths(request, id)
    return request


def lenient_id(payload: bytes) -> tuple[str | int | None, str]:
    """Id and sender of a command whose payload does not matter (stop, or one that is refused anyway)."""
    try:
        request = parse(payload)
    except MalformedError as error:
        return error.id, "anonymous"
    return request.id, request.by


def _json(payload: bytes) -> Any:
    if len(payload) > SIZE_LIMIT:
        raise MalformedError(f"longer than {SIZE_LIMIT} bytes")
    if _depth(payload) > DEPTH_LIMIT:
        raise MalformedError(f"nested deeper than {DEPTH_LIMIT} levels")
    try:
        document = json.loads(
            payload.decode("utf-8"),
            object_pairs_hook=_no_duplicates,
            parse_constant=_no_constant,
            parse_float=_finite,
            parse_int=_exact,
        )
        json.dumps(document, ensure_ascii=False).encode("utf-8")  # lone surrogates pass the reader
    except UnicodeError:
        raise MalformedError("not UTF-8") from None
    except ValueError as error:
        raise MalformedError(f"not JSON: {error}") from None
    return document


def _depth(payload: bytes) -> int:
    """How deep brackets go, counted before parsing; those inside texts count too, which errs safely."""
    depth = deepest = 0
    for byte in payload:
        if byte in b"[{":
            depth += 1
            deepest = max(deepest, depth)
        elif byte in b"]}":
            depth -= 1
    return deepest


def _no_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    document = dict(pairs)
    if len(document) != len(pairs):
        raise MalformedError("a key is given twice")
    return document


def _no_constant(name: str) -> NoReturn:
    raise MalformedError(f"{name} is not a number")


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise MalformedError(f"{text} is too large")
    return number


def _exact(text: str) -> int:
    if len(text) > len(str(-INTEGER_LIMIT)) or abs(int(text)) > INTEGER_LIMIT:
        raise MalformedError("an integer is too large")
    return int(text)


def _check_lengths(request: Request, id: str | int | None) -> None:
    texts = [request.id, request.by, request.epoch, request.confirm, request.whom, request.reason]
    if any(isinstance(text, str) and len(text) > TEXT_LIMIT for text in texts):
        raise MalformedError(f"id and all texts have at most {TEXT_LIMIT} characters", id)


def _nanoseconds(exp: float | str, id: str | int | None) -> int:
    if isinstance(exp, str):
        return _iso_nanoseconds(exp, id)
    if abs(exp) > LATEST:
        raise MalformedError("exp is not a time", id)
    seconds = exp / 1000 if exp >= MILLISECONDS_FROM else exp
    return int(seconds * 1e9)


def _iso_nanoseconds(text: str, id: str | int | None) -> int:
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        raise MalformedError(f"exp {text!r} is not an ISO 8601 time", id) from None
    if time.tzinfo is None:
        raise MalformedError(f"exp {text!r} has no time zone (end it with Z)", id)
    return int(time.timestamp() * 1e9)
