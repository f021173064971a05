"""From the mapping to a simulated line."""

from __future__ import annotations

from collections.abc import Mapping

from gateway.mapping.site import DriveConfig, LineConfig
from gateway.mapping.twin import Simulate
from gateway.simulator.bank import UnsupportedError
from gateway.simulator.drive import FRAMINGS, Drive
from gateway.simulator.happening import Options
from gateway.simulator.model import TwinModel
from gateway.simulator.wire import WireTiming


def build_drives(line: LineConfig, options: Mapping[str, Options], speed: float = 1.0) -> dict[str, Drive]:
    """The drives of a line by name. ``options`` by drive name; where it is silent, factory settings with
    the site's ``max_frequency`` and ramps that are ``speed`` times as fast.

    Raises `UnsupportedError` when a drive does not speak the line's framing.
    """
    for config in line.drives:
        _require_framing(line, config)
    return {
        config.name: _drive(line, config, options.get(config.name) or _options(config, speed))
        for config in line.drives
    }


def wire_timing(line: LineConfig) -> WireTiming:
    """The timing that all drives of the line understand."""
    gap = max((drive.profile.serial.gap for drive in line.drives), default=0.0)
    return WireTiming(line.baud, line.format, gap, "ascii" if line.framing == "ascii" else "rtu")


def _require_framing(line: LineConfig, config: DriveConfig) -> None:
    serial = config.profile.serial
    if line.framing == "tcp":
        raise UnsupportedError(f"line {line.name}: Modbus TCP cannot be simulated, only RTU and ASCII")
    spoken = [name for name, formats in (("RTU", serial.rtu), ("ASCII", serial.ascii)) if formats]
    if line.framing.upper() not in spoken:
        raise UnsupportedError(
            f"drive {config.name}: line {line.name} speaks {line.framing.upper()}, "
            f"but {config.profile.title} speaks {' and '.join(spoken)} only"
        )


def _options(config: DriveConfig, speed: float) -> Options:
    """The site's highest frequency counts where the twin has none of its own, or one in a register."""
    facts = config.profile.simulate or Simulate()
    free = facts.max_frequency is None or facts.max_frequency in config.profile.points
    highest = config.settings.get("max_frequency") if free else None
    return Options(speed=speed, max_frequency=None if highest is None else float(highest))


def _drive(line: LineConfig, config: DriveConfig, options: Options) -> Drive:
    profile = config.profile
    return Drive(
        config.name,
        config.unit,
        TwinModel(config, line.baud, options),
        facts=profile.modbus,
        errors=profile.errors,
        framing=FRAMINGS["ascii" if line.framing == "ascii" else "rtu"],
        turnaround=options.turnaround,
    )
