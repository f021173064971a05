"""Who wants a tag, and which read brings it, for whoever asks. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gateway.bridge.api import Demand, Reading, RefusedGap
from gateway.core.clients import Clients
from gateway.core.lines import Lines
from gateway.core.polling import Polling
from gateway.line.interface import Block
from gateway.mapping.profile import Point


def demand_for(
    tag: str, polling: Polling, lines: Lines, clients: Clients, gaps: Sequence[RefusedGap]
) -> Demand:
    """The demands on a tag, and the read that brings it: none for the gateway's own."""
    found = polling.point(tag)
    if found is None:
        return Demand(wanted=tuple(_wanted(tag, polling, clients)))
    drive, point = found
    blocks = () if point.select else lines.plan(drive.line).blocks
    reading = next(
        (_reading(b) for b in blocks if b.unit == drive.unit and b.table == point.table and _holds(b, point)),
        None,
    )
    told = (g for g in gaps if g.drive == drive.name)
    beside = tuple(g for g in told if point.name in g.points or (reading and _ends_at(reading, g)))
    return Demand(wanted=tuple(_wanted(tag, polling, clients)), reading=reading, gaps=beside)


def _ends_at(reading: Reading, gap: RefusedGap) -> bool:
    return gap.last + 1 == reading.address or reading.address + reading.count == gap.first


def _holds(block: Block, point: Point) -> bool:
    return block.address <= point.address and point.address + point.words <= block.address + block.count


def _wanted(tag: str, polling: Polling, clients: Clients) -> Iterator[tuple[str, float]]:
    for who, period in polling.demands.wanted(tag).items():
        client = clients.get(who) if isinstance(who, int) else None
        yield (client.name if client else str(who)), period


def _reading(block: Block) -> Reading:
    return Reading(
        unit=block.unit,
        table=block.table,
        address=block.address,
        count=block.count,
        period=block.period,
        cost=block.cost,
        age=block.worst_age,
    )
