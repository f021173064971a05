"""From the sections of plain facts to theirs in the resolved profile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from gateway.mapping import forms
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.inherit import Level, Sources
from gateway.mapping.model import (
    Addresses,
    ErrorCode,
    Errors,
    Fact,
    Modbus,
    Pauses,
    RawProfile,
    Serial,
    Sourced,
)
from gateway.mapping.model import CommLoss as RawCommLoss
from gateway.mapping.node import Path
from gateway.mapping.notation import Notations
from gateway.mapping.profile import (
    CommLoss,
    ErrorMeaning,
    ModbusFacts,
    Notation,
    Point,
    Provenance,
    SerialFacts,
    SerialFormat,
    Table,
)
from gateway.mapping.shape import nearest
from gateway.mapping.values import Conditions

STANDARD_FUNCTIONS = (*range(0x01, 0x09), 0x0B, 0x0C, 0x0F, 0x10, 0x11, *range(0x14, 0x19), 0x2B)
"""The public function codes of Modbus. A drive may speak them all; 03H, 04H, 06H, 08H and 10H are sent."""
WRITE_ONE, WRITE_MANY, LOOP_BACK, READ_HOLDING, READ_INPUT = 0x06, 0x10, 0x08, 0x03, 0x04
REASONS = (
    "illegal_function",
    "illegal_address",
    "illegal_count",
    "illegal_value",
    "locked",
    "undervoltage",
    "busy",
    "drive_failure",
)
"""What an exception code can mean; each has its OPC UA status."""
STANDARD_ERRORS = {1: "illegal_function", 2: "illegal_address", 3: "illegal_value", 4: "drive_failure"}
FUNCTIONS = ("modbus", "functions")
"""Where a profile tells its function codes."""
_LONGEST = {"read_max": 125, "write_max": 123}
_UNITS = (1, 247)
_BROADCAST_PAUSE = 0.1


def serial_facts(raw: Serial, conditions: Conditions, report: Report) -> SerialFacts:
    """What the drive's serial interface can do."""
    if raw.rtu is None and raw.ascii is None and not report.lost.inside(("serial",)):
        report.error(
            ("serial",),
            "neither `rtu` nor `ascii` is there",
            "list the formats that the drive speaks",
            key=True,
        )
        report.lost.declare("rtu")
    units = raw.units.value if raw.units else _UNITS
    if not 1 <= units[0] <= units[1] <= _UNITS[1]:
        report.error(("serial", "units"), "unit addresses go from 1 to 247", "correct the range")
    usual, longest = raw.reply.value if raw.reply else (0.01, 1.0)
    pause = raw.pause or Pauses()
    return SerialFacts(
        baud=tuple(raw.baud.value),
        rtu=_formats(raw.rtu),
        ascii=_formats(raw.ascii),
        units=units,
        gap=raw.gap.value if raw.gap else 0.0,
        reply_usual=usual,
        reply_max=longest,
        pause_read=pause.read or 0.0,
        pause_write=pause.write or 0.0,
        pause_broadcast=pause.broadcast
        if pause.broadcast is not None
        else SerialFacts(baud=()).pause_broadcast,
        comm_loss=_comm_loss(raw.comm_loss, conditions, report),
    )


def _comm_loss(raw: RawCommLoss | None, conditions: Conditions, report: Report) -> CommLoss:
    if raw is None:
        return CommLoss()
    place: Path = ("serial", "comm_loss")
    stops = raw.stops_when
    if isinstance(raw.after, str):
        _check_time(raw.after, conditions, (*place, "after"), report)
    return CommLoss(
        after=raw.after if isinstance(raw.after, float) else None,
        action=raw.action,
        when=conditions.find(raw.when, (*place, "when")),
        stops_when=None if stops is None else conditions.find(stops, (*place, "stops_when")),
        after_from=raw.after if isinstance(raw.after, str) else None,
    )


def _check_time(name: str, conditions: Conditions, place: Path, report: Report) -> None:
    """What holds a time must count in seconds."""
    found = conditions.target(name, place, key=False)
    symbol = found.encoding.symbol if isinstance(found, Point) else found.symbol if found else "s"
    if symbol != "s":
        report.error(place, f"`{name}` does not count in seconds", "give it a unit, like 0.1 s")


def _formats(fact: Fact[list[SerialFormat]] | None) -> tuple[SerialFormat, ...]:
    return tuple(fact.value) if fact else ()


def modbus_facts(raw: Modbus, notations: Notations, report: Report) -> ModbusFacts:
    """Which requests the drive takes. The probe is chosen later, when the points are known."""
    functions = tuple(raw.functions.value) if raw.functions else ModbusFacts().functions
    for index, code in enumerate(functions):
        if code not in STANDARD_FUNCTIONS:
            message = f"{code:02X}H is no function of standard Modbus"
            report.error((*FUNCTIONS, index), message, "leave it out")
    write_one = raw.write_one.value if raw.write_one else WRITE_ONE if WRITE_ONE in functions else WRITE_MANY
    if raw.write_one and (write_one not in functions or write_one not in (WRITE_ONE, WRITE_MANY)):
        report.error(
            ("modbus", "write_one"),
            f"function {write_one:02X}H cannot write one register here",
            "use 06H or 10H, and list it in `functions`",
        )
    return ModbusFacts(
        functions=functions,
        write_one=write_one,
        read_max=_at_most("read_max", raw.read_max, report),
        write_max=_at_most("write_max", raw.write_max, report),
        bridge=raw.bridge.value if raw.bridge else False,
        holes=tuple(_holes(raw, notations, report)),
        error_functions=_functions(raw.error_functions),
    )


def _functions(span: Fact[tuple[int, int]] | None) -> tuple[int, ...]:
    return tuple(range(span.value[0], span.value[1] + 1)) if span else ()


def _at_most(key: str, fact: Fact[int] | None, report: Report) -> int:
    limit = _LONGEST[key]
    value = fact.value if fact else limit
    if value > limit:
        report.error(("modbus", key), f"Modbus allows at most {limit} registers", f"write {limit} or less")
    return value


def _holes(raw: Modbus, notations: Notations, report: Report) -> list[tuple[int, int]]:
    holes = []
    for index, text in enumerate(raw.holes.value if raw.holes else []):
        try:
            low, _, high = text.partition("..")
            first = notations.find(low.strip()).address
            last = notations.find(high.strip()).address if high else first
            if first > last:
                raise FormError(f"the hole `{text}` is empty", "put the lower end first")
            holes.append((first, last))
        except FormError as error:
            report.error(("modbus", "holes", index), error.message, error.remedy)
    return holes


def facts_with_provenance(raw: RawProfile, sources: Sources) -> Mapping[str, Provenance]:
    """Provenance of every plain fact that the file states, as ``serial.reply``."""
    found = {}
    for name in ("serial", "modbus"):
        section: Sourced = getattr(raw, name)
        for key in (key for key in type(section).model_fields if key in section.model_fields_set):
            fact: Any = getattr(section, key)
            if isinstance(fact, Sourced):
                levels: list[Level] = [((name,), section), ((name, key), fact)]
                found[f"{name}.{key}"] = sources.of(levels)
    return MappingProxyType(found)


def notation_facts(raw: Addresses, sources: Sources) -> tuple[Notation, ...]:
    """The notations of the manual, as they are declared."""
    return tuple(
        Notation(
            pattern=pattern,
            weights=MappingProxyType(entry.weights),
            add=entry.add,
            table=Table(entry.table),
            example=entry.example,
            provenance=sources.of([(("addresses",), raw), (("addresses", pattern), entry)]),
        )
        for pattern, entry in (raw.__pydantic_extra__ or {}).items()
    )


def error_meanings(
    raw: Errors | None, conditions: Conditions, sources: Sources, report: Report
) -> dict[int, ErrorMeaning]:
    """Exception code to its meaning; the standard's own where the profile has no table."""
    if raw is None:
        return {code: ErrorMeaning(name) for code, name in STANDARD_ERRORS.items()}
    result: dict[int, ErrorMeaning] = {}
    for key, entry in (raw.__pydantic_extra__ or {}).items():
        path: Path = ("errors", key)
        code = _code(key, path, report)
        if code is None or report.lost.hurts(path):
            continue
        if code in result:
            report.error(path, f"the code {code:02X}H stands here twice", "keep one of them", key=True)
        meaning = _meaning(entry, [(("errors",), raw), (path, entry)], sources, report)
        held = conditions.find(entry.retry_when, (*path, "retry_when"))
        result[code] = replace(meaning, retry_when=held)
    return result


def _code(text: str, path: Path, report: Report) -> int | None:
    try:
        code = forms.integer(text)
    except FormError as error:
        report.error(path, error.message, error.remedy, key=True)
        return None
    if not 1 <= code <= 0xFF:
        report.error(path, f"`{text}` is no exception code", "write 01H to FFH", key=True)
        return None
    return code


def _meaning(entry: ErrorCode, levels: list[Level], sources: Sources, report: Report) -> ErrorMeaning:
    if entry.name not in REASONS:
        report.error(
            levels[-1][0], f"`{entry.name}` is not a reason for an error", nearest(entry.name, list(REASONS))
        )
    return ErrorMeaning(entry.name, entry.help or "", entry.retry, sources.of(levels))
