"""A drive profile, resolved: every default applied, every name looked up, every number exact.

This is what the rest of the gateway works with; `model` is the YAML shape it is made from and
`resolve` does the making. All numbers are exact (`fractions.Fraction`), all times are seconds, all
register addresses are wire addresses (0-based, as they stand in the frame).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from fractions import Fraction
from types import MappingProxyType
from typing import Literal

from gateway.mapping.condition import OURS as OURS  # noqa: PLC0414
from gateway.mapping.condition import UNSTATED
from gateway.mapping.condition import Bound as Bound  # noqa: PLC0414
from gateway.mapping.condition import Condition as Condition  # noqa: PLC0414
from gateway.mapping.condition import Constant as Constant  # noqa: PLC0414
from gateway.mapping.condition import NameFact as NameFact  # noqa: PLC0414
from gateway.mapping.condition import Provenance as Provenance  # noqa: PLC0414
from gateway.mapping.condition import Term as Term  # noqa: PLC0414
from gateway.mapping.device import CommLoss as CommLoss  # noqa: PLC0414
from gateway.mapping.device import ModbusFacts as ModbusFacts  # noqa: PLC0414
from gateway.mapping.device import Notation as Notation  # noqa: PLC0414
from gateway.mapping.device import SerialFacts as SerialFacts  # noqa: PLC0414
from gateway.mapping.device import SerialFormat as SerialFormat  # noqa: PLC0414
from gateway.mapping.device import Table as Table  # noqa: PLC0414
from gateway.mapping.twin import Simulate
from gateway.tag import Role, ValueType


class Kind(StrEnum):
    """What sort of thing a point is; gives access, role and rate their defaults."""

    STATUS = "status"
    MEASUREMENT = "measurement"
    FAULT = "fault"
    COUNTER = "counter"
    SETPOINT = "setpoint"
    COMMAND = "command"
    SWITCH = "switch"
    PARAMETER = "parameter"


class Access(StrEnum):
    """What the register allows."""

    READ = "read"
    WRITE = "write"
    READ_WRITE = "read-write"

    @property
    def readable(self) -> bool:
        """True unless the register is write-only."""
        return self is not Access.WRITE

    @property
    def writable(self) -> bool:
        """True unless the register is read-only."""
        return self is not Access.READ


class NumberType(StrEnum):
    """How the raw bits of a value are to be understood."""

    U16 = "u16"
    S16 = "s16"
    U32 = "u32"
    S32 = "s32"
    U64 = "u64"
    F32 = "f32"
    BCD = "bcd"
    TEXT = "text"


WordOrder = Literal["high_first", "low_first"]


@dataclass(frozen=True, slots=True)
class Limits:
    """Closed range for writing, in the point's unit."""

    low: Bound
    high: Bound


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast a point may be changed (T3). None and 0: no bound.

    ``step`` is the most that one write may change, in the point's unit; ``slew`` the rate at which the core
    takes the drive to a new value, in the unit per second; ``interval`` the least time between two frames
    that write it, in seconds.
    """

    step: Fraction | None = None
    slew: Fraction | None = None
    interval: float = 0.0

    def within(self, other: Pace) -> Pace:
        """The narrower of both, bound by bound."""
        steps = [step for step in (self.step, other.step) if step is not None]
        slews = [slew for slew in (self.slew, other.slew) if slew is not None]
        return Pace(min(steps, default=None), min(slews, default=None), max(self.interval, other.interval))


FREELY = Pace()


@dataclass(frozen=True, slots=True)
class Encoding:
    """How a raw value becomes an engineering value: ``raw * scale * times + offset``.

    ``bit`` and ``width`` cut a field out of one register (``width`` 0: the whole value). ``symbol`` is
    the unit's symbol, None for a plain number; ``times`` names the setting or point that multiplies.
    ``values`` names raw values both ways (an enumeration); ``patterns`` name raw values by mask and bits,
    for reading only; ``special`` names raw values that are not numbers. ``counts`` are the least and the
    greatest raw value that is ever written, None where the type alone bounds it.
    """

    type: NumberType = NumberType.U16
    words: int = 1
    word_order: WordOrder = "high_first"
    bit: int = 0
    width: int = 0
    active_low: bool = False
    scale: Fraction = Fraction(1)
    symbol: str | None = None
    times: str | None = None
    offset: Fraction = Fraction(0)
    values: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    special: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    patterns: tuple[tuple[int, int, str], ...] = ()
    counts: tuple[int, int] | None = None

    @property
    def value_type(self) -> ValueType:
        """The type that clients see: one bit without names is a boolean, a unit makes a number."""
        if self.type is NumberType.TEXT:
            return ValueType.TEXT
        if self.width == 1 and not self.values:
            return ValueType.BOOLEAN
        if self.values or self.patterns:
            return ValueType.INTEGER
        plain = self.symbol is None and self.scale == 1 and self.times is None and self.offset == 0
        return ValueType.INTEGER if plain and self.type is not NumberType.F32 else ValueType.NUMBER


@dataclass(frozen=True, slots=True)
class Case:
    """One way in which a point is to be understood; the symbol is the same in all cases of a point."""

    when: Condition
    encoding: Encoding
    limits: Limits | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One datum of a profile: where it is, what it means, how it may be written."""

    name: str
    group: str
    kind: Kind
    access: Access
    rate: str
    address: int
    encoding: Encoding
    table: Table = Table.HOLDING
    notation: str = ""
    """The address as the manual writes it: ``Cn-02`` or ``0024H``."""
    limits: Limits | None = None
    role: Role | None = None
    """Least role that may write it; None when it is read-only."""
    by_command_only: bool = False
    """Kind ``command``: reachable by the profile's commands, not by a single write."""
    only_when: Condition = ()
    pulse: float = 0.0
    """Seconds that a written field is held before it is written 0 again; 0: not a pulse."""
    wear: int | Literal["unknown"] | None = None
    danger: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    """Raw values that do harm, and what they do."""
    pace: Pace = FREELY
    when: Condition = ()
    """The point exists only while this holds; otherwise it has no value and says so."""
    cases: tuple[Case, ...] = ()
    """What depends on the drive's state: the first case whose condition holds replaces encoding and
    limits. When there are cases and none holds, the point has no value and cannot be written."""
    select: Mapping[str, Constant] = field(default_factory=lambda: MappingProxyType({}))
    """Points that are written before each access, as one locked sequence (indexed access)."""
    then: str | None = None
    """Command to run after a write, once per batch of writes."""
    twin: str | None = None
    """The point that holds the same value without wear."""
    shift: str | None = None
    """Setting that is added to the address; None once the profile is specialised."""
    silent: bool = False
    """The drive does not answer a write of this point."""
    pause: float = 0.0
    """Seconds of silence to keep after a write of this point."""
    sets: str | None = None
    """In a broadcast: the point of each drive that it changes; what is in % is a share of its upper limit."""
    help: str = ""
    provenance: Provenance = UNSTATED
    names: Mapping[int, NameFact] = field(default_factory=lambda: MappingProxyType({}))
    """What is known of each name of the encoding, by raw value."""

    @property
    def words(self) -> int:
        """Registers that the value occupies."""
        return self.encoding.words


@dataclass(frozen=True, slots=True)
class Word:
    """A register that is cut into fields.

    Of ``image`` words the core keeps what was commanded last, for a stop and where the word cannot be
    read; any other change reads, changes and writes as one locked sequence. In every write the bits of
    ``always_mask`` get the values in ``always_bits``. ``pulse_mask`` are bits that the image never keeps.
    """

    address: int
    image: bool
    always_mask: int = 0
    always_bits: int = 0
    pulse_mask: int = 0
    fields: tuple[str, ...] = ()
    shift: str | None = None
    """As `Point.shift`."""


@dataclass(frozen=True, slots=True)
class Argument:
    """A value that the caller gives: the argument's name, and whether its sign is turned."""

    name: str
    negate: bool = False


@dataclass(frozen=True, slots=True)
class Step:
    """One transaction of a command and what proves it.

    The registers of ``write`` lie together, so that they travel in one frame. An empty ``until`` means
    that the written values are read back. ``within`` bounds the proof, in seconds.
    """

    write: Mapping[str, Constant | Argument]
    until: Condition = ()
    within: float = 1.0
    when: Condition = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A named sequence of steps. ``urgent`` (the command ``stop``) overtakes everything."""

    name: str
    args: Mapping[str, str]
    """Argument name to the point that lends type, unit and limits."""
    steps: tuple[Step, ...]
    only_when: Condition = ()
    role: Role = Role.OPERATOR
    urgent: bool = False
    help: str = ""
    provenance: Provenance = UNSTATED


@dataclass(frozen=True, slots=True)
class ErrorMeaning:
    """What an exception code of this drive means. It is temporary if ``retry`` (ask again after so many
    seconds) or ``retry_when`` (ask again once this holds) says so, within the request's deadline."""

    name: str
    help: str = ""
    retry: float | None = None
    provenance: Provenance = UNSTATED
    retry_when: Condition = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """A fact that only the panel or the plant knows; given per drive in the site file."""

    name: str
    default: Fraction | None = None
    low: Fraction | None = None
    high: Fraction | None = None
    symbol: str | None = None
    values: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    help: str = ""
    provenance: Provenance = UNSTATED
    names: Mapping[int, NameFact] = field(default_factory=lambda: MappingProxyType({}))
    """What is known of each name, by raw value."""


@dataclass(frozen=True, slots=True)
class Broadcast:
    """What may be sent to all drives at once (unit 0): points and commands in an address space of their
    own. Nothing is answered; ``until`` of a command is asked of every drive on the line."""

    points: Mapping[str, Point]
    words: Mapping[int, Word]
    commands: Mapping[str, Command]
    provenance: Provenance = UNSTATED


@dataclass(frozen=True, slots=True)
class Document:
    """A source document; ``similar`` when it describes another model."""

    title: str
    similar: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Everything the gateway knows about one drive model."""

    name: str
    title: str
    maker: str
    models: tuple[str, ...]
    version: int
    documents: Mapping[str, Document]
    notations: tuple[Notation, ...] = ()
    serial: SerialFacts
    modbus: ModbusFacts
    settings: Mapping[str, Setting]
    errors: Mapping[int, ErrorMeaning]
    points: Mapping[str, Point]
    """By name, in the order of the file."""
    words: Mapping[int, Word]
    """Registers that are cut into fields, by address."""
    commands: Mapping[str, Command]
    groups: Mapping[str, str]
    """Group name to its one-sentence help."""
    broadcast: Broadcast | None = None
    facts: Mapping[str, Provenance] = field(default_factory=lambda: MappingProxyType({}))
    """Where the plain facts of the sections come from, by key: ``serial.reply``."""
    simulate: Simulate | None = None
    """Assumptions for the simulated twin; only the simulator looks at them."""
