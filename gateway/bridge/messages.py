"""The messages of the bridge socket, and how they are framed.

Each message is a msgpack map with a ``type``, preceded by its length in four bytes (big endian).
A client says `Hello` once and gets `Welcome`; every other request carries an ``id`` that its reply
repeats. Updates (`gateway.bridge.api.Update`) come in between at any time.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from gateway.bridge.api import (
    Batch,
    BridgeError,
    Catalogue,
    ControlState,
    Demand,
    DriveState,
    Happened,
    Health,
    LeaseAct,
    Periods,
    Replaced,
    TracePage,
)
from gateway.tag import Origin, Outcome, Sample, Value

MAX_MESSAGE = 16 * 1024 * 1024
"""Bytes; a longer announcement means that the peer is not one of ours."""

LENGTH_BYTES = 4


class Hello(msgspec.Struct, frozen=True, tag="hello"):
    """First word of a client: which API it speaks and what it calls itself."""

    version: int
    name: str


class Watch(msgspec.Struct, frozen=True, tag="watch"):
    """`Bridge.watch`; answered by `Promised`."""

    id: int
    wants: Mapping[str, float | None]


class ReadTags(msgspec.Struct, frozen=True, tag="read"):
    """`Bridge.read`; answered by `Samples`."""

    id: int
    tags: tuple[str, ...]
    max_age: float


class WriteTag(msgspec.Struct, frozen=True, tag="write"):
    """`Bridge.write`; answered by `Done`. ``key`` is the caller's at-most-once id."""

    id: int
    target: str
    value: Value
    origin: Origin
    ttl: float
    key: str
    confirm: str = ""


class RunCommand(msgspec.Struct, frozen=True, tag="command"):
    """`Bridge.command`; answered by `Done`."""

    id: int
    drive: str
    name: str
    args: Mapping[str, Value]
    origin: Origin
    ttl: float
    key: str
    confirm: str = ""


class DoLease(msgspec.Struct, frozen=True, tag="lease"):
    """`Bridge.lease`; answered by `Done`."""

    id: int
    drive: str
    act: LeaseAct
    origin: Origin
    whom: str


class ClientGone(msgspec.Struct, frozen=True, tag="client_gone"):
    """`Bridge.gone`; answered by `Done`."""

    id: int
    origin: Origin
    may_return: bool


class Maintain(msgspec.Struct, frozen=True, tag="maintain"):
    """`Bridge.maintain`; answered by `Done`."""

    id: int
    drive: str
    on: bool
    origin: Origin
    reason: str


class AskControls(msgspec.Struct, frozen=True, tag="ask_controls"):
    """`Bridge.controls`; answered by `ControlsAre`."""

    id: int


class AskHealth(msgspec.Struct, frozen=True, tag="ask_health"):
    """`Bridge.health`; answered by `HealthIs`."""

    id: int


class Acknowledge(msgspec.Struct, frozen=True, tag="acknowledge"):
    """`Bridge.acknowledge`; answered by `Done`."""

    id: int
    alarm: str
    origin: Origin


class AskDemand(msgspec.Struct, frozen=True, tag="ask_demand"):
    """`Bridge.demand`; answered by `DemandIs`."""

    id: int
    target: str


class AskTrace(msgspec.Struct, frozen=True, tag="ask_trace"):
    """`Bridge.trace`; answered by `TraceIs`."""

    id: int
    line: str
    after: int


class TurnedAway(msgspec.Struct, frozen=True, tag="turned_away"):
    """`Bridge.turned_away`; not answered."""

    id: int
    what: str
    wanted: Any
    origin: Origin
    outcome: Outcome


Look = Watch | ReadTags | AskControls | AskHealth | AskDemand | AskTrace
Act = WriteTag | RunCommand | TurnedAway | DoLease | ClientGone | Maintain | Acknowledge
Call = Look | Act
"""What a client may ask once it has said hello."""

Request = Hello | Call


class Welcome(msgspec.Struct, frozen=True, tag="welcome"):
    """The core's first word: the adapter's section of the configuration and the catalogue."""

    version: int
    section: Mapping[str, Any]
    catalogue: Catalogue


class Promised(msgspec.Struct, frozen=True, tag="promised"):
    """The period in seconds that the plan holds for each tag asked for."""

    id: int
    periods: Mapping[str, float]


class Samples(msgspec.Struct, frozen=True, tag="samples"):
    """One sample per tag asked for, in order."""

    id: int
    samples: tuple[Sample, ...]


class Done(msgspec.Struct, frozen=True, tag="done"):
    """The outcome of a write or command."""

    id: int
    outcome: Outcome


class HealthIs(msgspec.Struct, frozen=True, tag="health"):
    """Answer to `AskHealth`."""

    id: int
    health: Health


class ControlsAre(msgspec.Struct, frozen=True, tag="controls"):
    """Answer to `AskControls`, a state for each drive."""

    id: int
    states: tuple[ControlState, ...]


class DemandIs(msgspec.Struct, frozen=True, tag="demand"):
    """Answer to `AskDemand`."""

    id: int
    demand: Demand


class TraceIs(msgspec.Struct, frozen=True, tag="trace"):
    """Answer to `AskTrace`."""

    id: int
    page: TracePage


class Wrong(msgspec.Struct, frozen=True, tag="wrong"):
    """The request with this id (0: the hello) could not be served, and why."""

    id: int
    reason: str


Reply = Promised | Samples | Done | ControlsAre | HealthIs | DemandIs | TraceIs | Wrong
Response = Welcome | Reply | Batch | Periods | DriveState | ControlState | Happened | Replaced

_encoder = msgspec.msgpack.Encoder()
_requests: msgspec.msgpack.Decoder[Request] = msgspec.msgpack.Decoder(Request)
_responses: msgspec.msgpack.Decoder[Response] = msgspec.msgpack.Decoder(Response)


def pack(message: Request | Response) -> bytes:
    """The message with its length in front."""
    body = _encoder.encode(message)
    return len(body).to_bytes(LENGTH_BYTES, "big") + body


def body_length(header: bytes) -> int:
    """Length of the message behind a header.

    Raises:
        BridgeError: if the length is beyond `MAX_MESSAGE`.
    """
    length = int.from_bytes(header, "big")
    if length > MAX_MESSAGE:
        raise BridgeError(f"a message of {length} bytes was announced; at most {MAX_MESSAGE} are taken")
    return length


def unpack_request(body: bytes) -> Request:
    """The request in ``body``.

    Raises:
        BridgeError: if it is not one.
    """
    try:
        return _requests.decode(body)
    except msgspec.MsgspecError as error:
        raise BridgeError(f"not a bridge request: {error}") from error


def unpack_response(body: bytes) -> Response:
    """The response in ``body``.

    Raises:
        BridgeError: if it is not one.
    """
    try:
        return _responses.decode(body)
    except msgspec.MsgspecError as error:
        raise BridgeError(f"not a bridge response: {error}") from error
