"""Hand-made profiles of the S2000 and the SL3, straight from their documents and not from the mapping files,
so that the twins are tested against the documents alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from fractions import Fraction

from gateway.mapping.profile import (
    Access,
    Broadcast,
    Case,
    CommLoss,
    Condition,
    Constant,
    Document,
    Encoding,
    ErrorMeaning,
    Kind,
    Limits,
    ModbusFacts,
    NumberType,
    Point,
    Profile,
    SerialFacts,
    SerialFormat,
    Setting,
    Term,
    Word,
)
from gateway.mapping.site import DriveConfig, LineConfig, Rs485
from gateway.mapping.twin import External, Lock, Simulate

RUN_COMMAND = {0: "stop", 1: "forward", 2: "reverse"}
HZ_10, HZ_100 = Encoding(scale=Fraction(1, 10), symbol="Hz"), Encoding(scale=Fraction(1, 100), symbol="Hz")


def term(name: str, low: int, high: int | None = None, *, setting: bool = False) -> Term:
    """One line of a condition."""
    ends = Fraction(low), Fraction(low if high is None else high)
    return Term(name, (ends,), f"{name}: {low}", setting)


def point(name: str, address: int, kind: Kind, encoding: Encoding | None = None, **more: object) -> Point:
    """A point with the access that goes with its kind."""
    writable = kind in (Kind.SETPOINT, Kind.COMMAND, Kind.SWITCH, Kind.PARAMETER)
    made = Point(
        name=name,
        group=str(kind),
        kind=kind,
        access=Access.READ_WRITE if writable else Access.READ,
        rate="normal",
        address=address,
        encoding=encoding or Encoding(),
    )
    return replace(made, **more)  # type: ignore[arg-type]


def bits(address: int, kind: Kind, names: str, first: int = 0) -> list[Point]:
    """Single bits from ``first`` on; ``-`` leaves one out."""
    return [
        point(name, address, kind, Encoding(bit=bit, width=1))
        for bit, name in enumerate(names.split(), first)
        if name != "-"
    ]


def _named(points: Iterable[Point]) -> dict[str, Point]:
    return {each.name: each for each in points}


def _profile(name: str, points: Iterable[Point], **more: object) -> Profile:
    made = Profile(
        name=name,
        title=name,
        maker="",
        models=(name,),
        version=1,
        documents={"d": Document("d")},
        serial=SerialFacts(baud=(9600,), rtu=(SerialFormat(8, "N", 1),)),
        modbus=ModbusFacts(),
        settings={},
        errors={},
        points=_named(points),
        words={},
        commands={},
        groups={},
    )
    return replace(made, **more)  # type: ignore[arg-type]


def _s2000_points(shift: int) -> Iterable[Point]:
    stopped: Condition = (term("running", 0),)
    yield point("run_command", shift, Kind.COMMAND, Encoding(bit=0, width=2, values=RUN_COMMAND))
    yield from bits(shift, Kind.SWITCH, " ".join(f"terminal_{n}" for n in range(3, 9)), 2)
    yield point("frequency_command", 1 + shift, Kind.SETPOINT, HZ_10, cases=tuple(_s2000_units()))
    for n in (1, 2):
        volts = Encoding(type=NumberType.S16, scale=Fraction(11, 726), symbol="V")
        limits = Limits(Fraction(-11), Fraction(11))
        yield point(f"analog_output_{n}", 6 + n, Kind.SETPOINT, volts, limits=limits)
    yield from bits(0x0009, Kind.SWITCH, "output_9_10 output_25_27 output_26_27")
    yield point(
        "frequency_unit",
        0x000F,
        Kind.PARAMETER,
        Encoding(width=1, values={0: "tenth_hz", 1: "by_g1_03"}),
        only_when=stopped,
    )
    yield from bits(0x000F, Kind.SWITCH, " ".join(f"broadcast_terminal_{n}" for n in range(5, 9)), 12)
    yield from bits(
        0x0010,
        Kind.STATUS,
        "running zero_speed running_reverse reset_input speed_agree ready warning fault",
    )
    yield from bits(0x0014, Kind.FAULT, "fault_fu fault_uv1 - - - - fault_oc")
    yield from bits(0x0015, Kind.FAULT, "fault_ef3")
    yield from bits(0x0016, Kind.FAULT, "fault_ce")
    yield from bits(0x0019, Kind.FAULT, "warning_uv")
    for name, at in (("language", 0x0100), ("access", 0x0101), ("control", 0x0102), ("initialise", 0x0103)):
        yield point(name, at, Kind.PARAMETER, only_when=stopped, then="activate_parameters")
    for n in (1, 2):
        yield point(
            f"preset_frequency_{n}",
            0x027F + n,
            Kind.PARAMETER,
            HZ_100,
            only_when=stopped,
            then="activate_parameters",
        )
    yield point("enter_eeprom", 0xFFFD, Kind.COMMAND, access=Access.WRITE, wear=100000)
    yield point("enter_ram", 0xFFDD, Kind.COMMAND, access=Access.WRITE)


def _s2000_units() -> Iterable[Case]:
    by = term("frequency_unit", 1)
    yield Case((term("frequency_unit", 0),), HZ_10)
    yield Case((by, term("g1_03", 0, setting=True)), HZ_100)
    percent = Encoding(scale=Fraction(1, 10000), symbol="Hz", times="e1_04")
    yield Case((by, term("g1_03", 1, setting=True)), percent)
    speed = Encoding(scale=Fraction(1, 120), symbol="Hz", times="g1_03")
    yield Case((by, term("g1_03", 2, 39, setting=True)), speed)


def _s2000_broadcast() -> Broadcast:
    points = [
        *bits(0x0001, Kind.COMMAND, "run_all reverse_all - - external_fault_all fault_reset_all"),
        *bits(0x0001, Kind.SWITCH, " ".join(f"terminal_{n}_all" for n in range(5, 9)), 12),
        point(
            "frequency_all",
            0x0002,
            Kind.SETPOINT,
            Encoding(scale=Fraction(1, 300), symbol="%"),
            limits=Limits(Fraction(0), Fraction(100)),
        ),
    ]
    return Broadcast(_named(points), {}, {})


S2000_ACTIONS = {0: "decelerate_c1_02", 1: "decelerate_c1_09", 2: "coast", 3: "keep_running"}
S2000_TWIN = Simulate(
    factory={0x0100: 1, 0x0101: 2, 0x0102: 0, 0x0103: 0},
    max_frequency="e1_04",
    shows={"fault_ce": ("communication_lost",)},
    external_fault=External("fault_ef3"),
    reset="terminal_4",
    actions={
        "decelerate_c1_02": "decelerate",
        "decelerate_c1_09": "decelerate_fast",
        "coast": "coast",
        "keep_running": "keep_running",
    },
    comm_timeout=2.0,
    locks=(Lock((term("warning_uv", 1),), reason="undervoltage"),),
    activates="enter_ram",
    stores="enter_eeprom",
)


def s2000(shift: int = 0) -> Profile:
    """The S2000; ``shift`` 1 is the firmware whose run and frequency words are one higher."""
    reasons = {1: "illegal_function", 2: "illegal_address", 3: "illegal_count"}
    own = {0x21: "illegal_value", 0x22: "locked", 0x23: "undervoltage", 0x24: "busy"}
    return _profile(
        "s2000",
        _s2000_points(shift),
        serial=SerialFacts(
            baud=(4800,),
            rtu=(SerialFormat(8, "N", 1),),
            comm_loss=CommLoss(None, "f5_04", (term("f5_05", 0, setting=True),)),
        ),
        modbus=ModbusFacts(functions=(0x03, 0x08, 0x10), write_one=0x10, read_max=16, write_max=16),
        settings={
            "f5_04": Setting(name="f5_04", values=S2000_ACTIONS),
            "f5_05": Setting(name="f5_05", values={0: "with_detection", 1: "without_detection"}),
        },
        errors={code: ErrorMeaning(name) for code, name in (reasons | own).items()},
        words={shift: Word(shift, True, 0xFF00), 9: Word(9, True, 0xFFF8), 15: Word(15, False, 0x0FFE)},
        broadcast=_s2000_broadcast(),
        simulate=S2000_TWIN,
    )


def _sl3_points() -> Iterable[Point]:
    yield point(
        "operation_mode",
        0x1000,
        Kind.SETPOINT,
        Encoding(values={0: "communication", 1: "external", 2: "jog", 8: "panel"}),
    )
    yield from bits(0x1001, Kind.STATUS, "running running_forward running_reverse - - - - fault")
    yield point(
        "run_command",
        0x1001,
        Kind.COMMAND,
        Encoding(bit=1, width=2, values=RUN_COMMAND),
        access=Access.WRITE,
    )
    yield point("frequency_command", 0x1002, Kind.SETPOINT, HZ_100)
    cases = (Case((term("p_37", 0),), HZ_100), Case((), HZ_10))
    yield point("output_frequency", 0x1003, Kind.MEASUREMENT, HZ_100, cases=cases)
    for n, (at, bit) in enumerate([(0x1007, 0), (0x1007, 8), (0x1008, 0), (0x1008, 8)], 1):
        yield point(f"alarm_{n}", at, Kind.FAULT, Encoding(bit=bit, width=8))
    yield point("frequency_stored", 0x1009, Kind.PARAMETER, HZ_100, wear=100000, twin="frequency_command")
    yield point("monitor_selector", 0x1013, Kind.COMMAND)
    for code in (5, 6):
        select: Mapping[str, Constant] = {"monitor_selector": Constant(Fraction(code))}
        yield point(f"selected_value_{code}", 0x1012, Kind.MEASUREMENT, select=select)
    yield point(
        "reset_word",
        0x1101,
        Kind.COMMAND,
        Encoding(values={0x9696: "restart"}),
        access=Access.WRITE,
        silent=True,
        pause=3.0,
    )
    yield point("p_37", 0x0025, Kind.PARAMETER)
    yield point("p_162", 0x00A2, Kind.PARAMETER, Encoding(special={0xFFFF: "switched_off"}))


SL3_TWIN = Simulate(
    factory={0x1000: 8, 0x00A2: 0xFFFF},
    max_frequency=Fraction(650),
    base_frequency=Fraction(60),
    run_when=(term("operation_mode", 0),),
    frequency_when=(term("operation_mode", 0),),
    shows={"selected_value_5": ("dc_bus_voltage",), "selected_value_6": ("output_voltage",)},
    history=("alarm_1", "alarm_2", "alarm_3", "alarm_4"),
    alarms={"overcurrent": 16, "overvoltage": 32},
    locks=(
        Lock((term("operation_mode", 1, 8),), ("run_command", "frequency_command"), reason="illegal_value"),
    ),
    refuses={"read_only": "illegal_address", "locked": "illegal_value"},
    restarts={"reset_word": Constant(Fraction(0x9696))},
)


def sl3() -> Profile:
    """The SL3."""
    reasons = {1: "illegal_function", 2: "illegal_address", 3: "illegal_value"}
    return _profile(
        "shihlin-sl3",
        _sl3_points(),
        serial=SerialFacts(
            baud=(9600,), rtu=(SerialFormat(8, "E", 1),), ascii=(SerialFormat(7, "E", 1),), gap=0.010
        ),
        modbus=ModbusFacts(functions=(0x03, 0x06, 0x08, 0x10), read_max=20, write_max=20, bridge=True),
        errors={code: ErrorMeaning(name) for code, name in reasons.items()},
        words={0x1001: Word(0x1001, True, 0xFF01)},
        simulate=SL3_TWIN,
    )


S2000_SETTINGS = {"g1_03": Fraction(0), "e1_04": Fraction(50), "f5_04": Fraction(3), "f5_05": Fraction(1)}


def line_of(
    profile: Profile,
    units: Iterable[int] = (1,),
    framing: str = "rtu",
    form: SerialFormat | None = None,
    settings: Mapping[str, Fraction] = S2000_SETTINGS,
) -> LineConfig:
    """A line with drives ``drive-<unit>`` of one make, in the factory's character format."""
    serial = profile.serial
    return LineConfig(
        name="line",
        port="simulated:",
        framing=framing,  # type: ignore[arg-type]
        baud=9600,
        format=form or (serial.ascii if framing == "ascii" else serial.rtu)[0],
        rs485=Rs485(),
        drives=tuple(
            DriveConfig(
                name=f"drive-{unit}", line="line", profile=profile, unit=unit, settings=dict(settings)
            )
            for unit in units
        ),
    )
