"""From the mapping to a simulated line: which behaviour belongs to which profile."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from gateway.mapping.site import DriveConfig, LineConfig
from gateway.simulator.bank import UnsupportedError
from gateway.simulator.drive import Drive
from gateway.simulator.happening import Options
from gateway.simulator.teco_7200gs.model import Teco7200gs
from gateway.simulator.wire import WireTiming

MODELS = MappingProxyType({"teco-7200gs": Teco7200gs})
"""Profile name to behaviour. A new drive is a new entry here."""


def build_drives(line: LineConfig, options: Mapping[str, Options], speed: float = 1.0) -> dict[str, Drive]:
    """The drives of a line by name. ``options`` by drive name; where it is silent, factory settings with
    the site's ``max_frequency`` and ramps that are ``speed`` times as fast."""
    if line.framing != "rtu":
        raise UnsupportedError(f"line {line.name}: only RTU can be simulated so far, not {line.framing}")
    return {
        config.name: _drive(config, line.baud, options.get(config.name) or _options(config, speed))
        for config in line.drives
    }


def wire_timing(line: LineConfig) -> WireTiming:
    """The timing that all drives of the line understand."""
    gap = max((drive.profile.serial.gap for drive in line.drives), default=0.0)
    return WireTiming(line.baud, line.format, gap)


def _options(config: DriveConfig, speed: float) -> Options:
    highest = config.settings.get("max_frequency")
    if highest is None:
        return Options(speed=speed)
    return Options(speed=speed, max_frequency=float(highest))


def _drive(config: DriveConfig, baud: int, options: Options) -> Drive:
    profile = config.profile
    if profile.name not in MODELS:
        raise UnsupportedError(
            f"drive {config.name}: profile {profile.name} cannot be simulated so far, "
            f"only {', '.join(MODELS)}"
        )
    model = MODELS[profile.name](config, baud, options)
    return Drive(
        config.name,
        config.unit,
        model,
        facts=profile.modbus,
        errors=profile.errors,
        turnaround=options.turnaround,
    )
