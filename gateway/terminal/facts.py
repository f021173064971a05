"""The plain facts of a profile as data for programs: serial, Modbus, settings, errors."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from gateway.mapping.profile import ErrorMeaning, ModbusFacts, Notation, SerialFacts, Setting

DERIVED = ("gap_characters",)
"""Keys beside the facts of a section that no profile states."""
GAP_CHARACTERS = 3.5
"""Silence before a message that Modbus RTU demands of everybody; the longer of this and `gap` counts."""


def notation_object(notation: Notation) -> dict[str, Any]:
    """How the manual writes addresses: each part times its weight, and a constant, is the wire address."""
    return {
        "pattern": notation.pattern,
        "weights": dict(notation.weights),
        "add": notation.add,
        "table": notation.table,
        "example": notation.example,
    }


def serial_object(serial: SerialFacts) -> dict[str, Any]:
    """The serial interface; times are seconds, lists have the factory setting first."""
    loss = serial.comm_loss
    return {
        "baud": list(serial.baud),
        "rtu": [str(form) for form in serial.rtu],
        "ascii": [str(form) for form in serial.ascii],
        "units": list(serial.units),
        "gap": serial.gap,
        "gap_characters": GAP_CHARACTERS,
        "reply": [serial.reply_usual, serial.reply_max],
        "pause": {
            "read": serial.pause_read,
            "write": serial.pause_write,
            "broadcast": serial.pause_broadcast,
        },
        "comm_loss": {
            "after": loss.after,
            "action": loss.action,
            "when": [term.text for term in loss.when],
            "stops_when": None if loss.stops_when is None else [term.text for term in loss.stops_when],
            "after_from": loss.after_from,
        },
    }


def modbus_object(modbus: ModbusFacts) -> dict[str, Any]:
    """Which requests the drive takes."""
    return {
        "functions": [_byte(code) for code in modbus.functions],
        "write_one": _byte(modbus.write_one),
        "read_max": modbus.read_max,
        "write_max": modbus.write_max,
        "bridge": modbus.bridge,
        "holes": [[f"{low:04X}H", f"{high:04X}H"] for low, high in modbus.holes],
        "probe": modbus.probe,
        "error_functions": [_byte(code) for code in modbus.error_functions],
        "identity": [term.text for term in modbus.identity],
    }


def setting_object(setting: Setting) -> dict[str, Any]:
    """A fact that the site file gives per drive; without a default it must."""
    low, high = setting.low, setting.high
    default = None if setting.default is None else number(setting.default)
    return {
        "name": setting.name,
        "unit": setting.symbol,
        "range": None if low is None or high is None else [number(low), number(high)],
        "default": setting.values.get(int(default), default) if default is not None else None,
        "values": {str(raw): name for raw, name in setting.values.items()},
        "help": setting.help,
    }


def error_object(code: int, error: ErrorMeaning) -> dict[str, Any]:
    """What an exception code means, and whether it is asked again: after so many seconds, or once a
    condition holds."""
    return {
        "code": _byte(code),
        "name": error.name,
        "help": error.help,
        "retry": error.retry,
        "retry_when": [term.text for term in error.retry_when],
    }


def number(value: Fraction) -> int | float:
    """The nearest number of JSON."""
    return int(value) if value.denominator == 1 else float(value)


def _byte(value: int) -> str:
    return f"{value:02X}H"
