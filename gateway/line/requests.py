"""What a unit may be asked: its facts turned into requests, or into a refusal with its reason."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from gateway.line.interface import Read, UnitFacts, Want, Write
from gateway.mapping.profile import Table
from gateway.modbus import pdu

BROADCAST = 0

LENGTHS = 24
"""A read may be so many registers longer than what is wanted of it, to look unlike other answers."""

_FUNCTIONS = {Table.HOLDING: pdu.READ_HOLDING, Table.INPUT: pdu.READ_INPUT}


def shape_of(read: Read) -> pdu.Shape:
    """What can be known beforehand of the reply to a read."""
    return pdu.read_shape(read.count, _FUNCTIONS[read.table])


def request_of(facts: UnitFacts, asked: Read | Write) -> pdu.Request:
    """The one request that does what is asked. Raises `ValueError` when the unit cannot take it."""
    return understood(facts, _read(facts, asked) if isinstance(asked, Read) else _write(facts, asked))


def understood(facts: UnitFacts, request: pdu.Request) -> pdu.Request:
    """The request, whose error replies are known in every form that the unit gives them."""
    return replace(request, error_functions=facts.error_functions) if facts.error_functions else request


def check_want(facts: UnitFacts, want: Want) -> None:
    """Raises `ValueError` when no single read can ever fetch what is wanted."""
    if want.period <= 0:
        raise ValueError(f"a period of {want.period} s; it must be above 0")
    _read(facts, Read(want.unit, want.address, want.count, want.table))


def may_read(facts: UnitFacts, address: int, count: int) -> bool:
    """True when the unit lets these registers be read at once."""
    last = address + count - 1
    if count > facts.read_max:
        return False
    if any(low <= address and last <= high for low, high in facts.readable):
        return True
    return facts.bridge and _known(facts, address) and _known(facts, last) and not _hole(facts, address, last)


def without(facts: UnitFacts, gaps: tuple[tuple[int, int], ...]) -> UnitFacts:
    """The facts of a unit of which no read takes in or passes over these addresses."""
    readable = facts.readable
    for first, last in gaps:
        parts = [((low, min(high, first - 1)), (max(low, last + 1), high)) for low, high in readable]
        readable = tuple(part for both in parts for part in both if part[0] <= part[1])
    return replace(facts, readable=readable, holes=(*facts.holes, *gaps))


def longer(facts: UnitFacts, read: Read) -> Iterator[Read]:
    """The read itself and longer ones that bring its registers too, one of each length, the shortest
    first."""
    yield read
    last = read.address + read.count - 1
    for count in range(read.count + 1, min(facts.read_max, read.count + LENGTHS) + 1):
        for first in range(max(0, last - count + 1), read.address + 1):
            if may_read(facts, first, count):
                yield Read(read.unit, first, count, read.table)
                break


def broadcast_facts(units: Sequence[UnitFacts]) -> UnitFacts:
    """What all units of a line take: the facts for writing to address 0."""
    functions = set.intersection(*(set(facts.functions) for facts in units)) if units else set()
    return UnitFacts(
        unit=BROADCAST,
        functions=tuple(sorted(functions)),
        read_max=0,
        write_max=min((facts.write_max for facts in units), default=0),
        write_one=pdu.WRITE_MANY if pdu.WRITE_MANY in functions else pdu.WRITE_ONE,
        readable=(),
        probe=(0, 0),
        pause_broadcast=max((facts.pause_broadcast for facts in units), default=0.0),
    )


def _known(facts: UnitFacts, address: int) -> bool:
    return any(low <= address <= high for low, high in facts.readable)


def _hole(facts: UnitFacts, first: int, last: int) -> bool:
    return any(low <= last and first <= high for low, high in facts.holes)


def _read(facts: UnitFacts, asked: Read) -> pdu.Request:
    if asked.table not in _FUNCTIONS:
        raise ValueError(f"table {asked.table}: only holding and input registers can be read so far")
    function = _FUNCTIONS[asked.table]
    _check_function(facts, function)
    if not may_read(facts, asked.address, asked.count):
        raise ValueError(
            f"unit {facts.unit}: {asked.count} registers from {asked.address:04X}H cannot be read at once"
        )
    return pdu.read_registers(asked.address, asked.count, function)


def _write(facts: UnitFacts, asked: Write) -> pdu.Request:
    if len(asked.words) > facts.write_max:
        raise ValueError(
            f"{len(asked.words)} registers in one write; unit {facts.unit} takes {facts.write_max}"
        )
    function = facts.write_one if len(asked.words) == 1 else pdu.WRITE_MANY
    _check_function(facts, function)
    if function == pdu.WRITE_ONE:
        return pdu.write_register(asked.address, asked.words[0])
    return pdu.write_registers(asked.address, asked.words)


def _check_function(facts: UnitFacts, function: int) -> None:
    if function not in facts.functions:
        raise ValueError(f"unit {facts.unit} does not have function {function:02X}H")
