"""The shape of a site file as it stands in YAML."""

from __future__ import annotations

import re
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, PlainValidator, WithJsonSchema

from gateway.mapping import forms
from gateway.mapping.forms import FormError
from gateway.mapping.profile import SerialFormat
from gateway.mapping.scalars import ANY_SCHEMA, Duration, Integer, Number, Text, Truth, text_form
from gateway.mapping.sections import Mqtt, Opcua, address
from gateway.mapping.shape import Entry, Filled, Shape

LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
"""What names of sites, lines and drives are made of."""
_SPEED = re.compile(r"(\d{3,7}) +(\S+)", re.ASCII)
_SPEED_SOMEHOW = re.compile(r"(\d{3,7})", re.ASCII)
_FORMAT_SOMEHOW = re.compile(r"([78])\W?([NEO])\W?([12])(?!\d)", re.ASCII)
_NETWORK = ("tcp", "modbus")
SIMULATED = "simulated:"


def label(text: str) -> str:
    """A name that can be a topic level and a node id: letters, digits, ``-`` and ``_``."""
    if not LABEL.fullmatch(text):
        meant = re.sub(r"[^A-Za-z0-9_-]+", "-", text).strip("-").lstrip("_")
        remedy = "use letters, digits, - and _, like fan-1"
        known = f"did you mean `{meant}`?" if LABEL.fullmatch(meant) else remedy
        why = ": what begins with `_` is the gateway's own" if text.startswith("_") else ""
        raise FormError(f"`{text}` cannot be a name here{why}", known)
    return text


def speed(text: str) -> tuple[int, SerialFormat]:
    """``9600 8N2``: bits per second and format of a character."""
    match = _SPEED.fullmatch(text)
    if not match:
        found = _SPEED_SOMEHOW.search(text), _FORMAT_SOMEHOW.search(text)
        like = f"{found[0][1]} {''.join(found[1].groups())}" if found[0] and found[1] else "9600 8N2"
        raise FormError(f"`{text}` is not a serial setting", f"write it like {like}")
    return int(match[1]), forms.serial_format(match[2])


def port(text: str) -> str:
    """A device path, ``tcp://host:port``, ``modbus://host:port`` or ``simulated:``.

    The colon at the end would need quotes in YAML, so the bare word means the same.
    """
    if text == SIMULATED.rstrip(":"):
        return SIMULATED
    scheme, colon, _ = text.partition("://")
    if colon and scheme not in _NETWORK:
        raise FormError(
            f"`{text}` is not a port",
            "write a device path, tcp://host:port, modbus://host:port or simulated:",
        )
    if colon and address(text, _NETWORK, "tcp://192.168.0.10:4001").port is None and scheme == "tcp":
        raise FormError(f"`{text}` names no port number", "write it like tcp://192.168.0.10:4001")
    return text


def on_expiry(value: Any) -> str:
    """``stop``, ``hold``, or ``{setpoint: 20}``, which becomes the text ``setpoint: 20``."""
    if value in ("stop", "hold"):
        return str(value)
    if isinstance(value, dict) and list(value) == ["setpoint"] and isinstance(value["setpoint"], str):
        forms.number(value["setpoint"])
        return f"setpoint: {value['setpoint']}"
    raise FormError("this is no action", "write stop, hold or {setpoint: 20}")


Label = Annotated[str, text_form(label), WithJsonSchema({"type": ["string", "integer"]})]
Speed = Annotated[tuple[int, SerialFormat], text_form(speed), WithJsonSchema({"type": "string"})]
Port = Annotated[str, text_form(port), WithJsonSchema({"type": "string"})]
OnExpiry = Annotated[str, PlainValidator(on_expiry), WithJsonSchema({"type": ["string", "object"]})]


class Control(Shape):
    """Who may command a drive, and what happens when he goes away."""

    lease: Literal["session", "required", "off"] = "session"
    ttl: Duration = 10.0
    on_expiry: OnExpiry | None = None
    takeover: Literal["operator", "engineer", "admin"] = "engineer"
    on_reappear: Literal["report", "stop"] = "report"


class LossDemand(Entry):
    """What a drive must do when the line dies."""

    first: ClassVar[str] = "action"
    action: Literal["stop", "keep_running", "any"]
    within: Duration | None = None


class BroadcastRight(Entry):
    """Who may command all drives of a line at once."""

    first: ClassVar[str] = "role"
    role: Literal["operator", "engineer", "admin"]


class Limit(Shape):
    """How fast a point may be changed."""

    step: Number | None = None
    slew: Number | None = None
    interval: Duration | None = None


class Starts(Shape):
    """Drives that do not start at the same time."""

    drives: list[Text] = Field(min_length=2)
    apart: Duration


class Rs485(Shape):
    """Options of the transceiver."""

    echo: Truth = False
    rts: Literal["none", "send_high", "send_low"] = "none"


class MemberNames(Shape):
    """How single points or commands are called outside."""

    node: Text | None = None
    browse: Text | None = None
    topic: Text | None = None

    def given(self) -> dict[str, str]:
        """The names that stand there, by key."""
        return {key: text for key, text in self if isinstance(text, str)}


class Templates(MemberNames):
    """How drives, points and commands are called outside: texts with placeholders."""

    drive_node: Text | None = None
    drive_browse: Text | None = None
    drive_topic: Text | None = None


class DriveNames(Templates):
    """The templates of one drive, and the names of single points and commands."""

    points: dict[str, MemberNames] = Field(default_factory=dict)


class Drive(Shape):
    """A drive on a line."""

    least: ClassVar[dict[str, Any]] = {"profile": "?", "unit": "0"}
    profile: Text
    unit: Integer
    ranges: dict[str, Annotated[list[Number], Field(min_length=2, max_length=2)]] = Field(
        default_factory=dict
    )
    limits: dict[str, Limit] = Field(default_factory=dict)
    wear_per_day: dict[str, Integer] = Field(default_factory=dict)
    settings: dict[str, Annotated[str, text_form(str), WithJsonSchema(ANY_SCHEMA)]] = Field(
        default_factory=dict
    )
    control: Control | None = None
    comm_loss: LossDemand | None = None
    names: DriveNames | None = None


class Line(Shape):
    """One line and its drives."""

    least: ClassVar[dict[str, Any]] = {"port": "simulated", "drives": {}}
    port: Port
    framing: Literal["rtu", "ascii"] | None = None
    serial: Speed | None = None
    rs485: Rs485 = Rs485()
    broadcast: BroadcastRight | None = None
    drives: dict[str, Drive]


class Writes(Shape):
    """Whether anything is written to any drive, and how often what wears."""

    enabled: Truth = False
    wear_per_day: Integer = 10


class Web(Entry):
    """The web page."""

    first: ClassVar[str] = "listen"
    listen: Text


class RawSite(Shape):
    """A site file."""

    least: ClassVar[dict[str, Any]] = {"site": "site", "gateway": "gateway", "lines": {}}
    site: Label
    gateway: Label
    profiles: list[Text] = Field(default_factory=list)
    lines: Annotated[dict[str, Line], Filled()]
    names: Templates = Templates()
    starts: dict[str, Starts] = Field(default_factory=dict)
    rates: dict[str, Duration] = Field(default_factory=dict)
    writes: Writes = Writes()
    comm_loss: LossDemand | None = None
    opcua: Opcua | None = None
    mqtt: list[Mqtt] = Field(default_factory=list)
    web: Web | None = None
    data: Text = "./data"
