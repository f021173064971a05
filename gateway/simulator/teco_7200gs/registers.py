"""The register map of the 7200GS with SI-M card: what exists, what it holds at first, what may be written.

From section 9 and 10 of the SI-M manual. The manual gives no scale for the groups Sn, Cn, An and bn; the
scales used here (0.01 Hz for An, 0.1 Hz, 0.1 s and 1 V elsewhere) are assumptions of this simulator.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from gateway.simulator.bank import Span
from gateway.simulator.refusal import RefusalError

OPERATION, FREQUENCY_COMMAND, OUTPUTS = 0x0001, 0x0002, 0x0009
DATA_LINK, SCAN_COUNT, MORE_STATUS, OUTPUT_MONITOR = 0x0022, 0x002B, 0x002C, 0x002D
INVERTER_STATUS, FAULT_HISTORY, LINE_ERRORS, DIP_SWITCHES = 0x0020, 0x0033, 0x003D, 0x0040
SN_02, SN_03, SN_04, SN_05, SN_08, SN_12 = 0x0101, 0x0102, 0x0103, 0x0104, 0x0107, 0x010B
CN_02, AN_01 = 0x0201, 0x0400
BN_01, BN_02, BN_04 = 0x0500, 0x0501, 0x0503

CONTROL: tuple[Span, ...] = ((0x0001, 0x0002), (0x0009, 0x0009))
MONITOR: tuple[Span, ...] = (
    (0x0020, 0x0024),
    (0x0027, 0x002D),
    (0x0031, 0x0033),
    (0x003D, 0x0040),
)
SN: tuple[Span, ...] = ((0x0100, 0x0116), (0x0118, 0x011B))
CN: tuple[Span, ...] = ((0x0200, 0x0229),)
AN: tuple[Span, ...] = ((0x0400, 0x0408),)
BN: tuple[Span, ...] = ((0x0500, 0x050B),)
SPANS = CONTROL + MONITOR + SN + CN + AN + BN
V_F_PATTERN: tuple[Span, ...] = ((0x0201, 0x0207),)
"""Cn-02 to Cn-08, which only a free V/f pattern (Sn-02 = F or FF) opens."""

AN_ONLY = 0b0101
INITIALISE = (0b1110, 0b1111)
"""Values of Sn-03."""


def _row(first: int, *values: int) -> dict[int, int]:
    return dict(enumerate(values, first))


DEFAULTS: Mapping[int, int] = MappingProxyType(
    _row(0x0100, 0x03, 0x01, 0, 0b0011, 0, 0, 0, 0, 0, 0, 0, 0b0100, 0, 0)
    | _row(0x010E, 0x03, 0x04, 0x06, 0x08, 0x00, 0x00, 0x01, 0x02, 0)
    | _row(0x0118, 0, 0, 0, 0b0100)
    | _row(0x0200, 220, 600, 220, 600, 30, 15, 15, 10, 72, 15, 50, 5, 0, 100, 0, 0, 0, 0, 10, 0, 0, 20)
    | _row(0x0216, 100, 100, 0, 160, 1, 170, 50, 160, 820, 14, 0, 25, 20, 0, 20, 150, 2, 7, 100, 3)
    | _row(0x0400, 0, 500, 1000, 1500, 2000, 2500, 3000, 3500, 600)
    | _row(0x0500, 30, 30, 100, 10, 100, 0, 10, 0, 80, 1, 50, 50)
)
"""Factory contents; 0 where nothing is listed. Ramps are 3 s from standstill to Cn-02."""

_TWO_DIGITS = (0x0100, 0x0101, *range(0x010E, 0x0112))
"""Sn-01, Sn-02 and the terminal functions Sn-15 to Sn-18 hold 00 to FF; all other Sn four bits."""


def within(address: int, spans: tuple[Span, ...]) -> bool:
    """True when the address lies in one of the spans."""
    return any(low <= address <= high for low, high in spans)


def listens(words: Mapping[int, int]) -> bool:
    """Sn-08: run or frequency comes from the line, whose loss therefore matters (section 5.3)."""
    return words[SN_08] & 0b11 != 0b11


def check_write(
    address: int, value: int, words: Mapping[int, int], *, running: bool, undervoltage: bool
) -> None:
    """Refuse what the 7200GS does not let the line write now; ``words`` are the present contents."""
    if _locked(address, words, running=running, undervoltage=undervoltage):
        raise RefusalError("locked")
    if value > _highest(address, words):
        raise RefusalError("illegal_value")


def _locked(address: int, words: Mapping[int, int], *, running: bool, undervoltage: bool) -> bool:
    """Section 10, error 22H."""
    if within(address, MONITOR):
        return True
    parameter = not within(address, CONTROL)
    return (
        (running and within(address, SN + CN))
        or (undervoltage and parameter)
        or (within(address, V_F_PATTERN) and words[SN_02] not in (0x0F, 0xFF))
        or (words[SN_03] == AN_ONLY and address != SN_03 and within(address, SN + CN + BN))
    )


def _highest(address: int, words: Mapping[int, int]) -> int:
    """The largest raw value that the register takes, else error 21H."""
    if within(address, AN) or address == FREQUENCY_COMMAND:
        return words[CN_02] * 10
    if within(address, SN):
        return 0xFF if address in _TWO_DIGITS else 0x0F
    return {OPERATION: 0x00FF, OUTPUTS: 0x0007}.get(address, 0xFFFF)


def dip_switches(unit: int, baud: int, *, delete_errors: bool) -> int:
    """Register 0040H: S1-1 to S1-5 station address, S1-7 errors deleted at reset, S2-1 and S2-2 speed."""
    speed = {2400: 0b00, 4800: 0b10, 9600: 0b01}.get(baud, 0)
    return (unit & 0x1F) | delete_errors << 6 | speed << 8
