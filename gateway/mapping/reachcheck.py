"""Can the drive be asked for its points: do its functions, its limits and its holes allow that?"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from gateway.mapping.facts import FUNCTIONS, READ_HOLDING, READ_INPUT, WRITE_MANY, WRITE_ONE
from gateway.mapping.finding import Report, some
from gateway.mapping.layout import Layout
from gateway.mapping.profile import ModbusFacts, Point, Table


def check_reach(points: Iterable[Point], layout: Layout, modbus: ModbusFacts, report: Report) -> None:
    """Complain about points that no request can bring, once about each function that is missing."""
    there = [point for point in points if point.name not in layout.displaced]
    _check_tables(there, layout, report)
    polled = [point for point in there if point.table in (Table.HOLDING, Table.INPUT)]
    if not report.wrong(FUNCTIONS):
        _check_functions(polled, layout, modbus, report)


def check_holes(points: Iterable[Point], layout: Layout, modbus: ModbusFacts, report: Report) -> None:
    """No point may lie where nothing is. What is sent to all drives has registers of its own."""
    polled = [point for point in points if point.name not in layout.displaced]
    for first, last in modbus.holes:
        inside = [p for p in polled if p.address <= last and p.address + p.words > first]
        if inside:
            message = f"{_lie(inside)} in the hole {first:04X}H to {last:04X}H"
            _tell(inside, layout, message, "correct one of them", report)


def _check_tables(points: list[Point], layout: Layout, report: Report) -> None:
    for point in points:
        if point.table in (Table.COIL, Table.DISCRETE):
            message = f"`{point.name}` lies in the table `{point.table}`, which the line cannot poll yet"
            _tell([point], layout, message, "leave it out; its notation may stay", report)
        elif point.table is Table.INPUT and point.access.writable:
            message = f"`{point.name}` is an input register and cannot be written"
            _tell([point], layout, message, "give it a kind that is only read", report)


def _check_functions(points: list[Point], layout: Layout, modbus: ModbusFacts, report: Report) -> None:
    """The drive must speak the functions that its points need."""
    for function, mute in _mute(points, set(modbus.functions)):
        if mute:
            message = f"{_names(mute)} cannot be read without function {function:02X}H"
            _tell(mute, layout, message, "add it to `functions`", report)
    stuck = [point for point in points if _needs_writing(point, set(modbus.functions))]
    if stuck:
        message = f"no function of the drive can write {_names(stuck)}"
        _tell(stuck, layout, message, "add 10H to `functions`", report)


def _mute(points: list[Point], functions: set[int]) -> Iterator[tuple[int, list[Point]]]:
    """Each function that reads, and the points that cannot be read because the drive does not speak it."""
    for function, table in ((READ_HOLDING, Table.HOLDING), (READ_INPUT, Table.INPUT)):
        if function not in functions:
            yield function, [p for p in points if p.table is table and p.access.readable]


def _needs_writing(point: Point, functions: set[int]) -> bool:
    """True when the point is written, and no function that the drive speaks does that."""
    if not point.access.writable or point.table is not Table.HOLDING:
        return False
    return WRITE_MANY not in functions and (point.words > 1 or WRITE_ONE not in functions)


def _names(points: list[Point]) -> str:
    return some([point.name for point in points])


def _lie(points: list[Point]) -> str:
    return f"{_names(points)} {'lies' if len(points) == 1 else 'lie'}"


def _tell(points: list[Point], layout: Layout, message: str, remedy: str, report: Report) -> None:
    report.error((*layout.keys[points[0].name].path, "at"), message, remedy)
