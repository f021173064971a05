"""Lines with drives of the shipped profiles."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import cache

from gateway.mapping.load import builtin_mappings, load_profile
from gateway.mapping.profile import Profile, SerialFormat
from gateway.mapping.site import DriveConfig, LineConfig, Rs485
from gateway.simulator import Options
from gateway.simulator.build import build_drives
from gateway.simulator.drive import Drive

FORMATS = {"8N1": SerialFormat(8, "N", 1), "8N2": SerialFormat(8, "N", 2), "8E1": SerialFormat(8, "E", 1)}


@cache
def shipped(name: str) -> Profile:
    """A profile that comes with the gateway."""
    found, findings = load_profile(builtin_mappings() / f"{name}.yaml")
    assert found is not None, [str(finding) for finding in findings]
    return found


def profile() -> Profile:
    """The 7200GS."""
    return shipped("teco-7200gs")


def settings(of: Profile) -> dict[str, Fraction]:
    """The settings of a profile that have a default."""
    return {name: setting.default for name, setting in of.settings.items() if setting.default is not None}


def line_config(
    units: Iterable[int] = (5,), baud: int = 9600, form: str = "8N2", echo: bool = False, name: str = "north"
) -> LineConfig:
    """A line with drives named ``fan-<unit>``."""
    drives = tuple(
        DriveConfig(name=f"fan-{unit}", line=name, profile=profile(), unit=unit, settings=settings(profile()))
        for unit in units
    )
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
