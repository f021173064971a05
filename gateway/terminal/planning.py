"""A line's plan in words, as a table and as data; the data's shape stands in docs/cli.md."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from rich.table import Table

from gateway.core.planning import LinePlan
from gateway.line.forecast import Forecast, PlannedRead, Watchdog
from gateway.line.reachability import PROBE_SHARE
from gateway.line.repairs import Repair
from gateway.terminal.losing import loss_notes, loss_object
from gateway.terminal.output import gap_object

COLUMNS = ("drive", "registers", "points", "bytes", "ms", "period", "oldest", "load")


def plan_table(plan: LinePlan) -> Table:
    """The reads of a line, one a row."""
    table = Table(box=None, header_style="dim", padding=(0, 2, 0, 0))
    for column in COLUMNS:
        table.add_column(column, justify="left" if column in COLUMNS[:2] else "right", no_wrap=True)
    for read in plan.forecast.reads:
        table.add_row(*_row(plan, read))
    return table


def plan_head(plan: LinePlan) -> str:
    """What a line is and how full it gets, on one line."""
    line, forecast = plan.line, plan.forecast
    speed = line.framing if line.framing == "tcp" else f"{line.framing} {line.baud} {line.format}"
    stretched = f"; periods are stretched {forecast.stretch:.1f} times" if forecast.stretch > 1 else ""
    return (
        f"line {line.name} ({speed}): {_number(len(line.drives), 'drive')}, "
        f"{_number(len(forecast.reads), 'read')}, "
        f"load {forecast.demand:.0%}{stretched}"
    )


def plan_notes(plan: LinePlan) -> list[str]:
    """What the line promises, what it cannot do, and how that could be mended."""
    forecast = plan.forecast
    notes = [
        f"a stop has left after {_ms(forecast.write)} at most, "
        f"{_ms(forecast.write_silent)} when a drive has just gone silent",
        f"drives that do not answer are asked again in {PROBE_SHARE:.0%} of the line at most",
    ]
    if plan.mute:
        notes.append(f"{_listed(list(plan.mute))}: cannot be set to {plan.line.baud} bit/s")
    notes += [gap.text for gap in plan.gaps]
    notes += _watchdog_notes(plan)
    notes += loss_notes(plan.line)
    notes += [f"{_fit(repair.forecast)}: {repair_text(plan, repair)}" for repair in plan.repairs]
    return notes


def plan_object(plan: LinePlan) -> dict[str, Any]:
    """A line's plan for programs."""
    forecast = plan.forecast
    return {
        "line": plan.line.name,
        "framing": plan.line.framing,
        "baud": None if plan.line.framing == "tcp" else plan.line.baud,
        "drives": len(plan.line.drives),
        "mute": list(plan.mute),
        **_summary(forecast),
        "comm_loss": [_watchdog_object(plan, watchdog) for watchdog in forecast.watchdogs],
        "loss": [loss_object(drive) for drive in plan.line.drives],
        "gaps": [gap_object(gap) for gap in plan.gaps],
        "blocks": [_block_object(plan, read) for read in forecast.reads],
        "repairs": [_repair_object(plan, repair) for repair in plan.repairs],
    }


def repair_text(plan: LinePlan, repair: Repair) -> str:
    """A change and what it brings, as a sentence."""
    beside = f"{_CHANGES[repair.beside.kind](plan, repair.beside)} and " if repair.beside else ""
    change = _CHANGES[repair.kind](plan, repair)
    stretched = (
        f", periods stretched {repair.forecast.stretch:.1f} times" if repair.forecast.stretch > 1 else ""
    )
    return f"{beside}{change}: load {repair.forecast.demand:.0%}{stretched}"


def _demoted(plan: LinePlan, repair: Repair) -> str:
    drives = dict.fromkeys(plan.drive(want.unit) for want in repair.moved)
    reads = _number(round(repair.value), "read")
    return f"take {reads} out of class {repair.rate} ({_listed(list(drives))})"


_CHANGES: dict[str, Callable[[LinePlan, Repair], str]] = {
    "baud": lambda plan, repair: f"run the line at {repair.value:.0f} bit/s",
    "period": lambda plan, repair: f"read class {repair.rate} every {_seconds(repair.value)}",
    "periods": lambda plan, repair: f"make all periods {repair.value:g} times as long",
    "demote": _demoted,
    "split": lambda plan, repair: f"spread the drives over {repair.value:.0f} lines",
}


def _listed(names: list[str], most: int = 3) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def _fit(forecast: Forecast) -> str:
    return "fits" if forecast.fits else "helps"


def _watchdog_notes(plan: LinePlan) -> list[str]:
    """The drives that take the line for dead, together: those alike in one sentence."""
    alike: dict[tuple[float, bool, bool], list[Watchdog]] = {}
    for watchdog in plan.forecast.watchdogs:
        alike.setdefault((watchdog.after, watchdog.possible, watchdog.fed), []).append(watchdog)
    return [_watchdog_text(plan, same) for same in alike.values()]


def _watchdog_text(plan: LinePlan, same: list[Watchdog]) -> str:
    first = same[0]
    names = _listed([plan.drive(watchdog.unit) for watchdog in same])
    who = f"{names}: the line counts as dead after {_seconds(first.after)}"
    if not first.possible:
        return (
            f"{who}, but asking every drive once takes {first.floor:.2f} s; "
            f"{first.fitting} such drives would fit, not {len(plan.line.drives)}"
        )
    longest = max(watchdog.planned for watchdog in same)
    if math.isinf(longest):
        return f"{who}, and nothing of them is read"
    verdict = "in time" if first.fed else "too late"
    return (
        f"{who}; each is asked every {longest:.2f} s at the latest, {verdict} (at best {first.floor:.2f} s)"
    )


def _row(plan: LinePlan, read: PlannedRead) -> tuple[str, ...]:
    block = read.block
    last = block.address + block.count - 1
    period = _seconds(block.period)
    if block.period > read.wanted:
        period += f" (wanted {_seconds(read.wanted)})"
    return (
        plan.drive(block.unit),
        f"{block.address:04X}H-{last:04X}H",
        str(len(plan.points(block))),
        f"{read.request}+{read.reply}",
        f"{1000 * block.cost:.1f}",
        period,
        f"{block.worst_age:.2f} s",
        f"{block.cost / read.wanted:.1%}",
    )


def _block_object(plan: LinePlan, read: PlannedRead) -> dict[str, Any]:
    block = read.block
    return {
        "unit": block.unit,
        "drive": plan.drive(block.unit),
        "table": block.table,
        "address": block.address,
        "count": block.count,
        "points": plan.points(block),
        "request_bytes": read.request,
        "reply_bytes": read.reply,
        "cost": block.cost,
        "wanted": read.wanted,
        "period": block.period,
        "worst_age": block.worst_age,
    }


def _summary(forecast: Forecast) -> dict[str, Any]:
    return {
        "fits": forecast.fits,
        "demand": forecast.demand,
        "load": forecast.load,
        "stretch": forecast.stretch,
        "write": forecast.write,
        "probes": PROBE_SHARE,
        "write_silent": forecast.write_silent,
    }


def _watchdog_object(plan: LinePlan, watchdog: Watchdog) -> dict[str, Any]:
    return {
        "drive": plan.drive(watchdog.unit),
        "after": watchdog.after,
        "floor": watchdog.floor,
        "fitting": watchdog.fitting,
        "planned": None if math.isinf(watchdog.planned) else watchdog.planned,
        "possible": watchdog.possible,
        "fed": watchdog.fed,
    }


def _repair_object(plan: LinePlan, repair: Repair) -> dict[str, Any]:
    return {
        "kind": repair.kind,
        "value": repair.value,
        "rate": repair.rate or None,
        "beside": _repair_object(plan, repair.beside) if repair.beside else None,
        "text": repair_text(plan, repair),
        **_summary(repair.forecast),
    }


def _number(count: int, thing: str) -> str:
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def _seconds(seconds: float) -> str:
    return f"{1000 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.4g} s"


def _ms(seconds: float) -> str:
    return f"{1000 * seconds:.0f} ms"
