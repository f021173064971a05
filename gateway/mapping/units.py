"""The unit symbols that profiles may use."""

from __future__ import annotations

SYMBOLS: dict[str, str] = {
    "Hz": "frequency",
    "kHz": "frequency",
    "r/min": "speed",
    "A": "current",
    "mA": "current",
    "V": "voltage",
    "mV": "voltage",
    "W": "power",
    "kW": "power",
    "hp": "power",
    "kWh": "energy",
    "MWh": "energy",
    "Nm": "torque",
    "%": "ratio",
    "°C": "temperature",
    "K": "temperature",
    "ohm": "resistance",
    "mohm": "resistance",
    "mH": "inductance",
    "ms": "time",
    "s": "time",
    "min": "time",
    "h": "time",
    "Hz/s": "ramp",
    "bar": "pressure",
    "kPa": "pressure",
    "m3/h": "flow",
}
"""Symbol to what it measures."""
