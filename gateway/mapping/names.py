"""Names shared across makes, so that a change of make is a change of one word in a site file."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator

from gateway.mapping.profile import Point
from gateway.mapping.units import SYMBOLS
from gateway.tag import ValueType

BIT = "one bit"
NUMBER = "a number or an enumeration"

STANDARD: dict[str, str] = {
    "run": BIT,
    "reverse": BIT,
    "run_command": NUMBER,
    "frequency_command": "frequency",
    "frequency_stored": "frequency",
    "frequency_reference": "frequency",
    "output_frequency": "frequency",
    "output_current": "current",
    "output_voltage": "voltage",
    "output_power": "power",
    "dc_bus_voltage": "voltage",
    "running": BIT,
    "running_forward": BIT,
    "running_reverse": BIT,
    "ready": BIT,
    "fault": BIT,
    "warning": BIT,
    "zero_speed": BIT,
    "speed_agree": BIT,
    "frequency_source": NUMBER,
    "run_source": NUMBER,
    "comm_loss_action": NUMBER,
    "operation_mode": NUMBER,
    "drive_state": NUMBER,
}
"""Name of a point to its meaning: one bit, a number, or what its unit measures."""

COMMANDS = (
    "run_forward",
    "run_reverse",
    "stop",
    "reset_fault",
    "take_control",
    "activate_parameters",
    "store_parameters",
    "restart",
)
"""Names of commands."""

_FAMILIES = re.compile(r"(input|terminal|previous_fault|preset_frequency)_\d+|(fault|warning)_[a-z0-9_]+")
_TYPO = 0.9


def misused(point: Point) -> str | None:
    """What the standard name of a point ought to mean, when it means something else."""
    meaning = STANDARD.get(point.name)
    if meaning is None or meaning in _meanings(point):
        return None
    return meaning if meaning in (BIT, NUMBER) else f"a {meaning}"


def _meanings(point: Point) -> Iterator[str]:
    encoding = point.encoding
    yield BIT if encoding.value_type is ValueType.BOOLEAN else NUMBER
    if encoding.symbol is not None:
        yield SYMBOLS[encoding.symbol]


def near_miss(name: str, standard: list[str]) -> str | None:
    """The standard name that ``name`` abbreviates or misspells; None when it is one or is unlike all."""
    if name in STANDARD or name in COMMANDS or _FAMILIES.fullmatch(name):
        return None
    typo = difflib.get_close_matches(name, standard, n=1, cutoff=_TYPO)
    if typo:
        return typo[0]
    return next((known for known in standard if _abbreviates(name, known)), None)


def _abbreviates(name: str, known: str) -> bool:
    """``out_freq`` abbreviates ``output_frequency``: each part begins the other's."""
    ours, theirs = name.split("_"), known.split("_")
    return (
        len(ours) == len(theirs) > 1
        and all(len(a) > 1 and b.startswith(a) for a, b in zip(ours, theirs, strict=True))
        and ours != theirs
    )
