"""A small 7200GS profile made by hand, and drives and lines built from it."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from types import MappingProxyType

from gateway.mapping.profile import (
    Access,
    Document,
    Encoding,
    ErrorMeaning,
    Kind,
    ModbusFacts,
    Point,
    Profile,
    SerialFacts,
    SerialFormat,
)
from gateway.mapping.site import DriveConfig, LineConfig, Rs485
from gateway.simulator import Options
from gateway.simulator.build import build_drives
from gateway.simulator.drive import Drive

FORMATS = {"8N1": SerialFormat(8, "N", 1), "8N2": SerialFormat(8, "N", 2), "8E1": SerialFormat(8, "E", 1)}
HUNDREDTH, TENTH, ONE = Fraction(1, 100), Fraction(1, 10), Fraction(1)
NUMBERS = {
    "frequency_command": (0x0002, HUNDREDTH, "Hz"),
    "frequency_reference": (0x0023, HUNDREDTH, "Hz"),
    "output_frequency": (0x0024, HUNDREDTH, "Hz"),
    "output_current": (0x0027, TENTH, "A"),
    "output_voltage": (0x0028, ONE, "V"),
    "dc_bus_voltage": (0x0031, ONE, "V"),
    "output_power": (0x0032, TENTH, "kW"),
}
BITS = {
    "run": (0x0001, 0),
    "reverse": (0x0001, 1),
    "external_fault": (0x0001, 2),
    "fault_reset": (0x0001, 3),
    "running": (0x0020, 0),
    "running_reverse": (0x0020, 1),
    "ready": (0x0020, 2),
    "fault": (0x0020, 3),
    "fault_overcurrent": (0x0021, 0),
    "fault_external": (0x0021, 7),
    "fault_low_voltage": (0x0021, 0xC),
    "zero_speed": (0x002C, 1),
}
ERRORS = {
    0x01: "illegal_function",
    0x02: "illegal_address",
    0x03: "illegal_count",
    0x21: "illegal_value",
    0x22: "locked",
}


def _point(name: str, address: int, encoding: Encoding) -> Point:
    kind = Kind.FAULT if address == 0x0021 else Kind.STATUS
    return Point(
        name=name, group="all", kind=kind, access=Access.READ, rate="fast", address=address, encoding=encoding
    )


def profile(name: str = "teco-7200gs") -> Profile:
    """What the simulator needs of a 7200GS profile, and nothing else."""
    points = [_point(n, at, Encoding(scale=scale, symbol=unit)) for n, (at, scale, unit) in NUMBERS.items()]
    points += [_point(n, at, Encoding(bit=bit, width=1)) for n, (at, bit) in BITS.items()]
    return Profile(
        name=name,
        title="TECO 7200GS",
        maker="TECO",
        models=("7200GS",),
        version=1,
        documents={"sim": Document("SI-M manual")},
        serial=SerialFacts(baud=(9600,), rtu=(FORMATS["8N2"],), units=(1, 31)),
        modbus=ModbusFacts(functions=(0x03, 0x10), write_one=0x10, read_max=16, write_max=16),
        settings={},
        errors={code: ErrorMeaning(reason) for code, reason in ERRORS.items()},
        points=MappingProxyType({point.name: point for point in points}),
        words={},
        commands={},
        groups={"all": ""},
    )


def line_config(
    units: Iterable[int] = (5,), baud: int = 9600, form: str = "8N2", echo: bool = False, name: str = "north"
) -> LineConfig:
    """A line with drives named ``fan-<unit>``."""
    drives = tuple(DriveConfig(name=f"fan-{unit}", line=name, profile=profile(), unit=unit) for unit in units)
    return LineConfig(
        name=name,
        port="simulated:",
        framing="rtu",
        baud=baud,
        format=FORMATS[form],
        rs485=Rs485(echo=echo),
        drives=drives,
    )


def drive(options: Options | None = None) -> Drive:
    """A 7200GS at unit 5, with 3 s ramps to 60 Hz unless told otherwise."""
    return build_drives(line_config(), {"fan-5": options or Options()})["fan-5"]
