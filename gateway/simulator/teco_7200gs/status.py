"""The monitor words of the 7200GS whose bits the profile need not name (SI-M manual, section 9.2)."""

from __future__ import annotations

from gateway.simulator.bank import Bank
from gateway.simulator.frame import LineError
from gateway.simulator.state import DriveState, named_values
from gateway.simulator.teco_7200gs import registers as reg

DATA_LINK_BITS = {"locked": 1 << 1, "illegal_address": 1 << 2, "illegal_value": 1 << 3}
"""0022H: writing mode error, parameter number error, parameter value out of range."""
LINE_ERROR_BITS = {LineError.CRC: 1 << 0, LineError.LENGTH: 1 << 1, LineError.TIMEOUT: 1 << 6}
"""003DH."""


def publish(bank: Bank, state: DriveState, *, undervoltage: bool) -> None:
    """Bring all monitor registers up to date."""
    outputs = bank.words[reg.OUTPUTS]
    bank.words[reg.INVERTER_STATUS] = _inverter_status(state) | outputs << 5
    bank.words[reg.OUTPUT_MONITOR] = outputs
    bank.words[reg.MORE_STATUS] = _more_status(state, undervoltage) | (bank.words[reg.SN_08] & 0b11) << 9
    bank.show(named_values(state))


def count_scan(bank: Bank) -> None:
    """002BH, "the number of scan": taken as a running count of requests."""
    bank.words[reg.SCAN_COUNT] = (bank.words[reg.SCAN_COUNT] + 1) & 0xFFFF


def remember_fault(bank: Bank, code: int) -> None:
    """0033H: four nibbles, the latest fault in the lowest."""
    bank.words[reg.FAULT_HISTORY] = (bank.words[reg.FAULT_HISTORY] << 4 | code) & 0xFFFF


def _inverter_status(state: DriveState) -> int:
    """0020H without the outputs in bits 5 to 7."""
    return _bits(state.running, state.reverse, state.ready, state.fault)


def _more_status(state: DriveState, undervoltage: bool) -> int:
    """002CH without bits 9 and A: command sources that are not the line."""
    low = _bits(
        state.running, state.zero_speed, state.speed_agree, False, False, False, state.ready, undervoltage
    )
    return low | state.fault << 0xE | state.communication_lost << 0xF


def _bits(*flags: bool) -> int:
    """The first flag is bit 0."""
    return sum(flag << bit for bit, flag in enumerate(flags))
