"""The shape of a profile as it stands in YAML: keys and their forms, nothing looked up yet.

`gateway.mapping.resolve` makes a `gateway.mapping.profile.Profile` out of it.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Generic, Literal, TypeVar

from pydantic import ConfigDict, Discriminator, Field, Tag

from gateway.mapping.profile import Access, Kind
from gateway.mapping.scalars import (
    Address,
    Bits,
    Byte,
    Count,
    Duration,
    Durations,
    Format,
    Integer,
    Misplaced,
    Name,
    Number,
    Span,
    Text,
    TimeOrName,
    Truth,
    UnitOf,
    Wear,
    WholeSpan,
)
from gateway.mapping.shape import Entry, Filled, Shape
from gateway.mapping.simulate import RawSimulate

T = TypeVar("T")


class Sourced(Shape):
    """Provenance, which covers everything below it."""

    source: Text | None = None
    doubt: Text | None = None


class Fact(Entry, Sourced, Generic[T]):
    """A plain fact, alone or with its provenance."""

    first: ClassVar[str] = "is"
    lists: ClassVar[bool] = True
    value: T = Field(alias="is")


class Document(Entry):
    """A source document."""

    least: ClassVar[dict[str, Any]] = {"title": "?"}
    first: ClassVar[str] = "title"
    title: Text
    similar: Truth = False


def _list_or_one(value: object) -> str:
    return "|list|" if isinstance(value, list) else "|one|"


OneOrMore = Annotated[
    Annotated[Text, Tag("|one|")] | Annotated[list[Text], Tag("|list|")], Discriminator(_list_or_one)
]
Condition = dict[str, OneOrMore]
"""Name to a value, a range, or a list of them."""


class Notation(Sourced):
    """How an address of the manual becomes a wire address: a weight for each ``<part>``."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Integer] = Field(init=False)
    example: Text
    add: Integer = 0
    table: Literal["holding", "input", "coil", "discrete"] = "holding"

    @property
    def weights(self) -> dict[str, int]:
        """Part of the notation to what it counts."""
        return dict(self.__pydantic_extra__ or {})


class CommLoss(Sourced):
    """What the drive does when the line dies."""

    after: TimeOrName | None = None
    action: Name | None = None
    when: Condition | None = None
    stops_when: Condition | None = None


class Pauses(Sourced):
    """Silence to keep after a read, a write, a broadcast."""

    read: Duration | None = None
    write: Duration | None = None
    broadcast: Duration | None = None


class Serial(Sourced):
    """Facts of the serial interface."""

    least: ClassVar[dict[str, Any]] = {"baud": []}
    baud: Fact[list[Count]]
    rtu: Fact[list[Format]] | None = None
    ascii: Fact[list[Format]] | None = None
    units: Fact[WholeSpan] | None = None
    gap: Fact[Duration] | None = None
    reply: Fact[Durations] | None = None
    pause: Pauses | None = None
    comm_loss: CommLoss | None = None


class Modbus(Sourced):
    """Facts of the protocol."""

    functions: Fact[list[Byte]] | None = None
    write_one: Fact[Byte] | None = None
    read_max: Fact[Count] | None = None
    write_max: Fact[Count] | None = None
    bridge: Fact[Truth] | None = None
    holes: Fact[list[Address]] | None = None
    probe: Fact[Name] | None = None
    words: Fact[Literal["high_first", "low_first"]] | None = None
    error_functions: Fact[WholeSpan] | None = None
    identity: Condition | None = None


class NamedValue(Entry, Sourced):
    """The name of a raw value."""

    first: ClassVar[str] = "name"
    name: Name
    help: Text | None = None


def _table_or_name(value: object) -> str:
    return "|name|" if isinstance(value, str) else "|table|"


ValueTable = dict[str, NamedValue]
Values = Annotated[
    Annotated[Name, Tag("|name|")] | Annotated[ValueTable, Tag("|table|")], Discriminator(_table_or_name)
]
"""Raw value to name, or the name of a shared table."""


class Setting(Sourced):
    """A fact that only the panel or the plant knows."""

    unit: UnitOf | None = None
    range: Span | None = None
    default: Text | None = None
    values: Values | None = None
    help: Text | None = None


class ErrorCode(Entry, Sourced):
    """What an exception code means."""

    first: ClassVar[str] = "name"
    name: Name
    help: Text | None = None
    retry: Duration | None = None
    retry_when: Condition | None = None


class Understanding(Sourced):
    """How a raw value is to be understood, and while what holds."""

    when: Condition | None = None
    type: Text | None = None
    words: Literal["high_first", "low_first"] | None = None
    unit: UnitOf | None = None
    times: Name | None = None
    offset: Number | None = None
    values: Values | None = None
    special: dict[str, Name] | None = None
    range: Span | None = None
    counts: WholeSpan | None = None


class Case(Understanding):
    """What replaces keys of the entry while ``when`` holds; without ``when`` always."""


class Traits(Understanding):
    """The keys that a group, a register, a field or a point may carry; the nearest one wins."""

    kind: Kind | None = None
    rate: Literal["fast", "normal", "slow"] | None = None
    access: Access | None = None
    only_when: Condition | None = None
    wear: Wear | None = None
    danger: dict[str, Text] | None = None
    step: Number | None = None
    slew: Number | None = None
    interval: Duration | None = None
    shift: Name | None = None
    cases: list[Case] | None = None
    select: dict[str, Text] | None = None
    then: Name | None = None


class BitField(Entry, Traits):
    """A field of a register."""

    least: ClassVar[dict[str, Any]] = {"bit": "0"}
    first: ClassVar[str] = "bit"
    bit: Bits
    repeat: WholeSpan | None = None
    stride: Count | None = None
    active: Literal["high", "low"] = "high"
    always: Integer | None = None
    pulse: Duration | None = None
    help: Text | None = None


class Register(Entry, Traits):
    """A point, or with ``bits`` a register that is cut into fields."""

    least: ClassVar[dict[str, Any]] = {"at": "0000H"}
    first: ClassVar[str] = "at"
    at: Address
    bits: dict[str, BitField] | None = None
    image: Truth = False
    repeat: WholeSpan | None = None
    stride: Count | None = None
    help: Text | None = None
    silent: Truth = False
    twin: Name | None = None
    pause: Duration | None = None
    sets: Name | None = None
    active: Misplaced = None
    always: Misplaced = None
    pulse: Misplaced = None


class Group(Traits):
    """Points that share keys."""

    least: ClassVar[dict[str, Any]] = {"points": {}}
    help: Text | None = None
    points: dict[str, Register]


class Step(Shape):
    """One transaction and what proves it."""

    least: ClassVar[dict[str, Any]] = {"write": {}}
    write: dict[str, Text]
    until: Condition | None = None
    within: Duration = 1.0
    when: Condition | None = None


class Command(Sourced):
    """A named list of steps."""

    least: ClassVar[dict[str, Any]] = {"steps": []}
    help: Text | None = None
    args: dict[str, Name] = Field(default_factory=dict)
    only_when: Condition | None = None
    steps: Annotated[list[Step], Filled()]


class Addresses(Sourced):
    """Notations by pattern."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Notation] = Field(init=False)


class Settings(Sourced):
    """Settings by name."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Setting] = Field(init=False)


class Errors(Sourced):
    """Exception codes by number."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, ErrorCode] = Field(init=False)


class Commands(Sourced):
    """Commands by name."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Command] = Field(init=False)


class Broadcast(Traits):
    """What may be sent to all drives at once, in an address space of its own."""

    least: ClassVar[dict[str, Any]] = {"points": {}}
    points: Annotated[dict[str, Register], Filled()]
    commands: dict[str, Command] = Field(default_factory=dict)


class RawProfile(Shape):
    """A profile file."""

    least: ClassVar[dict[str, Any]] = {
        "profile": "?",
        "title": "?",
        "maker": "?",
        "models": [],
        "version": "1",
        "documents": {},
        "serial": {"baud": []},
        "groups": {},
    }

    profile: Text
    title: Text
    maker: Text
    models: Annotated[list[Text], Filled()]
    version: Count
    like: Text | None = None
    documents: Annotated[dict[str, Document], Filled()]
    addresses: Addresses = Addresses()
    serial: Serial
    modbus: Modbus = Modbus()
    settings: Settings = Settings()
    values: dict[str, ValueTable] = Field(default_factory=dict)
    errors: Errors | None = None
    groups: Annotated[dict[str, Group], Filled()]
    commands: Commands = Commands()
    broadcast: Broadcast | None = None
    simulate: RawSimulate | None = None
