"""A command as the bridge will get it: read from its payload and held against the catalogue."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from gateway.bridge.api import DEFAULT_TTL, LeaseAct, OwnerInfo
from gateway.northbound.mqtt.freshness import time_to_live
from gateway.northbound.mqtt.message import Incoming
from gateway.northbound.mqtt.request import MalformedError, Request, lenient_id, parse
from gateway.northbound.mqtt.topics import LEASE, MAINTENANCE
from gateway.tag import Value

STOPS = ("stop", "stop_all")
"""The commands that are taken without id, time, epoch or even a readable payload."""

Content = bool | int | float | str | dict[str, bool | int | float | str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """One write or command. ``content`` is a mapping of arguments for a command, else the value.
    ``ttl`` counts from the moment the message came, in seconds."""

    drive: str
    name: str
    content: Content
    id: str | int | None
    by: str
    ttl: float
    own: str = ""
    """One of `gateway.northbound.mqtt.topics.OWN`: it is for the gateway itself, about the drive."""
    confirm: str = ""
    whom: str = ""
    reason: str = ""

    @property
    def key(self) -> tuple[str, ...]:
        """What makes two orders the same one, for as long as this adapter remembers."""
        return (self.drive, self.name, self.by, str(self.id))

    @property
    def bridge_id(self) -> str:
        """The order's id for the core, which remembers across a restart of this adapter, whatever end or
        epoch a retry carries; empty (never the same) for a stop."""
        return "" if self.is_stop else "\n".join(self.key)

    @property
    def fingerprint(self) -> bytes:
        """What the order asks for, exactly: ``true`` is not ``1``."""
        about = (self.content, self.confirm, self.whom, self.reason)
        return msgspec.json.encode(about, order="sorted")

    @property
    def args(self) -> dict[str, Value] | None:
        """The arguments if this is a command, None if it is the write of a point."""
        return dict(self.content) if isinstance(self.content, dict) else None

    @property
    def value(self) -> Value:
        """The value to write; None if this is a command."""
        return None if isinstance(self.content, dict) else self.content

    @property
    def is_stop(self) -> bool:
        """True for the commands that overtake everything."""
        return self.name in STOPS and isinstance(self.content, dict)


def read_order(drive: OwnerInfo, name: str, incoming: Incoming) -> Order:
    """The order in a message.

    Raises:
        RejectedError: if it is malformed or not fresh.
    """
    is_command = any(command.name == name for command in drive.commands)
    if is_command and name in STOPS:
        id, by = lenient_id(incoming.payload)
        return Order(drive=drive.name, name=name, content={}, id=id, by=by, ttl=DEFAULT_TTL)
    return _order(drive, name, incoming, is_command=is_command)


def has_member(drive: OwnerInfo, name: str) -> bool:
    """Whether a drive has a point or command of that name."""
    return name in [point.name for point in drive.points] + [command.name for command in drive.commands]


def read_unknown_order(drive: OwnerInfo, name: str, incoming: Incoming) -> Order:
    """An order for what the drive has not (`has_member`): the core refuses it, in the words of every
    protocol. What has arguments is taken for a command.

    Raises:
        RejectedError: as `read_order`.
    """
    return _order(drive, name, incoming)


def _order(drive: OwnerInfo, name: str, incoming: Incoming, *, is_command: bool | None = None) -> Order:
    request = _identified(incoming)
    if request.whom or request.reason:
        raise MalformedError("from and reason belong to lease and maintenance", request.id)
    ttl = time_to_live(incoming, request)
    is_command = request.args is not msgspec.UNSET if is_command is None else is_command
    content = _arguments(name, request) if is_command else _value(name, request)
    return Order(
        drive=drive.name,
        name=name,
        content=content,
        id=request.id,
        by=request.by or "anonymous",
        ttl=ttl,
        confirm=request.confirm,
    )


def read_own_order(drive: OwnerInfo, name: str, incoming: Incoming) -> Order:
    """An order about a drive to the gateway itself: its lease (``v`` is acquire, renew, release or take) or
    maintenance (``v`` is true or false). It must be as fresh as any: an old renewal would keep the lease of
    a dead client alive.

    Raises:
        RejectedError: if it is malformed or not fresh.
    """
    request = _identified(incoming)
    ttl = time_to_live(incoming, request)
    value = _value(name, request)
    if name == LEASE and value not in list(LeaseAct):
        raise MalformedError(f"v is one of {', '.join(LeaseAct)}", request.id)
    if name == MAINTENANCE and not isinstance(value, bool):
        raise MalformedError("v is true or false", request.id)
    return Order(
        drive=drive.name,
        name=name,
        content=value,
        id=request.id,
        by=request.by or "anonymous",
        ttl=ttl,
        own=name,
        whom=request.whom,
        reason=request.reason,
    )


def _identified(incoming: Incoming) -> Request:
    request = parse(incoming.payload)
    if request.id is None:
        raise MalformedError("no id: it is what keeps a command from being carried out twice")
    return request


def _arguments(name: str, request: Request) -> Content:
    if request.v is not msgspec.UNSET:
        raise MalformedError(f"{name} is a command: it takes args, not v", request.id)
    return {} if isinstance(request.args, msgspec.UnsetType) else request.args


def _value(name: str, request: Request) -> Content:
    if request.args is not msgspec.UNSET:
        raise MalformedError(f"{name} is not a command: it takes v, not args", request.id)
    if request.v is None or isinstance(request.v, msgspec.UnsetType):
        raise MalformedError(f"{name} takes a value: v", request.id)
    return request.v
