"""The northbound sections of a site file, and what their adapters get.

`Site.opcua` is a dict, every path absolute::

    endpoint      str         opc.tcp://127.0.0.1:4840
    security      list[str]   none, sign, sign_and_encrypt; at least one
    anonymous     bool        people without a name may read
    users_file    str         default <data>/users.yaml
    certificates  str         folder, own and trusted; default <data>/certificates

Each of `Site.mqtt` is a dict, every path absolute::

    name           str         unique among the brokers of the site
    broker         str         mqtt://host:port, mqtts://, ws://, wss://, or the word embedded
    user           str | None
    password_file  str | None
    ca_file        str | None
    client_id      str
    commands       {"role": str} | None   None: no commands from this broker
    publish        list | None            None: the default rule
    data           str         folder of this adapter alone: <data>/<name>

    publish[i]     points       list[str]   glob patterns: of point names, or with a dot of whole tags
                   rate         float       seconds
                   deadband     float | None
                   max_silence  float | None   seconds
"""

from __future__ import annotations

import ipaddress
from typing import Annotated, Any, ClassVar, Literal
from urllib.parse import SplitResult, urlsplit

from pydantic import Field, PlainValidator, WithJsonSchema

from gateway.mapping.forms import FormError
from gateway.mapping.scalars import Duration, Later, Number, Text, text_form
from gateway.mapping.shape import Entry, Filled, Shape

EMBEDDED = "embedded"
_BROKERS = ("mqtt", "mqtts", "ws", "wss")


def address(text: str, schemes: tuple[str, ...], example: str) -> SplitResult:
    """The parts of an address. Raises `FormError`, which never repeats what may hold a password."""
    try:
        parts = urlsplit(text)
        known = parts.scheme in schemes and parts.hostname and (parts.port is None or parts.port >= 0)
    except ValueError:
        raise FormError("this is not an address", f"write it like {example}") from None
    if parts.username is not None or parts.password is not None:
        raise FormError("a user or password may not stand in an address", "use `user` and `password_file`")
    if not known:
        raise FormError(f"`{text}` is not an address of this kind", f"write it like {example}")
    return parts


def _endpoint(text: str) -> str:
    address(text, ("opc.tcp",), "opc.tcp://127.0.0.1:4840")
    return text


def _broker(text: str) -> str:
    if text != EMBEDDED:
        address(text, _BROKERS, "mqtt://127.0.0.1:1883")
    return text


def _secret(_: object) -> None:
    raise FormError(
        "a password may not stand in this file",
        "put it into a file of its own and name that in `password_file`",
    )


def is_loopback(url: str) -> bool:
    """True when the address can only be reached on this machine."""
    if url == EMBEDDED:
        return True
    host = urlsplit(url).hostname or ""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


Endpoint = Annotated[str, text_form(_endpoint), WithJsonSchema({"type": "string"})]
BrokerUrl = Annotated[str, text_form(_broker), WithJsonSchema({"type": "string"})]
Secret = Annotated[None, PlainValidator(_secret), WithJsonSchema({"not": {}})]
Security = Literal["none", "sign", "sign_and_encrypt"]


class Opcua(Shape):
    """The OPC UA server."""

    least: ClassVar[dict[str, Any]] = {"endpoint": "opc.tcp://127.0.0.1:4840"}
    endpoint: Endpoint
    security: Annotated[list[Security], Filled()] = Field(default=["sign_and_encrypt"])
    anonymous: Literal["off", "read"] = "off"
    users_file: Text | None = None
    certificates: Text | None = None
    password: Secret = None


class Publish(Shape):
    """What a broker gets, and how often."""

    least: ClassVar[dict[str, Any]] = {"points": []}
    points: Annotated[list[Text], Filled()]
    rate: Text = "normal"
    deadband: Number | None = None
    max_silence: Duration | None = None


class Commanding(Entry):
    """Whether a broker may command, and as whom."""

    first: ClassVar[str] = "role"
    role: Literal["operator", "engineer", "admin"]


class Mqtt(Shape):
    """One broker."""

    least: ClassVar[dict[str, Any]] = {"broker": EMBEDDED}
    name: Text | None = None
    broker: BrokerUrl
    user: Text | None = None
    password_file: Text | None = None
    ca_file: Text | None = None
    client_id: Text | None = None
    commands: Commanding | None = None
    publish: list[Publish] | None = None
    sparkplug: Later = None
    password: Secret = None
