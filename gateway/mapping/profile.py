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


class Table(StrEnum):
    """The four Modbus tables."""

    HOLDING = "holding"
    INPUT = "input"
    COIL = "coil"
    DISCRETE = "discrete"


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
class Provenance:
    """Where a fact comes from: a document's id and place, whether that document is about a similar
    model only, and why the fact may be wrong (None: no doubt)."""

    document: str = ""
    place: str = ""
    similar: bool = False
    doubt: str | None = None


@dataclass(frozen=True, slots=True)
class Term:
    """One line of a condition: the point's value lies in one of the closed ranges.

    Values compare as numbers: bits as 0 and 1, enumerations by their raw number, others in their unit.
    """

    name: str
    ranges: tuple[tuple[Fraction, Fraction], ...]
    text: str
    """The line as the author wrote it, for messages: ``run_source: line``."""
    setting: bool = False
    """True when ``name`` is a setting of the drive instance, not a point."""


Condition = tuple[Term, ...]
"""All terms must hold. The empty condition always holds."""

Bound = Fraction | str
"""A limit: a number in the point's unit, or the name of the setting or point that holds it."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Closed range for writing, in the point's unit."""

    low: Bound
    high: Bound


@dataclass(frozen=True, slots=True)
class Encoding:
    """How a raw value becomes an engineering value: ``raw * scale * times + offset``.

    ``bit`` and ``width`` cut a field out of one register (``width`` 0: the whole value). ``symbol`` is
    the unit's symbol, None for a plain number; ``times`` names the setting or point that multiplies.
    ``values`` names raw values both ways (an enumeration); ``patterns`` name raw values by mask and bits,
    for reading only; ``special`` names raw values that are not numbers.
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


@dataclass(frozen=True, slots=True)
class Constant:
    """A value that is always written: raw for enumerations, else in the point's unit."""

    value: Fraction


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
    silent: bool = False
    """The drive does not answer a write of this point."""
    pause: float = 0.0
    """Seconds of silence to keep after a write of this point."""
    help: str = ""
    provenance: Provenance = Provenance()

    @property
    def words(self) -> int:
        """Registers that the value occupies."""
        return self.encoding.words


@dataclass(frozen=True, slots=True)
class Word:
    """A register that is cut into fields.

    ``image`` words are written from the core's own picture of the word; the others by reading,
    changing and writing as one locked sequence. ``always`` is laid over every write: the bits of
    ``always_mask`` get the values in ``always_bits``. ``pulse_mask`` are bits that the image never keeps.
    """

    address: int
    image: bool
    always_mask: int = 0
    always_bits: int = 0
    pulse_mask: int = 0
    fields: tuple[str, ...] = ()


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
    provenance: Provenance = Provenance()


@dataclass(frozen=True, slots=True)
class ErrorMeaning:
    """What an exception code of this drive means. It is temporary if ``retry`` (ask again after so many
    seconds) or ``retry_when`` (ask again once this holds) says so, within the request's deadline."""

    name: str
    help: str = ""
    retry: float | None = None
    provenance: Provenance = Provenance()
    retry_when: Condition = ()


@dataclass(frozen=True, slots=True)
class SerialFormat:
    """Data bits, parity (``N``, ``E`` or ``O``) and stop bits."""

    data_bits: int
    parity: Literal["N", "E", "O"]
    stop_bits: int

    @property
    def bits_per_character(self) -> int:
        """Start bit, data bits, parity bit and stop bits."""
        return 1 + self.data_bits + (self.parity != "N") + self.stop_bits

    def __str__(self) -> str:
        return f"{self.data_bits}{self.parity}{self.stop_bits}"


@dataclass(frozen=True, slots=True)
class CommLoss:
    """What the drive does when the line dies: after how many seconds of silence, and the name of the
    point or setting that tells the action. None: not known. It does so only while ``when`` holds."""

    after: float | None = None
    action: str | None = None
    when: Condition = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialFacts:
    """What the drive's serial interface can do. Lists have the factory setting first."""

    baud: tuple[int, ...]
    rtu: tuple[SerialFormat, ...] = ()
    ascii: tuple[SerialFormat, ...] = ()
    units: tuple[int, int] = (1, 247)
    gap: float = 0.0
    """Least silence between frames in seconds, beside 3.5 characters; the longer counts."""
    reply_usual: float = 0.01
    """Usual seconds from the end of a request to the first character of the reply."""
    reply_max: float = 1.0
    """Seconds after which there is no reply any more."""
    pause_read: float = 0.0
    pause_write: float = 0.0
    pause_broadcast: float = 0.1
    """Seconds of silence to keep after a read, a write, a broadcast, beside the gap."""
    comm_loss: CommLoss = CommLoss()


@dataclass(frozen=True, slots=True, kw_only=True)
class ModbusFacts:
    """Which requests the drive takes."""

    functions: tuple[int, ...] = (0x03, 0x06, 0x10)
    write_one: int = 0x06
    """Function for writing one register."""
    read_max: int = 125
    write_max: int = 123
    bridge: bool = False
    """True when a read may pass over addresses that no point names."""
    holes: tuple[tuple[int, int], ...] = ()
    """Closed address ranges that no read may touch, even with ``bridge``."""
    probe: str = ""
    """``loop_back``, or the name of the point that is the cheapest question."""
    error_functions: tuple[int, ...] = ()
    """Function bytes that also mean an error reply, beside function + 80H."""


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
    provenance: Provenance = Provenance()


@dataclass(frozen=True, slots=True)
class Broadcast:
    """What may be sent to all drives at once (unit 0): points and commands in an address space of their
    own. Nothing is answered; ``until`` of a command is asked of every drive on the line."""

    points: Mapping[str, Point]
    words: Mapping[int, Word]
    commands: Mapping[str, Command]
    provenance: Provenance = Provenance()


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
